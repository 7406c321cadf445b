// scene.c - cameras, lights, and the life of a scene.
#define _GNU_SOURCE
#include "render/scene.h"
#include <stdlib.h>

void scene_finish(struct scene *s)
{
    if (!s)
        return;
    for (int k = 0; k < s->n_objects; k++) {
        material_finish(&s->object[k].material);
        free(s->object[k].name);
    }
    free(s->object);
    free(s->light);
    free(s->path);
    *s = (struct scene){0};
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

void camera_ray(const struct camera *c, double x, double y, int w, int h, struct vec3 *dir)
{
    struct vec3 a[3];
    camera_axes(c, w, h, a);
    const double sx = 2 * (x + .5) / w - 1, sy = 1 - 2 * (y + .5) / h;
    *dir = v3_add(a[2], v3_add(v3_scale(sx, a[0]), v3_scale(sy, a[1])));
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
