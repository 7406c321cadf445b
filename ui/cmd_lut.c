// cmd_lut.c - nacre lut: the diffraction table from one photograph of the pattern.
#define _GNU_SOURCE
#include "core/imgfile.h"
#include "core/log.h"
#include "process/lut.h"
#include "ui/commands.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct args {
    double lambda_m;
    const char *channel;
    double h_per_px;
    const char *center;
    double scale;
    const char *illuminant;
    double f0;
    const char *exponent;
    int size;
    double range;
    int power;
    bool rgb;
    const char *method;
    double tolerance;
    int wavelengths;
    const char *out;
};

#define AT(field) offsetof(struct args, field)
static const struct opt opts[] = {
    {"lambda", OPT_NUM, AT(lambda_m), "L", NULL, "wavelength of the photograph", UNIT_M, true},
    {"channel", OPT_CHOICE, AT(channel), "r|g|b", NULL,
     "channel of a colour photograph (default: by the wavelength)"},
    {"h-per-pixel", OPT_NUM, AT(h_per_px), "X", NULL,
     "change of the half vector from pixel to pixel"},
    {"center", OPT_TEXT, AT(center), "X,Y", "auto",
     "pixel where h = 0, or auto: the middle of the brightest lobe"},
    {"scale", OPT_NUM, AT(scale), "X", "1", "multiply the pattern (1/4 undoes G = 4)"},
    {"illuminant", OPT_TEXT, AT(illuminant), "NAME|FILE", "E",
     "E A D50 D65 F1 F2 F11 inverse-A, or a CSV of nm,power"},
    {"f0", OPT_NUM, AT(f0), "F0", "1", "Fresnel factor F at normal incidence"},
    {"exponent", OPT_CHOICE, AT(exponent), "2|4", "2",
     "power of the wavelength: 2 reflectance pattern, 4 shallow phase grating"},
    {"size", OPT_INT, AT(size), "N", "512", "nodes a side"},
    {"range", OPT_NUM, AT(range), "R", NULL, "the table holds |u|, |v| <= R", UNIT_NONE, true},
    {"power", OPT_INT, AT(power), "P", "1", "odd power that crowds nodes to the middle"},
    {"rgb", OPT_FLAG, AT(rgb), NULL, NULL, "linear sRGB in place of XYZ"},
    {"method", OPT_CHOICE, AT(method), "auto|exact|sampled|floor", "auto",
     "how the integral is taken; auto: the fastest that keeps the tolerance"},
    {"tolerance", OPT_NUM, AT(tolerance), "E", "1e-4", "wanted relative L2 error"},
    {"wavelengths", OPT_INT, AT(wavelengths), "N", NULL,
     "of the sampled method (default: by the tolerance)"},
    {"o", OPT_FILE, AT(out), "LUT", NULL, "the table: .exr .pfm .hdr", UNIT_NONE, true},
    {0},
};
#undef AT

// The channel asked for; in a colour photograph else the one that sees the wavelength best.
static bool pick_channel(const struct image *im, const struct args *a, int *channel, struct err *e)
{
    *channel = 0;
    if (im->nc == 1 && !a->channel)
        return true;
    const char *name = a->channel              ? a->channel
                       : a->lambda_m >= 590e-9 ? "r"
                       : a->lambda_m >= 490e-9 ? "g"
                                               : "b";
    *channel = image_channel_index(im, name);
    if (*channel < 0 && !a->channel) // a mono camera's, perhaps with variance and mask beside it
        *channel = image_channel_index(im, "Y");
    if (*channel < 0)
        return err_set(e, ERR_DATA, "no channel %s: the picture has %d channel%s", name, im->nc,
                       im->nc == 1 ? "" : "s");
    if (!a->channel)
        log_note("channel %s, by the wavelength", name);
    return true;
}

static bool place(struct lut_pattern *p, const struct args *a, struct err *e)
{
    if (isnan(a->h_per_px))
        return err_set(e, ERR_USAGE, "--h-per-pixel is missing");
    p->h_per_px = a->h_per_px;
    if (!strcmp(a->center, "auto"))
        return lut_pattern_center(p, e);
    double at[2];
    const int n = cli_numbers(a->center, UNIT_NONE, at, 2, e);
    if (n != 2)
        return n < 0 ? err_in(e, "--center")
                     : err_set(e, ERR_USAGE, "--center needs X,Y or auto, not '%s'", a->center);
    p->cx = at[0];
    p->cy = at[1];
    return true;
}

static bool read_pattern(struct lut_pattern *p, const char *path, const struct args *a,
                         struct err *e)
{
    struct image im = {0};
    int channel = 0;
    if (!image_read(&im, path, e))
        return false;
    const bool ok =
        (pick_channel(&im, a, &channel, e) && lut_pattern_init(p, &im, channel, a->scale, e)) ||
        err_in(e, "%s", path);
    image_finish(&im);
    if (ok && p->unseen)
        log_warn("%s: %ld pixels are not finite and count as not measured", path, p->unseen);
    return ok;
}

static void record(struct table *t, const struct args *a, const struct lut_request *r,
                   const struct cli *cli)
{
    struct meta *m = &t->meta;
    meta_set_text(m, "nacre.version", NACRE_VERSION);
    meta_set_text(m, "nacre.command", cli->line);
    meta_set_text(m, "nacre.pattern", cli->operand[0]);
    meta_set_text(m, "nacre.illuminant", a->illuminant);
    meta_set_text(m, "nacre.observer", "CIE 1931 2 deg");
    meta_set_num(m, "nacre.lambda_m", r->lambda_m);
    meta_set_num(m, "nacre.f0", r->f0);
    meta_set_num(m, "nacre.exponent", r->exponent);
    meta_set_num(m, "nacre.h_per_px", r->pattern->h_per_px);
    meta_set_nums(m, "nacre.center_px", (double[]){r->pattern->cx, r->pattern->cy}, 2);
}

static enum lut_method method_of(const char *name)
{
    enum lut_method m = LUT_AUTO;
    while (strcmp(lut_method_name(m), name))
        m++;
    return m;
}

static bool build(const struct args *a, struct cli *cli, const struct lut_pattern *p,
                  const struct spectrum *light, struct err *e)
{
    const struct lut_request r = {
        .pattern = p,
        .lambda_m = a->lambda_m,
        .light = light,
        .f0 = a->f0,
        .exponent = strtod(a->exponent, NULL),
        .n = a->size,
        .range = a->range,
        .power = a->power,
        .is_rgb = a->rgb,
        .method = method_of(a->method),
        .tolerance = a->tolerance,
        .wavelengths = a->wavelengths,
    };
    struct table t = {0};
    struct lut_report report;
    if (!lut_build(&r, &t, &report, e))
        return false;
    record(&t, a, &r, cli);
    const bool ok = table_write(&t, a->out, e);
    table_finish(&t);
    if (!ok)
        return false;
    doc_text(cli->doc, "output", a->out);
    doc_text(cli->doc, "method", lut_method_name(report.method));
    doc_text(cli->doc, "why", report.why);
    doc_nums(cli->doc, "center_px", (double[]){p->cx, p->cy}, 2);
    if (report.wavelengths)
        doc_int(cli->doc, "wavelengths", report.wavelengths);
    doc_num(cli->doc, "uncovered", report.uncovered);
    doc_bool(cli->doc, "symmetric", report.skipped.symmetric);
    doc_num(cli->doc, "skipped.band", report.skipped_band);
    doc_num(cli->doc, "skipped.rays", report.skipped.rays);
    doc_num(cli->doc, "skipped.radii", report.skipped.radii);
    doc_num(cli->doc, "skipped.nodes", report.skipped.nodes);
    doc_num(cli->doc, "seconds", report.seconds);
    return true;
}

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct args *a = args;
    struct lut_pattern p = {0};
    struct spectrum light = {0};
    const bool ok = illuminant_get(&light, a->illuminant, e) &&
                    read_pattern(&p, cli->operand[0], a, e) && place(&p, a, e) &&
                    build(a, cli, &p, &light, e);
    spectrum_finish(&light);
    lut_pattern_finish(&p);
    return ok;
}

const struct command cmd_lut = {
    .name = "lut",
    .summary = "the diffraction table from a photograph of the pattern",
    .operands = "PATTERN",
    .min_operands = 1,
    .max_operands = 1,
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes =
        "PATTERN is the linear photograph of the diffraction pattern under a narrow band (.exr,\n"
        ".pfm, ...): radiance per unit of incident irradiance.\n"
        "  nacre lut pattern.exr --lambda 520nm --h-per-pixel 0.00112 --range 0.35 -o lut.exr",
    .run = run,
};
