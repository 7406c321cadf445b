// cmd_hdr.c - nacre hdr: the frames of a bracket into radiance.
#define _GNU_SOURCE
#include "calib/bracket.h"
#include "calib/response_file.h"
#include "core/imgfile.h"
#include "core/log.h"
#include "core/mem.h"
#include "process/exposure.h"
#include "process/hdr.h"
#include "ui/commands.h"
#include "ui/frames.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct args {
    const char *times, *response, *method, *scales, *out;
    bool linear;
    double saturation;
};

static const struct opt opts[] = {
    {"times", OPT_LIST, offsetof(struct args, times), "exif|nominal|T,..", "exif",
     "exposure times: from the files, snapped to the camera's third stops (1/15 is 1/16 s); as "
     "printed there; or given, in the order of the images"},
    {"linear", OPT_FLAG, offsetof(struct args, linear),
     .help = "8-bit samples are proportional to exposure"},
    {"response", OPT_FILE, offsetof(struct args, response), "auto|srgb|FILE", "auto",
     "curve of 8-bit samples: recovered from this bracket, sRGB, or a record of 'nacre calib "
     "response'"},
    {"method", OPT_CHOICE, offsetof(struct args, method), hdr_methods, "poisson",
     "weights: inverse variance, hat of ln X, or Gaussian times t^2"},
    {"scales", OPT_CHOICE, offsetof(struct args, scales), "auto|off", "auto",
     "correct every exposure by what neighbouring frames share (light drift, shutter)"},
    {"saturation", OPT_NUM, offsetof(struct args, saturation), "LEVEL", NULL,
     "linear samples from here on are saturated (default: the file's white level, or the plateau "
     "that the frames end in)"},
    {"o", OPT_FILE, offsetof(struct args, out), "OUT", NULL,
     ".exr with variance and mask, or .pfm .hdr .png .tif with radiance alone", .needed = true},
    {0},
};

static bool get_times(const struct args *a, struct frames *f, struct err *e)
{
    const bool exif = !strcmp(a->times, "exif"), nominal = !strcmp(a->times, "nominal");
    if (!exif && !nominal) {
        double t[BRACKET_MAX];
        const int n = cli_numbers(a->times, UNIT_S, t, BRACKET_MAX, e);
        if (n < 0)
            return err_in(e, "--times");
        if (n != f->n)
            return err_set(e, ERR_DATA, "--times: %d times for %d images", n, f->n);
        memcpy(f->time_s, t, (size_t)n * sizeof *t);
    }
    for (int k = 0; k < f->n; k++) {
        if (isnan(f->time_s[k]))
            return err_set(e, ERR_DATA,
                           "%s: no exposure time inside (EXIF or expTime): give --times T,..",
                           f->path[k]);
        if (!(f->time_s[k] > 0))
            return err_set(e, ERR_DATA, "%s: exposure time %g s must be above 0", f->path[k],
                           f->time_s[k]);
        if (exif && f->printed_times)
            f->time_s[k] = exposure_snap(f->time_s[k]);
    }
    int p, q;
    if (exposure_same(f->time_s, f->n, &p, &q))
        return err_set(e, ERR_DATA,
                       "%s and %s have the same exposure time, %.4g s: a bracket "
                       "needs different ones",
                       f->path[p], f->path[q], f->time_s[p]);
    return true;
}

static int shortest(const struct frames *f)
{
    int best = 0;
    for (int k = 1; k < f->n; k++)
        if (f->time_s[k] < f->time_s[best])
            best = k;
    return best;
}

// The frame that should see everything sees nothing: say so before fitting curves to it.
static bool check_visible(const struct frames *f, const struct response *r, struct err *e)
{
    const size_t n = (size_t)f->w * (size_t)f->h * (size_t)f->nc;
    const int k = shortest(f);
    size_t i = 0;
    while (i < n && f->code[k][i] > r->code_max)
        i++;
    if (i == n)
        return err_set(e, ERR_DATA,
                       "%s: every pixel is saturated, even in this shortest exposure (%.4g s)",
                       f->path[k], f->time_s[k]);
    for (int j = 0; j < f->n; j++)
        for (i = 0; i < n; i++)
            if (f->code[j][i] >= r->code_min)
                return true;
    return err_set(e, ERR_DATA, "%s: every pixel is black, as in all the frames", f->path[0]);
}

// The curve and the exposure corrections of an 8-bit bracket.
static bool get_response(const struct args *a, const struct frames *f, struct bracket *b,
                         struct response *r, double *log_scale, struct cli *cli, struct err *e)
{
    const bool automatic = !strcmp(a->response, "auto") && !a->linear;
    const bool scales = !strcmp(a->scales, "auto");
    struct record rec, now;
    int unlinked = 0;
    if (a->linear && strcmp(a->response, "auto"))
        return err_set(e, ERR_USAGE, "--linear and --response exclude each other");
    if (a->linear)
        response_linear(r, f->nc);
    else
        response_srgb(r, f->nc);
    if (!check_visible(f, r, e))
        return false;
    if (automatic) {
        const bool robertson = !strcmp(a->method, "robertson");
        if (!(robertson ? response_robertson(r, b, e)
                        : response_debevec(r, b, scales ? log_scale : NULL, e)))
            return err_in(e, "%s and %d more", f->path[0], f->n - 1);
        doc_num(cli->doc, "response.residual", r->residual);
        doc_int(cli->doc, "response.pixels", r->pixels);
        if (!robertson)
            return true;
    } else if (!a->linear && strcmp(a->response, "srgb")) {
        struct image im = {.w = f->w, .h = f->h, .nc = f->nc, .meta = f->meta};
        record_init(&now, "response", "", NAN, "");
        record_from_image(&now, &im);
        now.w = now.h = 0; // a curve holds at any resolution, aperture
        now.aperture = NAN;
        if (!response_read(r, &rec, a->response, e) || !record_fits(&rec, a->response, &now, e))
            return false;
    }
    if (scales)
        exposure_drift_codes(b, r, log_scale, &unlinked);
    return true;
}

static bool merge_codes(const struct args *a, const struct frames *f, enum hdr_method method,
                        double *log_scale, struct image *out, struct hdr_counts *counts,
                        struct cli *cli, struct err *e)
{
    struct response r;
    double time_s[BRACKET_MAX];
    memcpy(time_s, f->time_s, (size_t)f->n * sizeof *time_s);
    struct bracket b = {.n = f->n,
                        .w = f->w,
                        .h = f->h,
                        .nc = f->nc,
                        .code = (const uint8_t *const *)f->code,
                        .time_s = time_s};
    if (!get_response(a, f, &b, &r, log_scale, cli, e))
        return false;
    for (int k = 0; k < f->n; k++)
        time_s[k] *= exp(log_scale[k]);
    return hdr_merge_codes(&b, &r, method, out, counts, e) || err_in(e, "%s", f->path[0]);
}

static bool merge_linear(const struct args *a, const struct frames *f, enum hdr_method method,
                         double *log_scale, struct image *out, struct hdr_counts *counts,
                         struct cli *cli, struct err *e)
{
    double time_s[BRACKET_MAX];
    memcpy(time_s, f->time_s, (size_t)f->n * sizeof *time_s);
    struct hdr_frames h = {.n = f->n,
                           .w = f->w,
                           .h = f->h,
                           .nc = f->nc,
                           .px = (const float *const *)f->px,
                           .time_s = time_s,
                           .saturation = f->saturation};
    int unlinked = 0;
    if (!isnan(a->saturation))
        h.saturation = a->saturation;
    if (!strcmp(a->scales, "auto"))
        exposure_drift(&h, log_scale, &unlinked);
    for (int k = 0; k < f->n; k++)
        time_s[k] *= exp(log_scale[k]);
    h.noise = exposure_noise(&h);
    if (isfinite(h.saturation))
        doc_num(cli->doc, "saturation", h.saturation);
    doc_num(cli->doc, "noise.gain", h.noise.gain);
    doc_num(cli->doc, "noise.read", sqrt(h.noise.read));
    return hdr_merge(&h, method, out, counts, e) || err_in(e, "%s", f->path[0]);
}

static enum hdr_method method_of(const char *name)
{
    return !strcmp(name, "poisson")   ? HDR_POISSON
           : !strcmp(name, "debevec") ? HDR_DEBEVEC
                                      : HDR_ROBERTSON;
}

// Radiance alone, for files that hold no more than a picture.
static void keep_radiance(struct image *im)
{
    const size_t n = (size_t)im->w * (size_t)im->h, step = (size_t)im->nc, nc = step / 2;
    for (size_t k = 0; k < n; k++)
        memmove(im->px + k * nc, im->px + k * step, nc * sizeof(float));
    im->nc = (int)nc;
    meta_set_text(&im->meta, "channels", nc == 1 ? "Y" : "R,G,B");
}

static void describe(struct image *im, const struct frames *f, const struct args *a,
                     const double *log_scale, const struct cli *cli)
{
    static const char *const kept[] = {"cameraModel", "capDate", "aperture", "isoSpeed"};
    double scale[BRACKET_MAX];
    char *names = xstrdup("");
    for (size_t k = 0; k < sizeof kept / sizeof *kept; k++) {
        double v;
        const char *text = meta_text(&f->meta, kept[k]);
        if (text)
            meta_set_text(&im->meta, kept[k], text);
        else if (meta_num(&f->meta, kept[k], &v))
            meta_set_num(&im->meta, kept[k], v);
    }
    for (int k = 0; k < f->n; k++) {
        scale[k] = exp(log_scale[k]);
        char *more = xasprintf("%s%s%s", names, k ? "\n" : "", f->path[k]);
        free(names);
        names = more;
    }
    meta_set_text(&im->meta, "nacre.version", NACRE_VERSION);
    meta_set_text(&im->meta, "nacre.command", cli->line);
    meta_set_text(&im->meta, "nacre.inputs", names);
    meta_set_text(&im->meta, "nacre.hdr.method", a->method);
    meta_set_nums(&im->meta, "nacre.hdr.time_s", f->time_s, f->n);
    meta_set_nums(&im->meta, "nacre.hdr.scale", scale, f->n);
    free(names);

    doc_int(cli->doc, "frames", f->n);
    doc_nums(cli->doc, "time_s", f->time_s, f->n);
    doc_nums(cli->doc, "scale", scale, f->n);
}

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct args *a = args;
    struct frames f = {0};
    struct image out = {0};
    struct hdr_counts counts = {0};
    double log_scale[BRACKET_MAX] = {0};
    const enum hdr_method method = method_of(a->method);
    if (!isnan(a->saturation) && !(a->saturation > 0))
        return err_set(e, ERR_DATA, "--saturation: must be above 0");
    if (!frames_read(&f, cli->n, cli->operand, e))
        return false;
    doc_text(cli->doc, "output", a->out);
    doc_text(cli->doc, "method", a->method);
    bool ok = get_times(a, &f, e) && (f.code[0] ? merge_codes : merge_linear)(
                                         a, &f, method, log_scale, &out, &counts, cli, e);
    if (ok) {
        const double all = (double)counts.samples;
        describe(&out, &f, a, log_scale, cli);
        doc_num(cli->doc, "range_stops", hdr_range_stops(&out));
        doc_num(cli->doc, "valid_share",
                (double)(counts.samples - counts.saturated - counts.black) / all);
        doc_num(cli->doc, "saturated_share", (double)counts.saturated / all);
        doc_num(cli->doc, "black_share", (double)counts.black / all);
        if (strcmp(path_ext(a->out), ".exr"))
            keep_radiance(&out);
        ok = image_write(&out, a->out, e);
    }
    image_finish(&out);
    frames_finish(&f);
    return ok;
}

const struct command cmd_hdr = {
    .name = "hdr",
    .summary = "merge the frames of a bracket into radiance",
    .operands = "IMAGE...",
    .min_operands = 1,
    .max_operands = BRACKET_MAX,
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes =
        "Writes radiance, its variance and a mask (1 where every channel was measured).\n"
        "  nacre hdr bracket/*.jpg --times exif -o radiance.exr\n"
        "  nacre hdr a.pfm b.pfm c.pfm --times 1/60s,1/15s,1/4s --saturation 4000 -o radiance.exr",
    .run = run,
};
