// cpu.c - rays, the nearest hit, and the reflectance under each light.
#define _GNU_SOURCE
#include "render/cpu.h"
#include "core/log.h"
#include <stddef.h>

enum { RAYS = 8, LIGHT_POINTS = 32 };

// The light seen from its k-th of LIGHT_POINTS points: a spiral of equal areas over its disc, which
// faces the point that is lit; `turn` rotates it from ray to ray.
static struct light light_point(const struct light *l, struct vec3 lit, int k, double turn)
{
    struct light p = *l;
    struct frame f;
    const struct vec3 to = l->is_far ? l->at : v3_sub(l->at, lit);
    if (!frame_from(fabs(to.x) < fabs(to.y) ? v3(1, 0, 0) : v3(0, 1, 0), to, &f))
        return p;
    const double r = l->radius_m * sqrt((k + .5) / LIGHT_POINTS);
    const double angle = 2.399963229728653 * k + turn; // the golden angle
    p.at = v3_add(l->at, frame_world(&f, v3(r * cos(angle), r * sin(angle), 0)));
    if (l->is_far)
        p.at = v3_unit(p.at);
    return p;
}

static void add_light(const struct scene *s, const struct material *m, const struct hit *hit,
                      struct vec3 wo, const struct light *l, double share, double sum[3])
{
    struct vec3 wi;
    const double irradiance = share * light_at(l, hit->at_m, &wi);
    double out[3];
    material_eval(m, frame_local(&hit->frame, wi), wo, s->light_color,
                  mask_at(&m->mask, hit->s, hit->v), out);
    for (int c = 0; c < 3; c++)
        sum[c] += irradiance * l->tint[c] * out[c];
}

static void trace(const struct scene *s, struct vec3 dir, bool integrate, double turn,
                  double out[3])
{
    struct hit hit = {.distance = INFINITY}, h;
    const struct material *m = NULL;
    for (int k = 0; k < s->n_objects; k++)
        if (shape_hit(&s->object[k].shape, s->camera.eye_m, dir, &h) && h.distance < hit.distance) {
            hit = h;
            m = &s->object[k].material;
        }
    for (int c = 0; c < 3; c++)
        out[c] = m ? 0 : s->background[c];
    if (!m)
        return;
    const struct vec3 wo = frame_local(&hit.frame, v3_scale(-1, v3_unit(dir)));
    for (int k = 0; k < s->n_lights; k++) {
        const struct light *l = &s->light[k];
        const int points = integrate && l->radius_m > 0 ? LIGHT_POINTS : 1;
        for (int p = 0; p < points; p++) {
            const struct light point = points > 1 ? light_point(l, hit.at_m, p, turn) : *l;
            add_light(s, m, &hit, wo, &point, 1.0 / points, out);
        }
    }
}

bool cpu_render(const struct scene *s, bool integrate, struct image *out, struct err *e)
{
    if (!image_init(out, s->w, s->h, 3, e))
        return false;
    const int rays = integrate ? RAYS : 1;
    struct progress bar;
    progress_start(&bar, "rendering", s->h);
#pragma omp parallel for schedule(dynamic, 4)
    for (int j = 0; j < s->h; j++) {
        for (int i = 0; i < s->w; i++) {
            double sum[3] = {0};
            for (int k = 0; k < rays * rays; k++) {
                const double x = i + (k % rays + .5) / rays - .5,
                             y = j + (k / rays + .5) / rays - .5;
                struct vec3 dir;
                double one[3];
                camera_ray(&s->camera, x, y, s->w, s->h, &dir);
                trace(s, dir, integrate, k, one);
                for (int c = 0; c < 3; c++)
                    sum[c] += one[c];
            }
            float *px = out->px + ((size_t)j * (size_t)s->w + (size_t)i) * 3;
            for (int c = 0; c < 3; c++)
                px[c] = (float)(sum[c] / (rays * rays));
        }
        progress_step(&bar, 1);
    }
    progress_end(&bar);
    return true;
}
