// scene.c - cameras, lights, and the life of a scene.
#define _GNU_SOURCE
#include "render/scene.h"
#include <math.h>
#include <stdlib.h>

void scene_finish(struct scene *s)
{
    if (!s)
        return;
    for (int k = 0; k < s->n_objects; k++) {
        shape_finish(&s->object[k].shape);
        material_finish(&s->object[k].material);
        image_finish(&s->object[k].seen);
        for (int kind = 0; kind < DIFFRACTION_KINDS; kind++)
            lobes_finish(&s->object[k].lobes[kind]);
        env_keep_free(s->object[k].keep);
        free(s->object[k].name);
    }
    free(s->object);
    free(s->light);
    surround_finish(s->surround);
    free(s->surround);
    free(s->path);
    *s = (struct scene){0};
}

static bool cut_lobes(struct object *o, enum diffraction kind, struct err *e)
{
    return o->lobes[kind].n || lobes_init(&o->lobes[kind], &o->material, kind, LOBES_CELLS, 1, e);
}

// The directions to a pinhole camera from all over an object, with two nodes on every side.
static void see(const struct scene *s, const struct shape *shape, struct seen_how *how)
{
    enum { PROBES = 33 };
    int box[4];
    double lo[2] = {1, 1}, hi[2] = {-1, -1};
    shape_pixels(&s->camera, shape, s->w, s->h, box);
    for (int k = 0; k < PROBES * PROBES; k++) {
        struct vec3 dir;
        camera_ray(&s->camera, box[0] - .5 + (box[2] - box[0]) * (k % PROBES) / (PROBES - 1.0),
                   box[1] - .5 + (box[3] - box[1]) * (k / PROBES) / (PROBES - 1.0), s->w, s->h,
                   &dir);
        const struct vec3 wo = frame_local(&shape->frame, v3_scale(-1, v3_unit(dir)));
        const double o[2] = {wo.x, wo.y};
        for (int q = 0; q < 2; q++) {
            lo[q] = fmin(lo[q], o[q]);
            hi[q] = fmax(hi[q], o[q]);
        }
    }
    for (int q = 0; q < 2; q++)
        how->middle[q] = (lo[q] + hi[q]) / 2;
    how->span = fmax(hi[0] - lo[0], hi[1] - lo[1]) + 8.0 / how->n + .01;
}

bool scene_prefilter(struct scene *s, struct err *e)
{
    for (int k = 0; k < s->n_objects && s->surround; k++) {
        struct object *o = &s->object[k];
        const struct shape *shape = &o->shape;
        const bool flat =
            shape->kind == SHAPE_PLANE || (shape->kind == SHAPE_DISC && shape->fixed_tangent);
        const bool table = o->material.table.n > 0;
        struct seen_how how = {.n = s->seen_size, .keep = o->keep};
        if (flat && s->still && s->camera.aperture_m == 0)
            see(s, shape, &how);
        if ((flat && table && !o->seen.px &&
             !surround_prefilter(s->surround, &o->material, &shape->frame, &how, &o->seen, e)) ||
            (!flat && table && !cut_lobes(o, DIFFRACTION_TABLE, e)) ||
            (o->material.slits.n && !cut_lobes(o, DIFFRACTION_SLITS, e)))
            return err_in(e, "%s: what it shows of the environment", o->name);
    }
    return true;
}

void camera_axes(const struct camera *c, int w, int h, struct vec3 axes[3])
{
    const struct vec3 forward = v3_unit(v3_sub(c->target_m, c->eye_m));
    const struct vec3 right = v3_unit(v3_cross(forward, c->up));
    const double half = tan(c->fov_rad / 2);
    axes[0] = v3_scale(half * w / h, right);
    axes[1] = v3_scale(half, v3_cross(right, forward));
    axes[2] = forward;
}

double camera_focus(const struct camera *c)
{
    return c->focus_m > 0 ? c->focus_m : v3_norm(v3_sub(c->target_m, c->eye_m));
}

void camera_ray(const struct camera *c, double x, double y, int w, int h, struct vec3 *dir)
{
    struct vec3 a[3];
    camera_axes(c, w, h, a);
    const double sx = 2 * (x + .5) / w - 1 + c->shift[0], sy = 1 - 2 * (y + .5) / h - c->shift[1];
    *dir = v3_add(a[2], v3_add(v3_scale(sx, a[0]), v3_scale(sy, a[1])));
}

void shape_pixels(const struct camera *c, const struct shape *s, int w, int h, int box[4])
{
    struct vec3 a[3], lo, hi;
    camera_axes(c, w, h, a);
    shape_bounds(s, &lo, &hi);
    double x0 = w, x1 = 0, y0 = h, y1 = 0;
    bool behind = false;
    for (int k = 0; k < 8; k++) {
        const struct vec3 corner =
            v3(k & 1 ? lo.x : hi.x, k & 2 ? lo.y : hi.y, k & 4 ? lo.z : hi.z);
        const struct vec3 p = v3_sub(v3_add(s->at_m, frame_world(&s->frame, corner)), c->eye_m);
        const double z = v3_dot(p, a[2]);
        behind = behind || z <= 0;
        const double x = (v3_dot(p, a[0]) / v3_dot(a[0], a[0]) / z + 1 - c->shift[0]) / 2 * w;
        const double y = (1 - c->shift[1] - v3_dot(p, a[1]) / v3_dot(a[1], a[1]) / z) / 2 * h;
        x0 = fmin(x0, x);
        x1 = fmax(x1, x);
        y0 = fmin(y0, y);
        y1 = fmax(y1, y);
    }
    box[0] = behind ? 0 : (int)fmax(0, floor(x0));
    box[1] = behind ? 0 : (int)fmax(0, floor(y0));
    box[2] = behind ? w : (int)fmax(box[0], fmin(w, ceil(x1)));
    box[3] = behind ? h : (int)fmax(box[1], fmin(h, ceil(y1)));
}

double light_at(const struct light *l, struct vec3 at_m, struct vec3 *wi)
{
    if (l->is_far) {
        *wi = l->at;
        return l->power;
    }
    const struct vec3 way = v3_sub(l->at, at_m);
    const double square = v3_dot(way, way);
    *wi = v3_scale(1 / sqrt(square), way);
    return l->power / square;
}
