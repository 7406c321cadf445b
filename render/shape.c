// shape.c - rays against planes, discs, cylinders and spheres, in double.
#define _GNU_SOURCE
#include "render/shape.h"

void shape_finish(struct shape *s)
{
    if (s)
        mesh_finish(&s->mesh);
}

// Local position, tangent and normal of the hit; distance along the ray. False: none.
struct local_hit {
    double distance;
    struct vec3 at, t, n;
    double s, v;
};

static bool hit_flat(const struct shape *s, struct vec3 o, struct vec3 d, struct local_hit *l)
{
    if (d.z >= 0)
        return false;
    const double k = -o.z / d.z;
    const struct vec3 p = v3_add(o, v3_scale(k, d));
    const double r = hypot(p.x, p.y);
    if (s->kind == SHAPE_PLANE ? fabs(p.x) > s->width_m / 2 || fabs(p.y) > s->height_m / 2
                               : r > s->radius_m || r < s->inner_m)
        return false;
    const bool radial = s->kind == SHAPE_DISC && !s->fixed_tangent && r > 0;
    const double w = s->kind == SHAPE_PLANE ? s->width_m : 2 * s->radius_m;
    const double h = s->kind == SHAPE_PLANE ? s->height_m : 2 * s->radius_m;
    *l = (struct local_hit){
        k,           v3(p.x, p.y, 0), radial ? v3(p.x / r, p.y / r, 0) : v3(1, 0, 0),
        v3(0, 0, 1), p.x / w + .5,    p.y / h + .5};
    return k > 0;
}

// The entry of the ray o + k d into a sphere, or, with `round` 0 along y, into a cylinder.
static bool hit_round(const struct shape *s, struct vec3 o, struct vec3 d, struct local_hit *l)
{
    const bool sphere = s->kind == SHAPE_SPHERE;
    const double y = sphere ? 1 : 0;
    const double a = d.x * d.x + d.z * d.z + y * d.y * d.y;
    const double b = o.x * d.x + o.z * d.z + y * o.y * d.y;
    const double c = o.x * o.x + o.z * o.z + y * o.y * o.y - s->radius_m * s->radius_m;
    const double square = b * b - a * c;
    if (!(square > 0 && a > 0))
        return false;
    const double k = (-b - sqrt(square)) / a;
    const struct vec3 p = v3_add(o, v3_scale(k, d));
    const double around = atan2(p.x, p.z), r = hypot(p.x, p.z);
    if (k <= 0 || (!sphere && (fabs(p.y) > s->height_m / 2 || fabs(around) > s->span_rad / 2)))
        return false;
    const struct vec3 n = v3_scale(1 / s->radius_m, v3(p.x, y * p.y, p.z));
    const struct vec3 t = r > 0 ? v3(p.z / r, 0, -p.x / r) : v3(1, 0, 0);
    *l = (struct local_hit){k,
                            p,
                            t,
                            n,
                            around / (sphere ? 2 * M_PI : s->span_rad) + .5,
                            sphere ? asin(fmax(-1, fmin(1, n.y))) / M_PI + .5
                                   : p.y / s->height_m + .5};
    return true;
}

static bool hit_mesh(const struct shape *s, struct vec3 o, struct vec3 d, struct local_hit *l)
{
    struct mesh_hit h;
    struct frame f;
    if (!mesh_hit(&s->mesh, o, d, &h) || !frame_from(h.at.t, h.at.n, &f))
        return false;
    *l = (struct local_hit){h.distance, h.at.at_m, f.t, f.n, h.at.s, h.at.v};
    return true;
}

bool shape_hit(const struct shape *s, struct vec3 from, struct vec3 dir, struct hit *hit)
{
    const struct vec3 o = frame_local(&s->frame, v3_sub(from, s->at_m));
    const struct vec3 d = frame_local(&s->frame, dir);
    struct local_hit l;
    const bool flat = s->kind == SHAPE_PLANE || s->kind == SHAPE_DISC;
    if (!(s->kind == SHAPE_MESH ? hit_mesh(s, o, d, &l)
          : flat                ? hit_flat(s, o, d, &l)
                                : hit_round(s, o, d, &l)))
        return false;
    *hit = (struct hit){.distance = l.distance,
                        .at_m = v3_add(s->at_m, frame_world(&s->frame, l.at)),
                        .s = l.s,
                        .v = l.v};
    hit->frame.t = frame_world(&s->frame, l.t);
    hit->frame.n = frame_world(&s->frame, l.n);
    hit->frame.b = v3_cross(hit->frame.n, hit->frame.t);
    return true;
}

void shape_bounds(const struct shape *s, struct vec3 *lo, struct vec3 *hi)
{
    const double r = s->radius_m;
    switch (s->kind) {
    case SHAPE_PLANE: *hi = v3(s->width_m / 2, s->height_m / 2, 0); break;
    case SHAPE_DISC: *hi = v3(r, r, 0); break;
    case SHAPE_CYLINDER: *hi = v3(r, s->height_m / 2, r); break;
    case SHAPE_SPHERE: *hi = v3(r, r, r); break;
    case SHAPE_MESH:
        *lo = s->mesh.node[0].lo;
        *hi = s->mesh.node[0].hi;
        return;
    }
    *lo = v3_scale(-1, *hi);
}
