// view_orbit.c - turns about the target, in the frame of the camera as the scene has it.
#define _GNU_SOURCE
#include "ui/view_orbit.h"

struct axes {
    struct vec3 right, up, back;
};

static struct axes axes_of(const struct camera *c)
{
    struct axes a;
    a.up = v3_unit(c->up);
    const struct vec3 back = v3_sub(c->eye_m, c->target_m);
    a.right = v3_unit(v3_cross(a.up, back));
    a.back = v3_cross(a.right, a.up);
    return a;
}

// Rotation about a unit axis (Rodrigues).
static struct vec3 turn(struct vec3 v, struct vec3 axis, double rad)
{
    const double c = cos(rad), s = sin(rad);
    return v3_add(v3_add(v3_scale(c, v), v3_scale(s, v3_cross(axis, v))),
                  v3_scale((1 - c) * v3_dot(axis, v), axis));
}

static struct vec3 turn_both(struct vec3 v, const struct axes *a, double yaw, double rise)
{
    return turn(turn(v, a->right, -rise), a->up, yaw);
}

struct camera orbit_camera(const struct camera *base, const struct params *p)
{
    const struct axes a = axes_of(base);
    const double yaw = p->v[PARAM_YAW], rise = p->v[PARAM_RISE];
    const struct vec3 out = v3_sub(base->eye_m, base->target_m);
    const double distance = v3_norm(out) * p->v[PARAM_DISTANCE];
    struct camera c = *base;
    const struct vec3 to_eye = v3_unit(turn_both(out, &a, yaw, rise));
    const struct vec3 right = turn(a.right, a.up, yaw), up = v3_cross(to_eye, right);
    const double high = 2 * tan(base->fov_rad / 2) * distance; // of the picture at the target
    c.target_m = v3_add(base->target_m, v3_add(v3_scale(-p->v[PARAM_PAN_X] * high, right),
                                               v3_scale(p->v[PARAM_PAN_Y] * high, up)));
    c.eye_m = v3_add(c.target_m, v3_scale(distance, to_eye));
    c.up = up;
    return c;
}

struct light orbit_light(const struct light *base, const struct camera *camera,
                         const struct params *p)
{
    const struct axes a = axes_of(camera);
    const double yaw = p->v[PARAM_LIGHT_YAW], rise = p->v[PARAM_LIGHT_PITCH];
    struct light l = *base;
    l.power *= exp2(p->v[PARAM_LIGHT_EV]);
    l.at = l.is_far
               ? turn_both(l.at, &a, yaw, rise)
               : v3_add(camera->target_m, turn_both(v3_sub(l.at, camera->target_m), &a, yaw, rise));
    return l;
}

void orbit_drag(struct params *p, double dx, double dy)
{
    param_set(p, PARAM_YAW, p->v[PARAM_YAW] - 3 * dx);
    param_set(p, PARAM_RISE, p->v[PARAM_RISE] + 3 * dy);
}

void orbit_drag_light(struct params *p, double dx, double dy)
{
    param_set(p, PARAM_LIGHT_YAW, p->v[PARAM_LIGHT_YAW] + dx);
    param_set(p, PARAM_LIGHT_PITCH, p->v[PARAM_LIGHT_PITCH] - dy);
}

void orbit_pan(struct params *p, double dx, double dy)
{
    param_set(p, PARAM_PAN_X, p->v[PARAM_PAN_X] + dx);
    param_set(p, PARAM_PAN_Y, p->v[PARAM_PAN_Y] + dy);
}

void orbit_zoom(struct params *p, double steps)
{
    param_set(p, PARAM_DISTANCE, p->v[PARAM_DISTANCE] * exp(-0.12 * steps));
}
