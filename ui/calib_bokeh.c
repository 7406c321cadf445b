// calib_bokeh.c - nacre calib bokeh: the scale of bokeh photographs from a known blazed grating.
#define _GNU_SOURCE
#include "calib/bokeh_record.h"
#include "calib/grating.h"
#include "core/imgfile.h"
#include "core/log.h"
#include "core/mem.h"
#include "process/deconvolve.h"
#include "ui/calib.h"
#include "ui/linear.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// What the steps find, in their order.
struct work {
    struct image one; // the channel, linear
    struct disc_light light;
    float *flat; // [h][w]
    struct grating grating;
    struct blaze blaze;
    double profile[GRATING_SAMPLES];
    double rmse, rmse_rl;
};

// The grating's vector on the sensor, as a viewer sees it, is the sample's +x turned by this. A
// vector has no sign here (the blaze may face either way), so the angle is the one in (-45, 135]
// degrees: the usual turn by the focus ring is +90.
static double turn_of(const struct grating *g)
{
    const double angle = atan2(-g->ky, g->kx) + M_PI / 4;
    return angle - M_PI * (ceil(angle / M_PI) - 1) - M_PI / 4;
}

static bool read_picture(struct image *im, const char *path, const char *response,
                         struct bokeh_record *r, struct err *e)
{
    if (!image_read(im, path, e) || !image_check_finite(im, path, e) ||
        !make_linear_by(im, path, response, e))
        return false;
    record_init(&r->head, "bokeh", "this lens at this focus, aperture, distance and light", NAN,
                "rmse of the blaze, of its height");
    record_from_image(&r->head, im);
    if (!meta_num(&im->meta, "expTime", &r->exposure_s))
        r->exposure_s = NAN;
    return true;
}

static bool measure(struct work *w, struct err *e)
{
    struct disc d;
    const int width = w->one.w, height = w->one.h;
    if (!disc_find(&d, w->one.px, width, height, e) ||
        !disc_light_fit(&w->light, &d, w->one.px, NULL, width, height, e) ||
        !(w->flat = sample_alloc((size_t)width * (size_t)height, sizeof(float), "picture", e)))
        return false;
    disc_flatten(&w->light, w->one.px, width, height, w->flat);
    if (!grating_find(&w->grating, &d, w->flat, width, height, e) ||
        !grating_fit_blaze(&w->grating, &w->blaze, e))
        return false;
    return true;
}

// The true profile against the one that folding and sharpening give (T17 eq. 27), both as pixels
// see them.
static void judge(struct work *w, const struct bokeh_record *r)
{
    const double box = hypot(w->grating.kx, w->grating.ky);
    double gain, offset;
    grating_sharpen(&w->grating, w->blaze.sigma_px, w->profile);
    grating_widen(w->profile, box);
    grating_affine(w->profile, &w->blaze, tan(r->blaze_rad) / r->lines_per_m, box, &gain, &offset,
                   &w->rmse);
}

// Rounds of Richardson-Lucy by its own rule, on the part of the disc that is sharp: the square in
// it.
static bool choose_iterations(struct work *w, struct bokeh_record *r, struct err *e)
{
    const struct disc *d = &w->light.disc;
    const int half = (int)(0.65 * d->radius_px), side = 2 * half + 1;
    const int left = (int)lround(d->cx_px) - half, top = (int)lround(d->cy_px) - half;
    const size_t n = (size_t)side * (size_t)side;
    const struct deconvolve_options opt = {.accelerate = true, .tv = BOKEH_TV, .most = 100};
    struct deconvolve_result res;
    float *in = sample_alloc(n, sizeof *in, "square", e),
          *out = sample_alloc(n, sizeof *out, "square", e);
    struct blur *b = in && out ? blur_gauss(side, side, w->blaze.sigma_px, e) : NULL;
    for (int j = 0; b && j < side; j++)
        memcpy(in + (size_t)j * (size_t)side,
               w->flat + (size_t)(top + j) * (size_t)w->one.w + (size_t)left,
               (size_t)side * sizeof *in);
    const bool ok = b && deconvolve(b, side, side, in, &opt, out, &res, e);
    if (ok) {
        // the profile that it leaves, against the true one (T17 eq. 27)
        struct grating sharp = w->grating;
        const struct disc inner = {half, half, half * 0.95, 0};
        double profile[GRATING_SAMPLES], gain, offset;
        struct blaze at = w->blaze;
        const double moved =
            sharp.kx * (left + half - d->cx_px) + sharp.ky * (top + half - d->cy_px);
        at.jump -= moved; // phase 0 is now at the square's middle
        r->iterations = res.iterations;
        if (grating_measure(&sharp, &inner, out, side, side, e)) {
            grating_profile(&sharp, profile);
            grating_affine(profile, &at, 1, hypot(sharp.kx, sharp.ky), &gain, &offset, &w->rmse_rl);
        }
    }
    blur_free(b);
    free(in);
    free(out);
    return ok;
}

static bool parse(const struct calib_args *a, struct bokeh_record *r, struct err *e)
{
    if (isnan(a->lines_per_m) || isnan(a->blaze_rad))
        return err_set(e, ERR_USAGE,
                       "calib bokeh: needs the grating: --lines 600/mm --blaze 13deg");
    if (!(a->lines_per_m > 0))
        return err_set(e, ERR_DATA, "--lines: must be above 0");
    if (!(a->blaze_rad > 0 && a->blaze_rad < 1.4))
        return err_set(e, ERR_DATA, "--blaze: must be between 0 and 80deg");
    r->lines_per_m = a->lines_per_m;
    r->blaze_rad = a->blaze_rad;
    r->turn_rad = NAN;
    if (a->turn && strcmp(a->turn, "auto") && !cli_degrees(a->turn, &r->turn_rad, e))
        return err_in(e, "--turn");
    return true;
}

static void report(const struct work *w, const struct bokeh_record *r, struct doc *d)
{
    doc_text(d, "channel", r->channel);
    doc_nums(d, "disc_px", (double[]){r->cx_px, r->cy_px, r->radius_px}, 3);
    doc_num(d, "lines", r->lines);
    doc_num(d, "um_per_px", r->m_per_px * 1e6);
    doc_num(d, "um_per_px_sigma", r->m_per_px_sigma * 1e6);
    doc_num(d, "turn_deg", r->turn_rad * 180 / M_PI);
    doc_num(d, "psf_sigma_px", r->sigma_px);
    doc_num(d, "psf_held_out", w->blaze.held_out);
    doc_int(d, "iterations", r->iterations);
    doc_num(d, "gain_m", r->gain_m);
    doc_num(d, "offset", r->offset);
    doc_text(d, "blaze_rises", w->blaze.rises > 0 ? "along +x" : "along -x");
    doc_num(d, "rmse", w->rmse);
    doc_num(d, "rmse_richardson_lucy", w->rmse_rl);
    for (int k = 0; k < r->n_other; k++) {
        struct doc *item = doc_item(d, "others");
        doc_text(item, "channel", r->other[k].name);
        doc_num(item, "psf_sigma_px", r->other[k].sigma_px);
        doc_num(item, "gain_m", r->other[k].gain_m);
        doc_num(item, "psf_held_out", r->other[k].rmse);
    }
}

static void work_finish(struct work *w)
{
    image_finish(&w->one);
    free(w->flat);
}

static bool calibrate(struct work *w, const struct image *im, const char *name,
                      const struct bokeh_record *r, struct bokeh_channel *out, struct err *e)
{
    const int c = im->nc == 1 ? 0 : image_channel_index(im, name);
    if (c < 0)
        return err_set(e, ERR_DATA, "has no channel %s", name);
    if (!image_channel(im, c, &w->one, e) || !measure(w, e))
        return false;
    // the blurred blaze fitted to the picture: I = 1 + contrast (t - 1/2), 0 at the bottom
    *out = (struct bokeh_channel){
        .sigma_px = w->blaze.sigma_px,
        .iterations = r->iterations,
        .gain_m = tan(r->blaze_rad) / r->lines_per_m / w->blaze.contrast,
        .offset = 1 - 0.5 * w->blaze.contrast,
        .level = w->light.level,
        .rmse = w->blaze.held_out,
    };
    snprintf(out->name, sizeof out->name, "%s", name);
    return true;
}

// What the picture's other channels give; one that shows the lines too weakly is left out.
static void calibrate_others(const struct image *im, struct bokeh_record *r)
{
    static const char *const names[] = {"B", "G", "R"};
    for (int k = 0; k < 3 && r->n_other < 2; k++) {
        struct work w = {0};
        struct err why;
        if (!strcmp(names[k], r->channel) || image_channel_index(im, names[k]) < 0)
            continue;
        if (calibrate(&w, im, names[k], r, &r->other[r->n_other], &why))
            r->n_other++;
        else
            log_note("channel %s is not calibrated: %s", names[k], why.msg);
        work_finish(&w);
    }
}

bool calib_bokeh(const struct calib_args *a, struct cli *cli, struct err *e)
{
    struct bokeh_record r = {0};
    struct work w = {0};
    struct image im = {0};
    const char *path = cli->operand[0];
    if (!parse(a, &r, e))
        return false;
    if (cli->n != 1)
        return err_set(e, ERR_USAGE, "calib bokeh: takes one photograph");
    bool ok = read_picture(&im, path, a->response, &r, e);
    if (ok) {
        struct bokeh_channel first;
        const bool mono = im.nc == 1 || (image_channel_index(&im, "Y") >= 0 &&
                                         image_channel_index(&im, "X") < 0); // nacre hdr's
        const char name[] = {mono ? 'Y' : (char)((a->channel ? *a->channel : 'b') - 'a' + 'A'), 0};
        ok = (calibrate(&w, &im, name, &r, &first, e) && choose_iterations(&w, &r, e)) ||
             err_in(e, "%s", path);
        if (ok) {
            judge(&w, &r);
            first.iterations = r.iterations;
            first.rmse = w.rmse;
            bokeh_record_take(&r, &first);
        }
    }
    if (ok) {
        const struct disc *d = &w.light.disc;
        r.cx_px = d->cx_px;
        r.cy_px = d->cy_px;
        r.radius_px = d->radius_px;
        r.lines = w.grating.lines;
        r.m_per_px = hypot(w.grating.kx, w.grating.ky) / r.lines_per_m;
        r.m_per_px_sigma = w.grating.k_sigma / r.lines_per_m;
        const double turn = turn_of(&w.grating);
        // does the blaze rise along the sample's +x?
        const double along = -w.grating.ky * sin(turn) + w.grating.kx * cos(turn);
        w.blaze.rises *= along < 0 ? -1 : 1;
        if (isnan(r.turn_rad))
            r.turn_rad = turn;
        r.head.residual = r.rmse;
        calibrate_others(&im, &r);
        ok = bokeh_record_write(&r, cli->line, a->out, e);
        report(&w, &r, cli->doc);
    }
    image_finish(&im);
    work_finish(&w);
    return ok;
}
