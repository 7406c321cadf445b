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

static bool cut_surround(struct sampling *p, const struct scene *s, int passes, struct err *e)
{
    bool by_far = false, alone = false;
    for (int k = 0; k < s->n_objects; k++) {
        const struct object *o = &s->object[k];
        by_far = by_far || object_uses_far_lights(o);
        alone = alone || object_by_lights_alone(o);
        if (object_has_lobes(o) && !lobes_init(&p->lobes[k], &o->material, o->material.diffraction,
                                               LOBES_CELLS, passes, e))
            return false;
    }
    const struct image *all = &s->surround->env.map, *spots = &s->surround->spots;
    if (alone && !(p->all = surround_cut(all, SURROUND_LIGHTS, passes, &p->n_all, e)))
        return false;
    return !by_far || (p->spots = surround_cut(spots, SURROUND_SPOTS, passes, &p->n_spots, e));
}

bool sampling_init(struct sampling *p, const struct scene *s, int side, struct err *e)
{
    enum { POINTS = 16 };
    *p = (struct sampling){.side = side, .pass = *s, .of = s, .points = 1};
    if (side < 2)
        return true;
    while (p->points < POINTS && 2 * p->points * s->n_lights <= SCENE_MAX_LIGHTS)
        p->points *= 2;
    p->light = xcalloc((size_t)(p->points * s->n_lights) + 1, sizeof *p->light);
    p->object = xcalloc((size_t)s->n_objects, sizeof *p->object);
    p->lobes = xcalloc((size_t)s->n_objects, sizeof *p->lobes);
    p->picked = xcalloc((size_t)s->n_objects, sizeof *p->picked);
    for (int k = 0; k < s->n_objects; k++)
        p->object[k] = s->object[k];
    if (!s->surround || cut_surround(p, s, side * side, e))
        return true;
    sampling_finish(p);
    return false;
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

// One part of each light, in the place of all of it.
static int pick(const struct surround_light *from, int n, int passes, int k,
                struct surround_light *to)
{
    for (int l = 0; l < n / passes; l++) {
        to[l] = from[l * passes + (k + 29 * l) % passes];
        for (int c = 0; c < 3; c++)
            to[l].irradiance[c] *= passes;
    }
    return n / passes;
}

bool sampling_pass(struct sampling *p, int k, struct err *e)
{
    if (p->side < 2)
        return true;
    const int n = p->side * p->side;
    sample_camera(p, k);
    p->pass.light = p->light;
    p->pass.n_lights = 0;
    for (int l = 0; l < p->of->n_lights; l++)
        sample_light(p, &p->of->light[l], k);
    if (!p->of->surround)
        return true;
    p->pass.pass = k;
    p->pass.passes = n;
    p->around = *p->of->surround;
    p->pass.surround = &p->around;
    if (p->all)
        p->around.n_lights = pick(p->all, p->n_all, n, k, p->around.light);
    if (p->spots)
        p->around.n_spots = pick(p->spots, p->n_spots, n, k, p->around.spot);
    p->pass.object = p->object;
    for (int l = 0; l < p->of->n_objects; l++) {
        struct object *o = &p->object[l];
        if (!p->lobes[l].n)
            continue;
        lobes_finish(&p->picked[l]);
        if (!lobes_pick(&p->lobes[l], n, k, &p->picked[l], e))
            return false;
        o->lobes[o->material.diffraction] = p->picked[l];
    }
    return true;
}

void sampling_finish(struct sampling *p)
{
    for (int k = 0; p->lobes && k < p->of->n_objects; k++) {
        lobes_finish(&p->lobes[k]);
        lobes_finish(&p->picked[k]);
    }
    free(p->lobes);
    free(p->picked);
    free(p->object);
    free(p->light);
    free(p->all);
    free(p->spots);
    *p = (struct sampling){0};
}
