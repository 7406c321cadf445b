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
                w_min = fmin(w_min, at[k].w);
                w_max = fmax(w_max, at[k].w);
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
