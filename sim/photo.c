// photo.c - from the scene's geometry and the sample's far field to radiance.
#define _GNU_SOURCE
#include "sim/photo.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

struct sight photo_sight(const struct sim_scene *s, double i, double j)
{
    const double u = (i - s->view.center_x) * s->view.h_per_pixel;
    const double v = (j - s->view.center_y) * s->view.h_per_pixel;
    const double across2 = u * u + v * v;
    struct sight at = {.u = u, .v = v, .w = NAN, .lm = NAN};
    if (across2 >= 1)
        return at; // past the horizon
    const double cos_o = sqrt(1 - across2),
                 fresnel = sample_fresnel(&s->sample, sqrt(0.5 + 0.5 * cos_o));
    at.w = 1 + cos_o;
    const double g = at.w * at.w / cos_o; // (1 + wi.wo)^2 / (cos_i cos_o), wi = n
    at.factor = fresnel * g / (at.w * at.w);
    at.lm = s->sample.r0 / (g * fresnel);
    return at;
}

static void range_of(const struct sim_scene *s, const struct band *b, struct farfield_range *r)
{
    *r = (struct farfield_range){
        .w_min = 2, .lambda_min_m = b->lambda_m[0], .lambda_max_m = b->lambda_m[b->n - 1]};
    for (int j = 0; j < s->view.h; j++) // u and v are largest, w least, at some pixel: look at all
        for (int i = 0; i < s->view.w; i++) {
            const struct sight at = photo_sight(s, i, j);
            if (!(at.factor > 0))
                continue;
            r->h_max = fmax(r->h_max, hypot(at.u, at.v));
            r->w_min = fmin(r->w_min, at.w);
            r->w_max = fmax(r->w_max, at.w);
        }
}

bool photo_pattern(const struct sim_scene *s, const struct band *b, struct image *out,
                   struct err *e)
{
    struct farfield_range range;
    struct farfield p;
    struct image im;
    const int nc = s->sensor.bayer ? 3 : 1;
    range_of(s, b, &range);
    if (!(range.w_max > 0))
        return err_set(e, ERR_DATA, "%s: no pixel sees the sample", s->path);
    if (!farfield_init(&p, &s->sample, &range, e))
        return err_in(e, "%s", s->path);
    if (!image_init(&im, s->view.w, s->view.h, nc, e)) {
        farfield_finish(&p);
        return false;
    }
#pragma omp parallel for schedule(dynamic, 4)
    for (int j = 0; j < im.h; j++)
        for (int i = 0; i < im.w; i++) {
            const struct sight at = photo_sight(s, i, j);
            double sum[3] = {0};
            for (int k = 0; k < b->n && at.factor > 0; k++) {
                const double d = farfield_at(&p, at.u, at.v, at.w, b->lambda_m[k]);
                for (int c = 0; c < nc; c++)
                    sum[c] += b->weight[3 * k + c] * d;
            }
            for (int c = 0; c < nc; c++)
                im.px[((size_t)j * (size_t)im.w + (size_t)i) * (size_t)nc + (size_t)c] =
                    (float)(b->irradiance * at.factor * sum[c]);
        }
    farfield_finish(&p);
    *out = im;
    return true;
}

bool photo_geometry(const struct sim_scene *s, struct image *out, struct err *e)
{
    struct image im;
    if (!image_init(&im, s->view.w, s->view.h, 4, e))
        return false;
    meta_set_text(&im.meta, "channels", "u,v,w,weight");
    for (int j = 0; j < im.h; j++)
        for (int i = 0; i < im.w; i++) {
            const struct sight at = photo_sight(s, i, j);
            float *px = im.px + 4 * ((size_t)j * (size_t)im.w + (size_t)i);
            px[0] = (float)at.u;
            px[1] = (float)at.v;
            px[2] = (float)at.w;
            px[3] = (float)at.lm;
        }
    *out = im;
    return true;
}
