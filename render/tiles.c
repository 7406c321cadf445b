// tiles.c - bounds on where shapes lie and on how half vectors change over a square of pixels.
#define _GNU_SOURCE
#include "render/tiles.h"
#include "core/mem.h"
#include <stdlib.h>
#include <string.h>

// The rays of a square's corners and centre (last), in the shape's coordinates.
struct square {
    struct vec3 dir[5];
};

static struct square rays_of(const struct scene *s, const struct shape *shape, const struct tile *t,
                             int w, int h)
{
    const double x[5] = {t->x0, t->x1, t->x0, t->x1, (t->x0 + t->x1) / 2};
    const double y[5] = {t->y0, t->y0, t->y1, t->y1, (t->y0 + t->y1) / 2};
    struct square q;
    for (int k = 0; k < 5; k++) {
        struct vec3 dir;
        camera_ray(&s->camera, x[k] - .5, y[k] - .5, w, h, &dir);
        q.dir[k] = frame_local(&shape->frame, dir);
    }
    return q;
}

// A flat shape is missed where the square's quadrangle in its plane lies outside.
static bool misses_flat(const struct shape *s, struct vec3 eye, const struct square *q)
{
    double x0 = INFINITY, x1 = -INFINITY, y0 = INFINITY, y1 = -INFINITY, r_most = 0;
    for (int k = 0; k < 4; k++) {
        if (q->dir[k].z >= 0 || eye.z <= 0)
            return eye.z <= 0; // from behind nothing is seen; near the horizon anything may be
        const struct vec3 p = v3_add(eye, v3_scale(-eye.z / q->dir[k].z, q->dir[k]));
        x0 = fmin(x0, p.x);
        x1 = fmax(x1, p.x);
        y0 = fmin(y0, p.y);
        y1 = fmax(y1, p.y);
        r_most = fmax(r_most, hypot(p.x, p.y));
    }
    if (s->kind == SHAPE_PLANE)
        return x0 > s->width_m / 2 || x1 < -s->width_m / 2 || y0 > s->height_m / 2 ||
               y1 < -s->height_m / 2;
    const double x = fmax(0, fmax(x0, -x1)), y = fmax(0, fmax(y0, -y1)); // nearest to the centre
    return hypot(x, y) > s->radius_m || r_most < s->inner_m;
}

// A nearer plane that fills the square hides what is flat behind it. Over a plane 1 / distance is
// linear in the picture, so the corners decide.
static bool hidden(const struct scene *s, const struct object *o, const struct square *q)
{
    for (int k = 0; k < s->n_objects; k++) {
        const struct object *other = &s->object[k];
        int behind = 0;
        for (int c = 0; c < 4 && other != o && other->shape.kind == SHAPE_PLANE; c++) {
            const struct vec3 dir = frame_world(&o->shape.frame, q->dir[c]);
            struct hit near;
            if (!shape_hit(&other->shape, s->camera.eye_m, dir, &near))
                break;
            const struct vec3 way = v3_sub(o->shape.at_m, s->camera.eye_m);
            const double toward = v3_dot(dir, o->shape.frame.n);
            const double far = v3_dot(way, o->shape.frame.n) / toward; // on its plane
            behind += toward >= 0 || far <= 0 || far > near.distance;
        }
        if (behind == 4)
            return true;
    }
    return false;
}

// The largest |u| and |v| at which the material diffracts.
static void reach(const struct material *m, double *u, double *v)
{
    *u = *v = 2;
    if (m->diffraction == DIFFRACTION_TABLE)
        *u = *v = m->table.range;
    if (m->diffraction == DIFFRACTION_SLITS && !m->slits.row[0].radial &&
        !slits_are_crossed(&m->slits))
        *v = 6 * m->slits.across;
}

// How far the surface extends from the middle hit over the square, and how fast its frame turns.
struct patch {
    struct hit middle;
    double size_m, turn; // turn: radians over size_m
    bool bounded;
};

static struct patch patch_of(const struct scene *s, const struct object *o, const struct square *q)
{
    struct patch p = {0};
    struct shape wide = o->shape; // a flat one beyond its edges too
    if (wide.kind == SHAPE_PLANE)
        wide.width_m = wide.height_m = 2 * SCENE_FAR_M;
    if (wide.kind == SHAPE_DISC) {
        wide.radius_m = SCENE_FAR_M;
        wide.inner_m = 0;
    }
    if (wide.kind == SHAPE_MESH ||
        !shape_hit(&wide, s->camera.eye_m, frame_world(&wide.frame, q->dir[4]), &p.middle))
        return p;
    for (int k = 0; k < 4; k++) {
        struct hit h;
        if (!shape_hit(&wide, s->camera.eye_m, frame_world(&wide.frame, q->dir[k]), &h))
            return p;
        p.size_m = fmax(p.size_m, v3_norm(v3_sub(h.at_m, p.middle.at_m)));
    }
    if (wide.kind == SHAPE_CYLINDER || wide.kind == SHAPE_SPHERE) {
        p.size_m *= 1.5; // the chord from corner to centre is not the farthest way of all
        p.turn = 2 * p.size_m / wide.radius_m;
        const double pole = wide.kind == SHAPE_SPHERE
                                ? hypot(v3_dot(p.middle.frame.n, wide.frame.t),
                                        v3_dot(p.middle.frame.n, wide.frame.n)) *
                                      wide.radius_m
                                : INFINITY; // distance from the axis: t turns around the poles
        if (pole < 3 * p.size_m)
            return p;
        p.turn += 2 * p.size_m / pole;
    }
    if (wide.kind == SHAPE_DISC && !wide.fixed_tangent) {
        const double r = v3_norm(v3_sub(p.middle.at_m, wide.at_m));
        if (r < 2 * p.size_m)
            return p;
        p.turn = p.size_m / (r - p.size_m);
    }
    p.bounded = true;
    return p;
}

// A unit vector to a point at distance d turns by at most size / (d - size).
static double swing(double distance_m, double size_m)
{
    return distance_m > 2 * size_m ? size_m / (distance_m - size_m) : 2;
}

static bool can_reach(const struct scene *s, const struct patch *p, struct vec3 wi, double swing_i,
                      double u_most, double v_most)
{
    const struct vec3 way = v3_sub(s->camera.eye_m, p->middle.at_m);
    const struct vec3 h = v3_add(wi, v3_unit(way));
    const double slack = swing_i + swing(v3_norm(way), p->size_m) + 2 * p->turn;
    return fabs(v3_dot(h, p->middle.frame.t)) <= u_most + slack &&
           fabs(v3_dot(h, p->middle.frame.b)) <= v_most + slack;
}

// Can any of the scene's own lights diffract there?
static bool near_diffract(const struct scene *s, const struct patch *p, double u, double v)
{
    for (int k = 0; k < s->n_lights; k++) {
        struct vec3 wi;
        light_at(&s->light[k], p->middle.at_m, &wi);
        const double d = v3_norm(v3_sub(s->light[k].at, p->middle.at_m));
        if (can_reach(s, p, wi, s->light[k].is_far ? 0 : swing(d, p->size_m), u, v))
            return true;
    }
    return false;
}

// Decides about a square, and lists the environment's lights that matter there.
static bool diffracts(struct tiles *t, const struct scene *s, const struct object *o,
                      const struct square *q, struct tile *tile)
{
    const struct material *m = &o->material;
    int all;
    const struct surround_light *far = scene_far_lights(s, o, &all);
    if (!object_uses_far_lights(o))
        all = 0;
    const bool glossy = material_has_specular(m);
    double u, v;
    tile->first = 0;
    tile->count = glossy || m->diffraction != DIFFRACTION_NONE ? all : 0;
    if (m->diffraction == DIFFRACTION_NONE)
        return false;
    reach(m, &u, &v);
    const struct patch p = patch_of(s, o, q);
    if (!p.bounded || m->diffraction == DIFFRACTION_STAM)
        return true;
    const bool by_far = all && !object_shows_map(o);
    bool any = near_diffract(s, &p, u, v);
    const int first = t->n_far;
    for (int k = 0; k < all && by_far; k++)
        if (can_reach(s, &p, far[k].to, 0, u, v))
            t->far[t->n_far++] = (unsigned char)k;
    any = any || t->n_far > first || (s->surround && object_has_lobes(o));
    if (glossy) { // every light matters
        t->n_far = first;
    } else {
        tile->first = first;
        tile->count = t->n_far - first;
    }
    return any;
}

void tiles_find(struct tiles *t, const struct scene *s, const struct object *o, int w, int h)
{
    int box[4];
    shape_pixels(&s->camera, &o->shape, w, h, box);
    if (t->whole)
        memcpy(box, (const int[]){0, 0, w, h}, sizeof box);
    const int nx = (box[2] - box[0] + TILE_SIDE - 1) / TILE_SIDE;
    const int ny = (box[3] - box[1] + TILE_SIDE - 1) / TILE_SIDE;
    const size_t most = (size_t)nx * (size_t)ny;
    t->diffracting = xrealloc(t->diffracting, most + 1, sizeof *t->diffracting);
    t->plain = xrealloc(t->plain, most + 1, sizeof *t->plain);
    t->n_diffracting = t->n_plain = t->n_far = 0;
    int lights;
    scene_far_lights(s, o, &lights);
    t->far = xrealloc(t->far, (most + 1) * (size_t)(lights + 1), 1);
    while (t->n_far < lights) {
        t->far[t->n_far] = (unsigned char)t->n_far;
        t->n_far++;
    }
    const struct vec3 eye = frame_local(&o->shape.frame, v3_sub(s->camera.eye_m, o->shape.at_m));
    const bool flat = o->shape.kind == SHAPE_PLANE || o->shape.kind == SHAPE_DISC;
    for (int k = 0; k < nx * ny; k++) {
        const int x = box[0] + k % nx * TILE_SIDE, y = box[1] + k / nx * TILE_SIDE;
        struct tile tile = {(float)x,
                            (float)y,
                            (float)fmin(x + TILE_SIDE, box[2]),
                            (float)fmin(y + TILE_SIDE, box[3]),
                            0,
                            0};
        const struct square q = rays_of(s, &o->shape, &tile, w, h);
        if (flat && !t->whole && (misses_flat(&o->shape, eye, &q) || hidden(s, o, &q)))
            continue;
        bool full = diffracts(t, s, o, &q, &tile);
        if (t->whole) {
            full = o->material.diffraction != DIFFRACTION_NONE;
            tile.first = 0;
            tile.count = lights;
        }
        if (full)
            t->diffracting[t->n_diffracting++] = tile;
        else
            t->plain[t->n_plain++] = tile;
    }
}

void tiles_finish(struct tiles *t)
{
    free(t->diffracting);
    free(t->plain);
    free(t->far);
    *t = (struct tiles){0};
}
