// cmd_height.c - nacre height: a measured height field cut, filled, turned, levelled; its roughness
// and periods.
#define _GNU_SOURCE
#include "core/hfield_file.h"
#include "core/imgfile.h"
#include "core/log.h"
#include "process/fill.h"
#include "process/level.h"
#include "process/periods.h"
#include "process/regrid.h"
#include "process/roughness.h"
#include "ui/commands.h"
#include "ui/heights.h"
#include <math.h>
#include <string.h>

struct args {
    const char *pixel, *crop, *rotate, *resample, *level, *out;
    double z_scale_m;
    bool fill;
};

static const struct opt opts[] = {
    {"crop", OPT_LIST, offsetof(struct args, crop), "[X,Y,]W[,H]", NULL,
     "keep W x H (W x W) of it (5um), its corner at X,Y from the first node; without them the "
     "middle",
     UNIT_M},
    {"fill", OPT_FLAG, offsetof(struct args, fill),
     .help = "give nodes that were not measured the heights of a membrane over their rim"},
    {"rotate", OPT_TEXT, offsetof(struct args, rotate), "DEG|auto", NULL,
     "turn from x towards y; auto: the strongest period to x. Quarter turns are exact, others keep "
     "the largest rectangle inside"},
    {"resample", OPT_LIST, offsetof(struct args, resample), "D[,D]", NULL,
     "another node spacing (0.1um), smoothed first where it is coarser", UNIT_M},
    {"level", OPT_CHOICE, offsetof(struct args, level), "none|mean|plane|quadric|rows", "none",
     "subtract the mean, the least-squares plane or quadric, or from each row its median"},
    {"pixel", OPT_LIST, offsetof(struct args, pixel), "D[,D]", NULL,
     "node spacing where the file does not state it (0.25um)", UNIT_M},
    {"z-scale", OPT_NUM, offsetof(struct args, z_scale_m), "H", NULL,
     "height of white in a .tif or .png that is read or written", UNIT_M},
    {"o", OPT_FILE, offsetof(struct args, out), "HEIGHT",
     .help = "write the result: .gsf .x3p .exr .pfm .tif .png; without it only the figures"},
    {0},
};

// Takes a step's result in place of the field.
static bool replace(struct hfield *hf, struct hfield *next, bool ok)
{
    if (ok) {
        hfield_finish(hf);
        *hf = *next;
    }
    return ok;
}

static bool crop(struct hfield *hf, const char *text, struct err *e)
{
    double v[4];
    struct hfield part;
    const int n = cli_numbers(text, UNIT_M, v, 4, e);
    if (n < 0)
        return err_in(e, "--crop");
    if (n == 3)
        return err_set(e, ERR_USAGE, "--crop: '%.60s' is neither W, W,H nor X,Y,W,H", text);
    const double w = n == 4 ? v[2] : v[0], h = n == 4 ? v[3] : n == 2 ? v[1] : v[0];
    const double x = n == 4 ? v[0] : 0.5 * (hf->nx * hf->dx_m - w),
                 y = n == 4 ? v[1] : 0.5 * (hf->ny * hf->dy_m - h);
    return replace(hf, &part, hfield_crop(&part, hf, x, y, w, h, e) || err_in(e, "--crop"));
}

static bool rotate(struct hfield *hf, const char *text, struct err *e)
{
    double angle;
    struct hfield turned;
    if (!strcmp(text, "auto")) {
        struct period p[2];
        const int n = hfield_periods(hf, p, e);
        if (n < 0)
            return false;
        if (!n)
            return err_set(e, ERR_DATA, "--rotate auto: no period stands out of the noise");
        angle = -p[n == 2 && p[1].amplitude_m > p[0].amplitude_m].direction_rad;
    } else if (!cli_degrees(text, &angle, e)) {
        return err_in(e, "--rotate");
    }
    return replace(hf, &turned, hfield_turn(&turned, hf, angle, e) || err_in(e, "--rotate"));
}

static bool resample(struct hfield *hf, const char *text, struct err *e)
{
    double d[2];
    struct hfield next;
    const int n = cli_numbers(text, UNIT_M, d, 2, e);
    if (n < 0)
        return err_in(e, "--resample");
    if (n == 1)
        d[1] = d[0];
    if (!(d[0] > 0 && d[1] > 0))
        return err_set(e, ERR_DATA, "--resample %s: node spacings must be positive", text);
    return replace(hf, &next, hfield_resample(&next, hf, d[0], d[1], e) || err_in(e, "--resample"));
}

static bool level(struct hfield *hf, const char *how, struct err *e)
{
    const enum level l = !strcmp(how, "mean")    ? LEVEL_MEAN
                         : !strcmp(how, "plane") ? LEVEL_PLANE
                         : !strcmp(how, "rows")  ? LEVEL_ROWS
                                                 : LEVEL_QUADRIC;
    return hfield_level(hf, l, e) || err_in(e, "--level %s", how);
}

// In an order that does not depend on the command line's.
static bool work(struct hfield *hf, const struct args *a, long *filled, struct err *e)
{
    const bool rows = !strcmp(a->level, "rows"); // the scan's rows, so before they turn
    return (!a->crop || crop(hf, a->crop, e)) && (!a->fill || hfield_fill(hf, filled, e)) &&
           (!rows || level(hf, a->level, e)) && (!a->rotate || rotate(hf, a->rotate, e)) &&
           (!a->resample || resample(hf, a->resample, e)) &&
           (rows || !strcmp(a->level, "none") || level(hf, a->level, e));
}

static bool report(const struct hfield *hf, struct doc *d, struct err *e)
{
    struct roughness r;
    struct form plane;
    struct period period[2];
    struct err flat;
    const int n = hfield_periods(hf, period, e);
    if (n < 0 || !hfield_roughness(&r, hf, e))
        return false;
    doc_int(d, "nx", hf->nx);
    doc_int(d, "ny", hf->ny);
    doc_nums(d, "pixel_m", (double[]){hf->dx_m, hf->dy_m}, 2);
    doc_nums(d, "size_m", (double[]){hf->nx * hf->dx_m, hf->ny * hf->dy_m}, 2);
    doc_int(d, "missing", hfield_missing(hf));
    doc_num(d, "min_m", r.mean_m - r.sv_m);
    doc_num(d, "max_m", r.mean_m + r.sp_m);
    doc_num(d, "mean_m", r.mean_m);
    if (form_fit(&plane, hf, 1, &flat)) // its terms are heights over half the field
        doc_nums(d, "tilt_deg",
                 (double[]){
                     atan(2 * plane.term[1] / ((hf->nx - 1) * hf->dx_m)) * 180 / M_PI,
                     atan(2 * plane.term[2] / ((hf->ny - 1) * hf->dy_m)) * 180 / M_PI,
                 },
                 2);
    doc_num(d, "sq_m", r.sq_m);
    doc_num(d, "sa_m", r.sa_m);
    doc_num(d, "sp_m", r.sp_m);
    doc_num(d, "sv_m", r.sv_m);
    doc_num(d, "sz_m", r.sz_m);
    doc_num(d, "ssk", r.ssk);
    doc_num(d, "sku", r.sku);
    doc_list(d, "periods");
    for (int k = 0; k < n; k++) {
        struct doc *item = doc_item(d, "periods");
        doc_num(item, "period_m", period[k].period_m);
        doc_num(item, "direction_deg", period[k].direction_rad * 180 / M_PI);
        doc_num(item, "amplitude_m", period[k].amplitude_m);
    }
    return true;
}

static bool is_scaled(const char *path) // 16-bit samples, which need --z-scale
{
    const char *ext = path_ext(path);
    return !strcmp(ext, ".png") || !strcmp(ext, ".tif") || !strcmp(ext, ".tiff");
}

static bool run(const void *args_, struct cli *cli, struct err *e)
{
    const struct args *a = args_;
    const char *path = cli->operand[0];
    struct hfield hf = {0};
    long filled = 0;
    if (!isnan(a->z_scale_m) && !(a->z_scale_m > 0))
        return err_set(e, ERR_DATA, "--z-scale %g m: must be positive", a->z_scale_m);
    // a metric file is in metres already: there the scale is that of the result
    const bool for_output = a->out && is_scaled(a->out) && !is_scaled(path);
    const struct heights_opts from = {
        .pixel = a->pixel, .z_scale_m = for_output ? NAN : a->z_scale_m, .holes = true};
    if (!heights_read(&hf, path, &from, e))
        return false;
    bool ok = work(&hf, a, &filled, e) && report(&hf, cli->doc, e);
    if (!ok)
        err_in(e, "%s", path);
    if (filled)
        log_note("%s: filled %ld nodes", path, filled);
    if (ok && a->out) {
        meta_set_text(&hf.meta, "nacre.version", NACRE_VERSION);
        meta_set_text(&hf.meta, "nacre.command", cli->line);
        ok = hfield_write(
            &hf, a->out,
            &(struct hfield_hints){.z_scale_m = isnan(a->z_scale_m) ? 0 : a->z_scale_m}, e);
        doc_text(cli->doc, "output", a->out);
    }
    hfield_finish(&hf);
    return ok;
}

const struct command cmd_height = {
    .name = "height",
    .summary = "a measured height field: level, crop, resample, fill, rotate; roughness, periods",
    .operands = "HEIGHT",
    .min_operands = 1,
    .max_operands = 1,
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes =
        "Reads .gsf .x3p Nanoscope (.di .spm .000) .exr .pfm .tif .png. The steps are done in "
        "this\n"
        "order: crop, fill, level rows, rotate, resample, level mean|plane|quadric. Printed of "
        "the\n"
        "result: size, tilt, up to two periods, and ISO 25178-2's height parameters (Sq, Sa, Sp,\n"
        "Sv, Sz about the mean; level first, as the standard does).\n"
        "  nacre height scan.di --level plane --json\n"
        "  nacre height scan.x3p --crop 40um --fill --resample 0.25um --level quadric -o part.gsf\n"
        "  nacre height grating.000 --level rows --rotate auto -o upright.gsf",
    .run = run,
};
