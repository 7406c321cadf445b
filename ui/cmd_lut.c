// cmd_lut.c - nacre lut: the diffraction table from photographs of the pattern.
#define _GNU_SOURCE
#include "core/log.h"
#include "core/mem.h"
#include "ui/commands.h"
#include "ui/lut_job.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define AT(field) offsetof(struct lut_args, field)
static const struct opt opts[] = {
    {"lambda", OPT_LIST, AT(lambda), "L,..", NULL,
     "wavelength of every photograph (default: its band's effective one)"},
    {"band", OPT_LIST, AT(band), "FILE,..", NULL,
     "what it was taken through, filter x light x channel: a CSV of nm,value or a record of 'nacre "
     "calib spectral'"},
    {"deband", OPT_FLAG, AT(deband), NULL, NULL, "undo the blur of the band"},
    {"noise-limit", OPT_NUM, AT(noise_limit), "X", "2",
     "... never growing the pixels' noise by more than this"},
    {"channel", OPT_CHOICE, AT(channel), "r|g|b", NULL,
     "channel of a colour photograph (default: by the wavelength)"},
    {"h-per-pixel", OPT_NUM, AT(h_per_px), "X", NULL,
     "change of the half vector from pixel to pixel"},
    {"center", OPT_TEXT, AT(center), "X,Y", "auto",
     "pixel where h = 0, or auto: the middle of the brightest lobe"},
    {"geometry", OPT_FILE, AT(geometry), "FILE", NULL,
     "or the record of every pixel: channels u, v, w, weight"},
    {"scale", OPT_NUM, AT(scale), "X", "1", "multiply the pattern (1/4 undoes G = 4)"},
    {"illuminant", OPT_TEXT, AT(illuminant), "NAME|FILE", "E",
     "E A D50 D65 F1 F2 F11 inverse-A, or a CSV of nm,power"},
    {"f0", OPT_NUM, AT(f0), "F0", "1", "Fresnel factor F at normal incidence"},
    {"exponent", OPT_CHOICE, AT(exponent), "2|4|auto", "2",
     "power of the wavelength: 2 reflectance pattern, 4 shallow phase grating"},
    {"second", OPT_FILE, AT(second), "PATTERN", NULL,
     "the same sample through another filter, for --exponent auto"},
    {"second-lambda", OPT_NUM, AT(second_lambda_m), "L", NULL, "its wavelength", UNIT_M},
    {"second-center", OPT_TEXT, AT(second_center), "X,Y", "auto", "its centre"},
    {"size", OPT_INT, AT(size), "N", "512", "nodes a side"},
    {"range", OPT_NUM, AT(range), "R", NULL, "the table holds |u|, |v| <= R", UNIT_NONE, true},
    {"power", OPT_INT, AT(power), "P", "1", "odd power that crowds nodes to the middle"},
    {"rgb", OPT_FLAG, AT(rgb), NULL, NULL, "linear sRGB in place of XYZ"},
    {"method", OPT_CHOICE, AT(method), "auto|exact|sampled|floor", "auto",
     "how the integral is taken; auto: the fastest that keeps the tolerance"},
    {"tolerance", OPT_NUM, AT(tolerance), "E", "1e-4", "wanted relative L2 error"},
    {"wavelengths", OPT_INT, AT(wavelengths), "N", NULL,
     "of the sampled method (default: by the tolerance)"},
    {"psf", OPT_FILE, AT(psf), "IMAGE", NULL,
     "the table under a light of this picture (a photograph of its mirror image)"},
    {"psf-crop", OPT_LIST, AT(psf_crop), "X,Y,W,H", NULL,
     "the part that shows the light, its middle at h = 0"},
    {"psf-h-per-pixel", OPT_NUM, AT(psf_h_per_px), "X", NULL, "(default: the pattern's)"},
    {"o", OPT_FILE, AT(out), "LUT", NULL, "the table: .exr .pfm .hdr", UNIT_NONE, true},
    {0},
};
#undef AT

// Several photographs of one sample through several filters, their options taken apart.
struct photographs {
    int n;
    char *bands; // the list, cut into its files
    struct lut_args args[LUT_FILTERS];
    struct lut_filters filters;
};

static bool take_apart(struct photographs *p, const struct lut_args *a, int n, struct err *e)
{
    double lambda_m[LUT_FILTERS];
    const int given = a->lambda ? cli_numbers(a->lambda, UNIT_M, lambda_m, LUT_FILTERS, e) : 0;
    if (given < 0)
        return err_in(e, "--lambda");
    if (given && given != n)
        return err_set(e, ERR_USAGE, "--lambda: %d wavelengths for %d photographs", given, n);
    if (n > 1 && !strcmp(a->exponent, "auto"))
        return err_set(e, ERR_USAGE,
                       "several photographs measure how the orders change with the wavelength: "
                       "leave out --exponent auto");
    p->n = n;
    p->bands = a->band ? xstrdup(a->band) : NULL;
    char *rest = p->bands;
    for (int k = 0; k < n; k++) {
        p->args[k] = *a;
        p->args[k].lambda_m = given ? lambda_m[k] : NAN;
        p->args[k].band = n == 1 ? a->band : strsep(&rest, ",");
        if (a->band && !p->args[k].band)
            return err_set(e, ERR_USAGE, "--band: %d files for %d photographs", k, n);
    }
    return n == 1 || !rest ||
           err_set(e, ERR_USAGE, "--band: more files than the %d photographs", n);
}

static void record(struct table *t, const struct lut_job *job, const struct photographs *p,
                   const struct lut_report *report, const struct cli *cli)
{
    const struct lut_args *a = job->args;
    struct meta *m = &t->meta;
    meta_set_text(m, "nacre.version", NACRE_VERSION);
    meta_set_text(m, "nacre.command", cli->line);
    meta_set_text(m, "nacre.pattern", cli->operand[0]);
    if (p->n > 1)
        meta_set_nums(m, "nacre.lambdas_m", p->filters.lambda_m, p->n);
    meta_set_text(m, "nacre.illuminant", a->illuminant);
    meta_set_text(m, "nacre.observer", "CIE 1931 2 deg");
    meta_set_num(m, "nacre.lambda_m", job->lambda_m);
    meta_set_num(m, "nacre.f0", a->f0);
    meta_set_num(m, "nacre.exponent", job->exponent);
    meta_set_text(m, "nacre.method", lut_method_name(report->method));
    meta_set_num(m, "nacre.h_per_px", job->pattern.h_per_px);
    meta_set_nums(m, "nacre.center_px", (double[]){job->pattern.cx, job->pattern.cy}, 2);
    if (a->geometry)
        meta_set_text(m, "nacre.geometry", a->geometry);
    if (a->psf)
        meta_set_text(m, "nacre.psf", a->psf);
}

static void tell(struct doc *d, const struct lut_job *job, const struct lut_report *report)
{
    const struct lut_args *a = job->args;
    doc_text(d, "output", a->out);
    doc_text(d, "method", lut_method_name(report->method));
    doc_text(d, "why", report->why);
    doc_num(d, "lambda_nm", job->lambda_m * 1e9);
    if (!a->geometry)
        doc_nums(d, "center_px", (double[]){job->pattern.cx, job->pattern.cy}, 2);
    doc_num(d, "exponent", job->exponent);
    if (!isnan(job->exponent_sigma))
        doc_num(d, "exponent_sigma", job->exponent_sigma);
    if (a->deband)
        doc_num(d, "noise_gain", report->noise_gain);
    if (report->wavelengths)
        doc_int(d, "wavelengths", report->wavelengths);
    doc_num(d, "uncovered", report->uncovered);
    doc_bool(d, "symmetric", report->skipped.symmetric);
    doc_num(d, "skipped.band", report->skipped_band);
    doc_num(d, "skipped.rays", report->skipped.rays);
    doc_num(d, "skipped.radii", report->skipped.radii);
    doc_num(d, "skipped.nodes", report->skipped.nodes);
    doc_num(d, "seconds", report->seconds);
}

// The sum of the photographs' tables; `tell` gets what was done with the last.
static bool build_all(struct photographs *p, char **path, struct table *t, struct lut_job *job,
                      struct lut_report *report, struct err *e)
{
    bool ok = true;
    for (int k = 0; ok && k < p->n; k++) { // the wavelengths first: they share out the light
        ok = lut_job_wavelength(&p->args[k], &p->filters.lambda_m[k], e);
        p->filters.n = k + 1;
    }
    for (int k = 0; ok && k < p->n; k++) {
        struct table part = {0};
        lut_job_finish(job);
        if (!lut_job_open(job, path[k], &p->args[k], e))
            return false;
        job->filters = p->n > 1 ? &p->filters : NULL;
        job->filter = k;
        ok = lut_job_build(job, &part, report, e) || (p->n > 1 && err_in(e, "%s", path[k]));
        if (ok && k) {
            lut_filters_add(t, &part);
            table_finish(&part);
        } else if (ok) {
            *t = part;
        }
    }
    return ok;
}

static double uncovered(const struct table *t)
{
    const int nodes = t->n * t->n;
    int n = 0;
    for (int k = 0; t->cover && k < nodes; k++)
        n += t->cover[k] < 1;
    return (double)n / nodes;
}

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct lut_args *a = args;
    struct photographs p = {0};
    struct lut_job job = {0};
    struct table t = {0};
    struct lut_report report;
    bool ok = take_apart(&p, a, cli->n, e) && build_all(&p, cli->operand, &t, &job, &report, e);
    if (ok) {
        report.uncovered = uncovered(&t);
        record(&t, &job, &p, &report, cli);
        ok = table_write(&t, a->out, e);
    }
    if (ok) {
        tell(cli->doc, &job, &report);
        if (report.uncovered > 0)
            log_note("%.1f %% of the nodes look beyond what the photograph saw: marked in 'cover'",
                     100 * report.uncovered);
    }
    table_finish(&t);
    lut_job_finish(&job);
    free(p.bands);
    return ok;
}

const struct command cmd_lut = {
    .name = "lut",
    .summary = "the diffraction table from a photograph of the pattern",
    .operands = "PATTERN...",
    .min_operands = 1,
    .max_operands = LUT_FILTERS,
    .opts = opts,
    .args_size = sizeof(struct lut_args),
    .notes =
        "PATTERN is the linear photograph of the diffraction pattern under a narrow band (.exr,\n"
        ".pfm, ...): radiance per unit of incident irradiance (docs/lut.md).\n"
        "  nacre lut pattern.exr --lambda 520nm --h-per-pixel 0.00112 --range 0.35 -o lut.exr\n"
        "  nacre lut red.exr --band red.csv --deband --geometry rig.exr --range 0.3 -o lut.exr\n"
        "Several photographs, from short to long wavelengths, measure how the orders change with "
        "it:\n"
        "  nacre lut blue.exr green.exr red.exr --lambda 450nm,530nm,650nm --geometry rig.exr ...\n"
        "  nacre lut red.exr --lambda 650nm --second green.exr --second-lambda 530nm \\\n"
        "            --exponent auto --geometry rig.exr --range 0.3 -o lut.exr",
    .run = run,
};
