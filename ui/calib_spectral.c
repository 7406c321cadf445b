// calib_spectral.c - nacre calib spectral: effective wavelength and band, checked by a grating.
#define _GNU_SOURCE
#include "calib/passband.h"
#include "core/imgfile.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/rig.h"
#include "process/lut_pattern.h"
#include "ui/calib.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 16 };

static bool is_rig(const char *path)
{
    const char *ext = path_ext(path);
    return !strcmp(ext, ".yaml") || !strcmp(ext, ".yml");
}

static bool from_rig(const struct calib_args *a, const char *path, struct passband *s,
                     struct err *e)
{
    struct rig rig = {0};
    struct spectrum curve = {0};
    if (!rig_open(&rig, path, e))
        return false;
    const int light = a->light ? rig_light_index(&rig, a->light) : rig.n_lights ? 0 : -1;
    const int filter = a->filter ? rig_filter_index(&rig, a->filter) : -1;
    bool ok = true;
    if (a->light && light < 0)
        ok = err_set(e, ERR_DATA, "%s: no light '%s'", path, a->light);
    else if (a->filter && filter < 0)
        ok = err_set(e, ERR_DATA, "%s: no filter '%s'", path, a->filter);
    ok = ok && rig_spectrum(&rig, light, filter, &curve, e) &&
         (passband_product(s, &curve, 1, a->accuracy_m, e) || err_in(e, "%s", path));
    spectrum_finish(&curve);
    rig_finish(&rig);
    return ok;
}

static bool from_curves(const struct calib_args *a, const struct cli *cli, struct passband *s,
                        struct err *e)
{
    struct spectrum curve[MOST] = {0};
    int n = 0;
    bool ok = cli->n <= MOST || err_set(e, ERR_USAGE, "calib spectral: at most %d curves", MOST);
    while (ok && n < cli->n)
        if ((ok = spectrum_read_csv(&curve[n], cli->operand[n], e)))
            n++;
    ok = ok && (passband_product(s, curve, n, a->accuracy_m, e) ||
                err_in(e, "%s and %d more", cli->operand[0], n - 1));
    for (int k = 0; k < n; k++)
        spectrum_finish(&curve[k]);
    return ok;
}

static bool pick_channel(const struct calib_args *a, const struct image *im, double lambda_m,
                         int *c, struct err *e)
{
    const char *by_wavelength = lambda_m > 590e-9 ? "R" : lambda_m > 490e-9 ? "G" : "B";
    *c = im->nc == 1 ? 0 : image_channel_index(im, a->channel ? a->channel : by_wavelength);
    if (*c < 0 && !a->channel)
        *c = image_channel_index(im, "Y");
    return *c >= 0 || err_set(e, ERR_DATA, "has no channel %s", a->channel ? a->channel : "Y");
}

// u and v of every pixel, [h][w]: from a geometry record, or even steps from a centre.
static bool half_vectors(const struct calib_args *a, const struct image *im, int c, float *u,
                         float *v, struct err *e)
{
    if (a->geometry) {
        struct image g = {0};
        if (!image_read(&g, a->geometry, e))
            return false;
        const int iu = image_channel_index(&g, "u"), iv = image_channel_index(&g, "v");
        bool ok = true;
        if (iu < 0 || iv < 0)
            ok = err_set(e, ERR_DATA, "%s: not a geometry record", a->geometry);
        else if (g.w != im->w || g.h != im->h) // a bare picture too
            ok = err_set(e, ERR_DATA, "%s: made at %d x %d pixels, but this is %d x %d",
                         a->geometry, g.w, g.h, im->w, im->h);
        else
            ok = record_image_fits(&g, a->geometry, "geometry", im, e);
        for (size_t k = 0; ok && k < (size_t)im->w * (size_t)im->h; k++) {
            u[k] = g.px[k * (size_t)g.nc + (size_t)iu];
            v[k] = g.px[k * (size_t)g.nc + (size_t)iv];
        }
        image_finish(&g);
        return ok;
    }
    struct lut_pattern p = {0};
    double at[2];
    if (!(a->h_per_px > 0))
        return err_set(e, ERR_USAGE,
                       "--grating needs --geometry FILE, or --h-per-pixel X and --center");
    if (!strcmp(a->center, "auto")) {
        const bool ok = lut_pattern_init(&p, im, c, 1, e) && lut_pattern_center(&p, e);
        at[0] = p.cx;
        at[1] = p.cy;
        lut_pattern_finish(&p);
        if (!ok)
            return false;
    } else {
        const int n = cli_numbers(a->center, UNIT_NONE, at, 2, e);
        if (n != 2)
            return n < 0 ? err_in(e, "--center")
                         : err_set(e, ERR_USAGE, "--center needs X,Y or auto");
    }
    for (int j = 0; j < im->h; j++)
        for (int i = 0; i < im->w; i++) {
            u[(size_t)j * (size_t)im->w + (size_t)i] = (float)((i - at[0]) * a->h_per_px);
            v[(size_t)j * (size_t)im->w + (size_t)i] = (float)((j - at[1]) * a->h_per_px);
        }
    return true;
}

static bool check_grating(const struct calib_args *a, struct passband *s, struct cli *cli,
                          struct err *e)
{
    struct image im = {0}, one = {0};
    struct ring r;
    int c = 0;
    if (!(a->lines_per_m > 0))
        return err_set(e, ERR_USAGE, "--grating needs its --lines, e.g. --lines 600/mm");
    if (!image_read(&im, a->grating, e))
        return false;
    const size_t n = (size_t)im.w * (size_t)im.h;
    float *u = sample_alloc(n, sizeof *u, "picture", e);
    float *v = u ? sample_alloc(n, sizeof *v, "picture", e) : NULL;
    const bool ok = v && pick_channel(a, &im, s->lambda_m, &c, e) &&
                    image_channel(&im, c, &one, e) && half_vectors(a, &im, c, u, v, e) &&
                    ring_find(&r, one.px, u, v, im.w, im.h, a->lines_per_m, s->lambda_m, e);
    image_finish(&one);
    image_finish(&im);
    free(u);
    free(v);
    if (!ok)
        return e->code == ERR_USAGE ? false : err_in(e, "%s", a->grating);
    s->lines_per_m = a->lines_per_m;
    s->grating_m = r.lambda_m;
    s->grating_sigma_m = r.sigma_m;
    doc_num(cli->doc, "grating.lambda_nm", r.lambda_m * 1e9);
    doc_num(cli->doc, "grating.sigma_nm", r.sigma_m * 1e9);
    doc_int(cli->doc, "grating.sectors", r.sectors);
    doc_bool(cli->doc, "grating.agrees", passband_agrees(s));
    if (!passband_agrees(s))
        log_warn("the grating shows %.1f +- %.1f nm, but the curves say %.1f +- %.1f nm: one of "
                 "them is wrong",
                 r.lambda_m * 1e9, r.sigma_m * 1e9, s->lambda_m * 1e9, s->lambda_sigma_m * 1e9);
    return true;
}

bool calib_spectral(const struct calib_args *a, struct cli *cli, struct err *e)
{
    struct passband s = {0};
    bool ok;
    if (!(a->accuracy_m >= 0 && a->accuracy_m < 1e-7))
        return err_set(e, ERR_DATA, "--accuracy must be 0 to 100 nm");
    if (cli->n == 0 && isnan(a->lambda_m))
        return err_set(e, ERR_USAGE,
                       "calib spectral: give curves (CSV of nm,value), a rig, or --lambda L");
    if (!isnan(a->lambda_m) && cli->n)
        return err_set(e, ERR_USAGE, "give curves or --lambda, not both");
    if (!isnan(a->lambda_m))
        ok =
            (a->lambda_m > 1e-7 && a->lambda_m < 5e-6 && a->width_m > 0 && a->width_m < a->lambda_m)
                ? passband_gaussian(&s, a->lambda_m, a->width_m, a->accuracy_m, e)
                : err_set(e, ERR_DATA, "--lambda must be 100 nm to 5 um, --width above 0");
    else
        ok = is_rig(cli->operand[0]) ? from_rig(a, cli->operand[0], &s, e)
                                     : from_curves(a, cli, &s, e);
    if (ok) {
        doc_num(cli->doc, "lambda_nm", s.lambda_m * 1e9);
        doc_num(cli->doc, "lambda_sigma_nm", s.lambda_sigma_m * 1e9);
        doc_num(cli->doc, "width_nm", s.width_m * 1e9);
        doc_num(cli->doc, "width_sigma_nm", s.width_sigma_m * 1e9);
        doc_num(cli->doc, "rms_nm", s.rms_m * 1e9);
        ok = !a->grating || check_grating(a, &s, cli, e);
    }
    ok = ok && passband_write(&s, cli->line, a->out, e);
    passband_finish(&s);
    return ok;
}
