// photo.c - from the scene's geometry and the sample's far field to radiance.
#define _GNU_SOURCE
#include "sim/photo.h"
#include "sim/lens.h"
#include <math.h>

// Ranges of h over the picture. Looking at every third pixel and a margin of three pixels' change
// covers all of them.
static bool range_of(const struct sim_scene *s, const struct band *b, struct farfield_range *r,
                     struct err *e)
{
    double h_max = 0, w_min = 4, w_max = 0, change = 0;
    const struct sim_view *v = &s->view;
#pragma omp parallel for schedule(static) reduction(max                                            \
                                                    : h_max, w_max, change) reduction(min          \
                                                                                      : w_min)
    for (int j = 0; j < v->h + 2; j += 3) {
        struct sight last = {.factor = 0};
        for (int i = 0; i < v->w + 2; i += 3) {
            struct sight at[SIGHTS];
            const int n = view_sights(v, &s->sample, i, j, at);
            for (int k = 0; k < n; k++) {
                if (!(at[k].factor > 0))
                    continue;
                h_max = fmax(h_max, hypot(at[k].u, at[k].v));
                const double w = s->table_of ? view_w(s->table_of, at[k].u, at[k].v) : at[k].w;
                w_min = fmin(w_min, w);
                w_max = fmax(w_max, w);
            }
            if (at[0].factor > 0 && last.factor > 0)
                change = fmax(change, hypot(at[0].u - last.u, at[0].v - last.v));
            last = at[0];
        }
    }
    if (!(w_max > 0))
        return err_set(e, ERR_DATA, "%s: no pixel sees the sample", s->path);
    *r = (struct farfield_range){.h_max = fmin(2, h_max + change),
                                 .lambda_min_m = b->lambda_m[0],
                                 .lambda_max_m = b->lambda_m[b->n - 1],
                                 .w_min = fmax(1e-3, w_min - change),
                                 .w_max = fmin(2, w_max + change)};
    return true;
}

static void expose_pixel(const struct sim_scene *s, const struct band *b, const struct farfield *f,
                         int i, int j, int nc, float *px)
{
    struct sight at[SIGHTS];
    double sum[3] = {0};
    const int n = view_sights(&s->view, &s->sample, i, j, at);
    for (int p = 0; p < n && s->table_of; p++) {
        const double w = view_w(s->table_of, at[p].u, at[p].v);
        at[p].factor *= at[p].w * at[p].w / (w * w);
        at[p].w = w;
    }
    for (int p = 0; p < n; p++)
        for (int k = 0; k < b->n && at[p].factor > 0; k++) {
            const double d = at[p].share * at[p].factor *
                             farfield_at(f, at[p].u, at[p].v, at[p].w, b->lambda_m[k]);
            for (int c = 0; c < nc; c++)
                sum[c] += b->weight[3 * k + c] * d;
        }
    const double scale = b->irradiance * view_vignetting(&s->view, i, j);
    for (int c = 0; c < nc; c++)
        px[c] = (float)(scale * sum[c]);
}

bool photo_pattern(const struct sim_scene *s, const struct band *b, struct image *out,
                   struct err *e)
{
    struct farfield_range range;
    struct farfield f;
    struct image im;
    const int nc = s->sensor.bayer ? 3 : 1;
    if (!range_of(s, b, &range, e))
        return false;
    if (!farfield_init(&f, &s->sample, &range, e))
        return err_in(e, "%s", s->path);
    bool ok = image_init(&im, s->view.w, s->view.h, nc, e);
    if (ok) {
#pragma omp parallel for schedule(dynamic, 4)
        for (int j = 0; j < im.h; j++)
            for (int i = 0; i < im.w; i++)
                expose_pixel(s, b, &f, i, j, nc,
                             im.px + ((size_t)j * (size_t)im.w + (size_t)i) * (size_t)nc);
        for (int c = 0; ok && c < nc; c++)
            ok = lens_blur(&im, c, s->view.defocus_px, e);
        ok = ok && lens_glare(&im, s->view.glare, s->view.glare_px, e);
        if (ok)
            *out = im;
        else
            image_finish(&im);
    }
    farfield_finish(&f);
    return ok;
}

// The scene's bokeh at the size of the camera's picture, its disc grown with the focus.
static struct sim_bokeh disc_at(const struct sim_scene *s, double focus_per_m)
{
    struct sim_bokeh d = s->bokeh;
    const double fit = fmin((double)s->view.w / d.w, (double)s->view.h / d.h);
    const double grow = fit * focus_per_m / d.focus_per_m;
    d.center_x = 0.5 * (s->view.w - 1) + fit * (d.center_x - 0.5 * (d.w - 1));
    d.center_y = 0.5 * (s->view.h - 1) + fit * (d.center_y - 0.5 * (d.h - 1));
    d.w = s->view.w;
    d.h = s->view.h;
    d.radius_px *= grow;
    d.m_per_px /= grow;
    for (int c = 0; c < 3; c++)
        d.sigma_px[c] *= grow;
    return d;
}

// Which of red, green and blue a band is nearest to, for a sensor without colours.
static int colour_of(const struct band *b)
{
    double mean_m = 0, sum = 0;
    for (int k = 0; k < b->n; k++) {
        mean_m += b->weight[3 * k] * b->lambda_m[k];
        sum += b->weight[3 * k];
    }
    return mean_m > 580e-9 * sum ? 0 : mean_m > 490e-9 * sum ? 1 : 2;
}

static bool photo_disc(const struct sim_scene *s, const struct band *b, double focus_per_m,
                       struct image *out, struct err *e)
{
    const struct sim_bokeh disc = disc_at(s, focus_per_m);
    const int nc = s->sensor.bayer ? 3 : 1;
    const double wall = b->irradiance / M_PI;
    struct image rgb, im;
    if (!bokeh_photo(&disc, &s->sample, &rgb, e))
        return false;
    const bool ok = image_init(&im, s->view.w, s->view.h, nc, e);
    for (size_t k = 0; ok && k < (size_t)im.w * (size_t)im.h; k++)
        for (int c = 0; c < nc; c++)
            im.px[k * (size_t)nc + (size_t)c] =
                (float)(wall * (double)rgb.px[3 * k + (size_t)(nc == 1 ? colour_of(b) : c)]);
    image_finish(&rgb);
    if (ok)
        *out = im;
    return ok;
}

// A target for calibration, as bright as its picture times a white wall; the even one is a wall.
static bool photo_target(const struct sim_scene *s, const struct band *b, struct image *out,
                         struct err *e)
{
    struct image one = {0}, im;
    const struct sim_view *v = &s->view;
    const int nc = s->sensor.bayer ? 3 : 1;
    if ((s->target == SIM_BOARD && !board_photo(&s->board, v, &one, e)) ||
        (s->target == SIM_BALL && !ball_photo(&s->ball, v, &one, e)))
        return err_in(e, "%s", s->path);
    if (!image_init(&im, v->w, v->h, nc, e)) {
        image_finish(&one);
        return false;
    }
    for (int j = 0; j < im.h; j++)
        for (int i = 0; i < im.w; i++) {
            const size_t k = (size_t)j * (size_t)im.w + (size_t)i;
            const double part = one.px ? (double)one.px[k] : 1;
            for (int c = 0; c < nc; c++)
                im.px[k * (size_t)nc + (size_t)c] =
                    (float)(part * b->irradiance / M_PI * view_vignetting(v, i, j));
        }
    image_finish(&one);
    *out = im;
    return true;
}

bool photo_focused(const struct sim_scene *s, const struct band *b, double focus_per_m,
                   struct image *out, struct err *e)
{
    if (s->target != SIM_SAMPLE)
        return photo_target(s, b, out, e);
    if (isnan(focus_per_m) || !(focus_per_m > 0))
        return photo_pattern(s, b, out, e);
    if (focus_per_m >= 0.5 * s->bokeh.focus_per_m)
        return photo_disc(s, b, focus_per_m, out, e);
    struct sim_scene blurred = *s; // a disc's standard deviation is half its radius
    blurred.view.defocus_px = hypot(s->view.defocus_px, 0.5 * disc_at(s, focus_per_m).radius_px);
    return photo_pattern(&blurred, b, out, e);
}

bool photo_geometry(const struct sim_scene *s, struct image *out, struct err *e)
{
    struct image im;
    if (!image_init(&im, s->view.w, s->view.h, 4, e))
        return false;
    meta_set_text(&im.meta, "channels", "u,v,w,weight");
#pragma omp parallel for schedule(static)
    for (int j = 0; j < im.h; j++)
        for (int i = 0; i < im.w; i++) {
            struct sight at[SIGHTS];
            view_sights(&s->view, &s->sample, i, j, at);
            float *px = im.px + 4 * ((size_t)j * (size_t)im.w + (size_t)i);
            px[0] = (float)at[0].u;
            px[1] = (float)at[0].v;
            px[2] = (float)at[0].w;
            px[3] = (float)at[0].lm;
        }
    *out = im;
    return true;
}
