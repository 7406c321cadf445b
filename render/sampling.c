// sampling.c - passes over pixel, lens, lights and environment.
#define _GNU_SOURCE
#include "render/sampling.h"
#include "core/mem.h"
#include <stdlib.h>

static const double golden_angle = 2.399963229728653;

// The k-th of n in an order that spreads: steps of `ratio` n, made coprime to n.
static int spread(int k, int n, double ratio)
{
    int step = (int)fmax(1, floor(ratio * n));
    for (int a = n, b = step;;) {
        while (b) {
            const int rest = a % b;
            a = b;
            b = rest;
        }
        if (a == 1)
            return (int)((long)k * step % n);
        a = n;
        b = ++step;
    }
}

// The k-th of n points that share the unit disc's area.
static void disc_point(int k, int n, double at[2])
{
    const double r = sqrt((k + .5) / n), angle = golden_angle * k;
    at[0] = r * cos(angle);
    at[1] = r * sin(angle);
}

void sampling_init(struct sampling *p, const struct scene *s, int side)
{
    enum { POINTS = 16 };
    *p = (struct sampling){.side = side, .pass = *s, .of = s, .points = 1};
    if (side < 2)
        return;
    while (p->points < POINTS && 2 * p->points * s->n_lights <= SCENE_MAX_LIGHTS)
        p->points *= 2;
    p->light = xcalloc((size_t)(p->points * s->n_lights) + 1, sizeof *p->light);
    bool by_far = false;
    for (int k = 0; k < s->n_objects; k++)
        by_far = by_far || object_uses_far_lights(&s->object[k]);
    if (s->surround && by_far)
        p->far = surround_cut(s->surround, SURROUND_LIGHTS * side * side, &p->n_far);
}

static void sample_camera(struct sampling *p, int k)
{
    const int n = p->side * p->side, cell = spread(k, n, 0.618);
    struct camera *c = &p->pass.camera;
    *c = p->of->camera;
    c->shift[0] += ((cell % p->side + .5) / p->side - .5) * 2 / p->pass.w;
    c->shift[1] += ((cell / p->side + .5) / p->side - .5) * 2 / p->pass.h;
    struct vec3 a[3];
    double lens[2];
    camera_axes(c, p->pass.w, p->pass.h, a);
    disc_point(spread(k, n, 0.755), n, lens);
    // The eye moves over the lens; the picture is shifted so that the plane in focus stays.
    const double focus_m = camera_focus(&p->of->camera), right = v3_norm(a[0]), up = v3_norm(a[1]);
    const double x = lens[0] * c->aperture_m / 2, y = lens[1] * c->aperture_m / 2;
    const struct vec3 way = v3_add(v3_scale(x / right, a[0]), v3_scale(y / up, a[1]));
    c->eye_m = v3_add(c->eye_m, way);
    c->target_m = v3_add(c->target_m, way);
    c->shift[0] -= x / (focus_m * right);
    c->shift[1] += y / (focus_m * up);
}

static void sample_light(struct sampling *p, const struct light *l, int k)
{
    const int n = p->side * p->side, points = l->radius_m > 0 ? p->points : 1;
    const struct vec3 to = l->is_far ? l->at : v3_sub(l->at, p->of->object[0].shape.at_m);
    struct frame f;
    const bool facing = frame_from(fabs(to.x) < fabs(to.y) ? v3(1, 0, 0) : v3(0, 1, 0), to, &f);
    for (int m = 0; m < points; m++) {
        struct light *one = &p->light[p->pass.n_lights++];
        double at[2] = {0};
        if (facing)
            disc_point(k + n * m, n * points, at);
        *one = *l;
        one->power /= points;
        const struct vec3 way = v3_scale(l->radius_m, v3(at[0], at[1], 0));
        one->at = v3_add(l->at, facing ? frame_world(&f, way) : way);
        if (l->is_far)
            one->at = v3_unit(one->at);
    }
}

void sampling_pass(struct sampling *p, int k)
{
    if (p->side < 2)
        return;
    const int n = p->side * p->side;
    sample_camera(p, k);
    p->pass.light = p->light;
    p->pass.n_lights = 0;
    for (int l = 0; l < p->of->n_lights; l++)
        sample_light(p, &p->of->light[l], k);
    if (!p->far)
        return;
    p->around = *p->of->surround;
    p->around.n_lights = 0;
    for (int l = k; l < p->n_far; l += n) {
        struct surround_light *one = &p->around.light[p->around.n_lights++];
        *one = p->far[l];
        for (int c = 0; c < 3; c++)
            one->irradiance[c] *= n;
    }
    p->pass.surround = &p->around;
}

void sampling_finish(struct sampling *p)
{
    free(p->light);
    free(p->far);
    *p = (struct sampling){0};
}
