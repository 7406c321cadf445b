// hdr_job.c - merging a bracket with the records of its camera.
#define _GNU_SOURCE
#include "ui/hdr_job.h"
#include "calib/response_file.h"
#include "core/log.h"
#include "process/exposure.h"
#include "process/mosaic.h"
#include "ui/session_frames.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool get_times(const struct hdr_options *o, struct frames *f, struct err *e)
{
    const bool exif = !strcmp(o->times, "exif"), nominal = !strcmp(o->times, "nominal");
    if (!exif && !nominal) {
        double t[BRACKET_MAX];
        const int n = cli_numbers(o->times, UNIT_S, t, BRACKET_MAX, e);
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
    if (!f->repeats && exposure_same(f->time_s, f->n, &p, &q))
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

// The camera moved: merging would smear what it is meant to measure.
static bool check_shift(const struct hdr_job *job, struct cli *cli, struct err *e)
{
    const struct frames *f = &job->frames;
    double largest = 0, sigma = 0;
    int at = -1;
    for (int k = 0; k < f->n; k++) {
        const double d = hypot(job->shift[k].dx_px, job->shift[k].dy_px);
        if (job->shift[k].known && d >= largest) {
            largest = d;
            sigma = job->shift[k].sigma_px;
            at = k;
        }
    }
    if (at >= 0) {
        doc_num(cli->doc, "shift.largest_px", largest);
        doc_num(cli->doc, "shift.sigma_px", sigma);
    }
    if (at >= 0 && largest > job->opt->max_shift_px && largest > 5 * sigma)
        return err_set(e, ERR_DATA,
                       "%s: is shifted by (%.2f, %.2f) px against the shortest exposure, more than "
                       "--max-shift %g px: the camera moved",
                       f->path[at], job->shift[at].dx_px, job->shift[at].dy_px,
                       job->opt->max_shift_px);
    return true;
}

// Lights drift by some per cent between frames; a factor is a mistake.
static bool check_scales(const struct hdr_job *job, struct err *e)
{
    const struct frames *f = &job->frames;
    for (int k = 1; k < f->n; k++) {
        const double step = job->log_scale[k] - job->log_scale[k - 1];
        if (fabs(step) > log(1.7))
            return err_set(e, ERR_DATA,
                           "%s: shows %.2f times the light of %s at the same place: not these "
                           "exposure times, or another scene",
                           f->path[k], exp(step), f->path[k - 1]);
    }
    return true;
}

// The curve and the exposure corrections of an 8-bit bracket.
static bool get_response(struct hdr_job *job, struct bracket *b, struct response *r,
                         struct cli *cli, struct err *e)
{
    const struct hdr_options *o = job->opt;
    const struct frames *f = &job->frames;
    const bool automatic = !strcmp(o->response, "auto") && !o->linear;
    const bool scales = !strcmp(o->scales, "auto");
    struct record rec, now = f->now;
    int unlinked = 0;
    if (o->linear)
        response_linear(r, f->nc);
    else
        response_srgb(r, f->nc);
    if (!check_visible(f, r, e))
        return false;
    if (automatic) {
        const bool robertson = !strcmp(o->method, "robertson");
        if (!(robertson ? response_robertson(r, b, e)
                        : response_debevec(r, b, scales ? job->log_scale : NULL, e)))
            return err_in(e, "%s and %d more", f->path[0], f->n - 1);
        doc_num(cli->doc, "response.residual", r->residual);
        doc_int(cli->doc, "response.pixels", r->pixels);
        if (!robertson)
            return true;
    } else if (!o->linear && strcmp(o->response, "srgb")) {
        now.w = now.h = 0; // a curve holds at any resolution, through any lens
        now.aperture = now.focus_per_m = now.distance_m = NAN;
        *now.lens = 0;
        if (!response_read(r, &rec, o->response, e) || !record_fits(&rec, o->response, &now, e))
            return false;
    }
    if (scales)
        exposure_drift_codes(b, r, job->log_scale, &unlinked);
    return true;
}

static bool merge_codes(struct hdr_job *job, enum hdr_method method, struct cli *cli, struct err *e)
{
    const struct frames *f = &job->frames;
    struct response r;
    double time_s[BRACKET_MAX];
    memcpy(time_s, f->time_s, (size_t)f->n * sizeof *time_s);
    struct bracket b = {.n = f->n,
                        .w = f->w,
                        .h = f->h,
                        .nc = f->nc,
                        .code = (const uint8_t *const *)f->code,
                        .time_s = time_s};
    if (!get_response(job, &b, &r, cli, e))
        return false;
    if (!check_scales(job, e))
        return false;
    for (int k = 0; k < f->n; k++)
        time_s[k] *= exp(job->log_scale[k]);
    return align_codes(&b, &r, job->shift, e) && check_shift(job, cli, e) &&
           (hdr_merge_codes(&b, &r, method, &job->out, &job->counts, e) ||
            err_in(e, "%s", f->path[0]));
}

// The noise of linear samples: the record's, or what the bracket itself shows.
static bool get_noise(const struct hdr_job *job, struct hdr_frames *h, struct cli *cli,
                      struct err *e)
{
    struct noise n;
    struct record now = job->frames.now;
    if (job->opt->noise) {
        now.w = now.h = 0;
        now.aperture = now.focus_per_m = now.distance_m = NAN;
        *now.lens = 0;
        if (!noise_read(&n, job->opt->noise, e) || !record_fits(&n.head, job->opt->noise, &now, e))
            return false;
        h->noise = (struct hdr_noise){n.read * n.read + job->frames.read_extra, n.gain};
    } else {
        h->noise = exposure_noise(h); // of samples less their dark
    }
    doc_num(cli->doc, "noise.gain", h->noise.gain);
    doc_num(cli->doc, "noise.read", sqrt(h->noise.read));
    return true;
}

static bool merge_linear(struct hdr_job *job, enum hdr_method method, struct cli *cli,
                         struct err *e)
{
    const struct frames *f = &job->frames;
    double time_s[BRACKET_MAX];
    int unlinked = 0;
    memcpy(time_s, f->time_s, (size_t)f->n * sizeof *time_s);
    struct hdr_frames h = {.n = f->n,
                           .w = f->w,
                           .h = f->h,
                           .nc = f->nc,
                           .px = (const float *const *)f->px,
                           .time_s = time_s,
                           .saturation = f->saturation};
    if (!isnan(job->opt->saturation))
        h.saturation = job->opt->saturation;
    if (isfinite(h.saturation))
        doc_num(cli->doc, "saturation", h.saturation);
    if (!get_noise(job, &h, cli, e))
        return false;
    if (!strcmp(job->opt->scales, "auto")) {
        exposure_drift(&h, job->log_scale, &unlinked);
        if (unlinked && f->n > 1)
            doc_int(cli->doc, "scale_unlinked", unlinked);
    }
    if (!check_scales(job, e))
        return false;
    for (int k = 0; k < f->n; k++)
        time_s[k] *= exp(job->log_scale[k]);
    return align_frames(&h, job->shift, e) && check_shift(job, cli, e) &&
           (hdr_merge(&h, method, &job->out, &job->counts, e) || err_in(e, "%s", f->path[0]));
}

static bool divide_flat(struct hdr_job *job, struct err *e)
{
    struct flat flat;
    struct image *im = &job->out;
    const int nc = im->nc / 2;
    if (!flat_read(&flat, job->opt->flat, e) ||
        !record_fits(&flat.head, job->opt->flat, &job->frames.now, e))
        return false;
    if (flat.nc != nc && flat.nc != 1)
        return err_set(e, ERR_DATA, "%s: has %d channels, the pictures have %d", job->opt->flat,
                       flat.nc, nc);
    for (int j = 0; j < im->h; j++)
        for (int i = 0; i < im->w; i++) {
            float *p = im->px + ((size_t)j * (size_t)im->w + (size_t)i) * (size_t)im->nc;
            for (int c = 0; c < nc; c++) {
                const float v = (float)flat_at(&flat, flat.nc == 1 ? 0 : c, i, j);
                p[c] /= v;
                p[nc + c] /= v * v;
            }
        }
    return true;
}

// Counts into L / E where the session knows how; colour from the mosaic's own sites.
static bool finish(struct hdr_job *job, const struct dark *dark, struct err *e)
{
    struct frames *f = &job->frames;
    struct image *im = &job->out;
    const char *cell = meta_text(&f->meta, "nacre.bayer");
    if (dark->frames)
        mosaic_fill_hot(im, dark->hot);
    if (f->nc == 1 && cell && strcmp(cell, "Y")) {
        struct image colour = {0};
        if (!mosaic_spread(im, cell, &colour, e))
            return false;
        image_finish(im);
        *im = colour;
    }
    if (job->opt->flat && !divide_flat(job, e))
        return false;
    const float scale = (float)f->brdf_scale;
    const size_t n = (size_t)im->w * (size_t)im->h, step = (size_t)im->nc, nc = step / 2;
    for (size_t k = 0; scale > 0 && k < n; k++)
        for (size_t c = 0; c < nc; c++) {
            im->px[k * step + c] *= scale;
            im->px[k * step + nc + c] *= scale * scale;
        }
    meta_set_text(&im->meta, "nacre.unit",
                  scale > 0  ? "1/sr"
                  : f->px[0] ? "samples/s"
                             : "relative");
    return true;
}

static enum hdr_method method_of(const char *name)
{
    return !strcmp(name, "poisson")   ? HDR_POISSON
           : !strcmp(name, "debevec") ? HDR_DEBEVEC
                                      : HDR_ROBERTSON;
}

static bool check_options(const struct hdr_options *o, const struct cli *cli, struct err *e)
{
    if (o->linear && strcmp(o->response, "auto"))
        return err_set(e, ERR_USAGE, "--linear and --response exclude each other");
    if (!isnan(o->saturation) && !(o->saturation > 0))
        return err_set(e, ERR_DATA, "--saturation: must be above 0");
    if (!(o->max_shift_px > 0))
        return err_set(e, ERR_DATA, "--max-shift: must be above 0 px");
    if (cli->n > 1 && is_session(cli->operand[0]))
        return err_set(e, ERR_USAGE, "%s is a session: give it alone", cli->operand[0]);
    return true;
}

bool hdr_job_run(struct hdr_job *job, const struct hdr_options *o, struct cli *cli, struct err *e)
{
    struct dark dark = {0};
    const struct session_choice choice = {o->light, o->filter, o->group};
    *job = (struct hdr_job){.opt = o};
    if (!check_options(o, cli, e))
        return false;
    const bool session = cli->n == 1 && is_session(cli->operand[0]);
    bool ok = session ? session_frames_read(&job->frames, &dark, cli->operand[0], &choice, e)
                      : frames_read(&job->frames, cli->n, cli->operand, e);
    ok = ok && (session || get_times(o, &job->frames, e));
    if (ok && o->dark) {
        dark_finish(&dark);
        ok = dark_read(&dark, o->dark, e);
    }
    if (ok && job->frames.code[0]) {
        ok = (!o->dark && !o->noise) || err_set(e, ERR_DATA,
                                                "%s: 8-bit pictures: --dark and --noise are for "
                                                "linear counts",
                                                job->frames.path[0]);
        ok = ok && merge_codes(job, method_of(o->method), cli, e);
    } else if (ok) {
        ok = frames_remove_black(&job->frames, dark.frames ? &dark : NULL,
                                 o->dark ? o->dark : cli->operand[0], e) &&
             merge_linear(job, method_of(o->method), cli, e);
    }
    ok = ok && finish(job, &dark, e);
    if (ok && dark.frames)
        doc_int(cli->doc, "dark_frames", dark.frames);
    dark_finish(&dark);
    if (!ok)
        hdr_job_finish(job);
    return ok;
}

void hdr_job_finish(struct hdr_job *job)
{
    image_finish(&job->out);
    frames_finish(&job->frames);
}
