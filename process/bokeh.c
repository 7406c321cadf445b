// bokeh.c - from the photograph of a defocused highlight to heights.
#define _GNU_SOURCE
#include "process/bokeh.h"
#include "core/mem.h"
#include "process/bokeh_fold.h"
#include "process/bspline.h"
#include "process/deconvolve.h"
#include "process/level.h"
#include "process/roughness.h"
#include "process/tile.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double GREEN_M = 520e-9;   // the wavelength of T17's 343 lp/mm at f/5.6
static const double UNEXPLAINED = 0.05; // variance that averaging along lines may leave

static bool sharpen(struct flat *f, const struct bokeh_record *rec, int *iterations, struct err *e)
{
    struct blur *b = blur_gauss(f->w, f->h, rec->sigma_px, e);
    float *sharp = sample_alloc((size_t)f->w * (size_t)f->h, sizeof *sharp, "picture", e);
    struct deconvolve_result res;
    const bool ok =
        b && sharp &&
        deconvolve(b, f->w, f->h, f->px,
                   &(struct deconvolve_options){
                       .iterations = rec->iterations, .accelerate = true, .tv = BOKEH_TV},
                   sharp, &res, e);
    if (ok) {
        free(f->px);
        f->px = sharp;
        *iterations = res.iterations;
    } else {
        free(sharp);
    }
    blur_free(b);
    return ok;
}

// Node (x, y) of the sample, from the disc's centre, lies at this place of the picture: the sensor
// shows the sample turned counter-clockwise by `turn`, and y grows downwards in both.
static void picture_from_sample(double turn, double x, double y, double *i, double *j)
{
    const double c = cos(turn), s = sin(turn);
    *i = c * x + s * y;
    *j = -s * x + c * y;
}

// The largest square inside 0.97 of the disc, less what the deconvolution spoils at the rim; turned
// back. A turn by quarters takes samples as they are, about the pixel nearest to the centre. Of a
// folded picture samples are the fold's.
static bool cut_square(struct flat *f, const struct bokeh_record *rec, struct fold *fold,
                       const struct bokeh_options *opt, struct hfield *out,
                       struct bokeh_result *res, struct err *e)
{
    const struct disc *d = &f->disc;
    const double reach = 0.97 * d->radius_px - 3 * rec->sigma_px;
    const int half = (int)floor(reach / M_SQRT2);
    if (half < 16)
        return err_set(e, ERR_DATA,
                       "the disc of radius %.1f px is too small for a PSF of sigma %.2f px",
                       d->radius_px, rec->sigma_px);
    int nx = 2 * half + 1, ny = nx;
    const double quarters = rec->turn_rad / (M_PI / 2);
    const bool exact = fabs(quarters - round(quarters)) < 1e-6; // records have 9 digits
    double turn = exact ? round(quarters) * (M_PI / 2) : rec->turn_rad;
    if (fold->kind && opt->edge == BOKEH_TILE) {
        res->strain = fold_fit(fold, turn, &nx, &ny, &res->turned_rad);
        turn -= res->turned_rad;
    }
    struct hfield hf;
    if (!hfield_init(&hf, nx, ny, rec->m_per_px, rec->m_per_px, e))
        return false;
    double cx = d->cx_px, cy = d->cy_px;
    if (exact) {
        cx = round(cx);
        cy = round(cy);
    } else if (!fold->kind) {
        bspline_fit_image(f->px, f->w, f->h, BSPLINE_CUBIC);
    }
#pragma omp parallel for schedule(static)
    for (int y = 0; y < ny; y++)
        for (int x = 0; x < nx; x++) {
            double i, j;
            picture_from_sample(turn, x - nx / 2, y - ny / 2, &i, &j);
            const double v =
                fold->kind ? fold_at(fold, cx + i, cy + j)
                : exact
                    ? (double)f->px[(size_t)lround(cy + j) * (size_t)f->w + (size_t)lround(cx + i)]
                    : bspline_at(f->px, f->w, f->h, cx + i, cy + j);
            hf.z[(size_t)y * (size_t)nx + (size_t)x] = (float)(rec->gain_m * (v - rec->offset));
        }
    *out = hf;
    return true;
}

// Contrast of what varies over a few pixels, over the noise of neighbours: the channel that shows
// most.
static double score(const float *px, int w, int h, const struct disc *d)
{
    const int reach = (int)(0.6 * d->radius_px), step = 4;
    double slow = 0, fast = 0, mean = 0;
    long n = 0;
    for (int y = -reach; y <= reach; y++)
        for (int x = -reach; x <= reach; x++) {
            const int i = (int)d->cx_px + x, j = (int)d->cy_px + y;
            if (i < step || j < step || i >= w - step || j >= h - step)
                continue;
            const float *at = px + (size_t)j * (size_t)w + i;
            const double ds =
                (double)at[step] - (double)at[-step] + (double)at[step * w] - (double)at[-step * w];
            const double df = (double)at[1] - 2 * (double)at[0] + (double)at[-1];
            slow += ds * ds;
            fast += df * df;
            mean += (double)at[0];
            n++;
        }
    return n && fast > 0 && mean > 0 ? sqrt(slow / fast) : 0;
}

// The mean along the lines: heights become a function of the distance across them, where that
// leaves less than `most` of their variance; *done tells.
static bool average_lines(struct hfield *hf, double direction_rad, double most, bool *done,
                          struct err *e)
{
    const double c = cos(direction_rad), s = sin(direction_rad),
                 reach = 0.5 * (hf->nx - 1) * M_SQRT2;
    const int bins = 2 * (int)ceil(reach) + 3;
    double *sum = sample_alloc((size_t)bins, sizeof *sum, "profile", e);
    double *weight = sample_alloc((size_t)bins, sizeof *weight, "profile", e);
    double left = 0, all = 0, mean = 0;
    const bool ok = sum && weight;
    *done = false;
    // gather into bins by linear sharing; see what they leave; spread back
    for (int pass = 0; ok && pass < (left < most * all ? 3 : 2); pass++) {
        for (int j = 0; j < hf->ny; j++)
            for (int i = 0; i < hf->nx; i++) {
                float *z = hf->z + (size_t)j * (size_t)hf->nx + (size_t)i;
                const double across =
                    c * (i - 0.5 * (hf->nx - 1)) + s * (j - 0.5 * (hf->ny - 1)) + bins / 2;
                const int k = (int)across;
                const double f = across - k, line = (1 - f) * sum[k] + f * sum[k + 1];
                if (pass == 0) {
                    sum[k] += (1 - f) * (double)*z;
                    weight[k] += 1 - f;
                    sum[k + 1] += f * (double)*z;
                    weight[k + 1] += f;
                    mean += (double)*z / ((double)hf->nx * hf->ny);
                } else if (pass == 1) {
                    left += ((double)*z - line) * ((double)*z - line);
                    all += ((double)*z - mean) * ((double)*z - mean);
                } else {
                    *z = (float)line;
                    *done = true;
                }
            }
        for (int k = 0; pass == 0 && k < bins; k++)
            sum[k] = weight[k] > 0 ? sum[k] / weight[k] : 0;
    }
    free(sum);
    free(weight);
    return ok;
}

static bool finish(struct hfield *hf, const struct bokeh_options *opt, const struct fold *fold,
                   const struct bokeh_record *rec, const struct image *im, struct bokeh_result *res,
                   struct err *e)
{
    const bool closed = fold->kind && opt->edge == BOKEH_TILE; // no plane may open it again
    if (opt->level && !hfield_level(hf, closed ? LEVEL_MEAN : LEVEL_PLANE, e))
        return false;
    res->n_periods = hfield_periods(hf, res->period, e);
    if (res->n_periods < 0)
        return false;
    res->fold = fold->kind;
    for (int k = 0; fold->kind && k < res->n_periods; k++)
        fold_snap(fold, rec->turn_rad - res->turned_rad, rec->m_per_px, &res->period[k]);
    if (!fold->kind && res->n_periods && opt->lines != BOKEH_2D) { // no second harmonic
        bool averaged;
        const int k =
            res->n_periods == 2 && res->period[1].amplitude_m > res->period[0].amplitude_m;
        if (!average_lines(hf, res->period[k].direction_rad,
                           opt->lines == BOKEH_1D ? INFINITY : UNEXPLAINED, &averaged, e))
            return false;
        res->fold = averaged ? FOLD_LINES : FOLD_NONE;
    }
    if (opt->edge == BOKEH_TILE && !closed && !hfield_tile(hf, &res->seam, e))
        return false;
    if (opt->edge == BOKEH_WINDOW)
        hfield_window(hf);
    double f_number = 5.6;
    meta_num(&im->meta, "aperture", &f_number);
    if (!isnan(opt->f_number))
        f_number = opt->f_number;
    res->cutoff_per_m = 1 / (GREEN_M * f_number);
    struct roughness r;
    if (!hfield_roughness(&r, hf, e))
        return false;
    res->sd_m = r.sq_m;
    meta_set_num(&hf->meta, "nacre.cutoff_per_m", res->cutoff_per_m);
    meta_set_text(&hf->meta, "nacre.channel", res->channel);
    return true;
}

// Folds the disc when told so, or when that explains nearly all of it; else it stays a picture.
static bool take_fold(struct fold *fold, struct flat *f, const struct bokeh_record *rec,
                      const struct bokeh_options *opt, struct err *e)
{
    if (opt->lines != BOKEH_2D && fold_lines(fold, f, rec->sigma_px, opt->lines == BOKEH_1D))
        return true;
    return !opt->lattice || fold_lattice(fold, f, rec->sigma_px, e);
}

bool bokeh_height(const struct image *im, const struct bokeh_record *record,
                  const struct bokeh_options *opt, struct hfield *out, struct bokeh_result *res,
                  struct err *e)
{
    struct image one = {0};
    struct flat f = {0};
    struct hfield hf = {0};
    struct bokeh_record one_channel = *record, *rec = &one_channel;
    *res = (struct bokeh_result){0};
    const char *name = opt->channel ? opt->channel : im->nc == 1 ? "Y" : rec->channel;
    const int c = im->nc == 1 ? 0 : image_channel_index(im, name);
    if (c < 0)
        return err_set(e, ERR_DATA, "the picture has no channel '%s'", name);
    if (im->nc > 1 && !bokeh_record_select(rec, name, e))
        return false;
    snprintf(res->channel, sizeof res->channel, "%.7s", name);
    bool ok = image_channel(im, c, &one, e) && disc_find(&res->disc, one.px, one.w, one.h, e);
    for (int k = 0; ok && k < 3 && k < im->nc; k++) {
        struct image other = {0};
        ok = image_channel(im, k, &other, e);
        if (ok)
            res->score[k] = score(other.px, other.w, other.h, &res->disc);
        image_finish(&other);
    }
    struct fold fold = {0};
    ok = ok && flat_init(&f, one.px, one.w, one.h, &res->disc, bokeh_record_level(rec, im),
                         6 * rec->sigma_px, e);
    ok = ok && take_fold(&fold, &f, rec, opt, e) &&
         (fold.kind || sharpen(&f, rec, &res->iterations, e)) &&
         cut_square(&f, rec, &fold, opt, &hf, res, e) && finish(&hf, opt, &fold, rec, im, res, e);
    if (ok)
        *out = hf;
    else
        hfield_finish(&hf);
    fold_finish(&fold);
    flat_finish(&f);
    image_finish(&one);
    return ok;
}
