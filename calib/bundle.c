// bundle.c - Gauss-Newton on corners and glints; the derivatives are differences.
#define _GNU_SOURCE
#include "calib/bundle.h"
#include "calib/normal.h"
#include "core/mem.h"
#include <stdlib.h>
#include <string.h>

enum { CAMERA = 9, POSE = 6, LIGHT = 3, MOST = CAMERA + POSE + LIGHT };

bool glance_at(const struct lens *l, const struct plane *p, struct vec3 light_m, double i, double j,
               struct glance *g)
{
    const struct vec3 ray = lens_ray(l, i, j);
    const double far = v3_dot(p->origin_m, p->f.n) / v3_dot(ray, p->f.n);
    g->x = v3_scale(far, ray);
    g->wo = v3_scale(-1, ray);
    g->wi = v3_unit(v3_sub(light_m, g->x));
    const struct vec3 h = v3_add(g->wi, g->wo);
    g->u = v3_dot(h, p->f.t);
    g->v = v3_dot(h, p->f.b);
    return far > 0 && v3_dot(g->wi, p->f.n) > 0 && v3_dot(g->wo, p->f.n) > 0;
}

static void turn(double r[9], int axis, double by_rad)
{
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    const double c = cos(by_rad), s = sin(by_rad);
    for (int k = 0; k < 3; k++) {
        const double ra = r[3 * a + k], rb = r[3 * b + k];
        r[3 * a + k] = c * ra - s * rb;
        r[3 * b + k] = s * ra + c * rb;
    }
}

struct rig {
    struct lens *lens;
    struct vec3 light_m;
};

// Changes one unknown of those that an observation in `view` has: the camera's, the pose's, the
// light's.
static void nudge(struct rig *r, int view, int unknown, double by)
{
    struct camera_fit *c = &r->lens->camera;
    struct view_fit *v = &r->lens->view[view].fit;
    double *const light[LIGHT] = {&r->light_m.x, &r->light_m.y, &r->light_m.z};
    if (unknown < 2)
        c->focal_px[unknown] += by;
    else if (unknown < 4)
        c->center_px[unknown - 2] += by;
    else if (unknown < CAMERA)
        c->distortion[unknown - 4] += by;
    else if (unknown < CAMERA + 3)
        turn(v->rotation, unknown - CAMERA, by);
    else if (unknown < CAMERA + POSE)
        v->origin_m[unknown - CAMERA - 3] += by;
    else
        *light[unknown - CAMERA - POSE] += by;
}

static void look_at_corner(const struct rig *r, int view, const void *corner, double out[2])
{
    lens_project(r->lens, lens_corner(r->lens, view, *(const int *)corner), &out[0], &out[1]);
}

static void look_at_glint(const struct rig *r, int view, const void *glint, double out[2])
{
    const struct glint *s = glint;
    const struct plane p = lens_plane(r->lens, view);
    struct glance g;
    glance_at(r->lens, &p, r->light_m, s->i, s->j, &g);
    out[0] = g.u;
    out[1] = g.v;
}

// Both numbers of an observation, which should be to[]; its derivatives by `unknowns` of MOST.
static double observe(struct rig *r, int view, const void *what, const double to[2], double sigma,
                      int unknowns, void (*look)(const struct rig *, int, const void *, double[2]),
                      struct normal *n)
{
    static const double step = 1e-5;
    double here[2], d[2][MOST];
    int at[MOST];
    look(r, view, what, here);
    for (int k = 0; k < unknowns; k++) {
        double fore[2], back[2];
        nudge(r, view, k, step);
        look(r, view, what, fore);
        nudge(r, view, k, -2 * step);
        look(r, view, what, back);
        nudge(r, view, k, step);
        for (int q = 0; q < 2; q++)
            d[q][k] = (fore[q] - back[q]) / (2 * step);
        at[k] = k < CAMERA ? k : k < CAMERA + POSE ? POSE * view + k : POSE * (r->lens->n - 1) + k;
    }
    for (int q = 0; q < 2; q++)
        normal_add(n, unknowns, at, d[q], to[q] - here[q], 1 / (sigma * sigma));
    return (to[0] - here[0]) * (to[0] - here[0]) + (to[1] - here[1]) * (to[1] - here[1]);
}

// An unknown that no corner tells stays as it is.
static void hold(struct normal *n, int unknown)
{
    normal_add(n, 1, &unknown, (double[]){1}, 0, 1e30);
}

// Of one coordinate, from what the corners miss.
static double corner_sigma(const struct lens *l)
{
    double square = 0;
    int count = -CAMERA;
    for (int v = 0; v < l->n; v++) {
        count += l->view[v].seen.n ? 2 * l->view[v].seen.n - POSE : 0;
        for (int k = 0; k < l->view[v].seen.n; k++) {
            const double miss_px = lens_miss(l, v, k);
            square += miss_px * miss_px;
        }
    }
    return fmax(1e-4, sqrt(square / fmax(1, count)));
}

static void observe_corners(struct rig *r, double sigma_px, struct normal *n)
{
    for (int v = 0; v < r->lens->n; v++)
        for (int k = 0; k < r->lens->view[v].seen.n; k++)
            observe(r, v, &k, r->lens->view[v].seen.px[k], sigma_px, CAMERA + POSE, look_at_corner,
                    n);
}

bool bundle_adjust(struct lens *l, const struct glint *glint, int n, struct vec3 *light_m,
                   double sigma_m[3], double *rms_h, struct err *e)
{
    const int all = CAMERA + POSE * l->n + LIGHT;
    struct rig r = {l, *light_m};
    double *step = xcalloc((size_t)all, sizeof *step),
           *inverse = xcalloc((size_t)all, sizeof *step);
    const double sigma_px = corner_sigma(l);
    bool free_lens = true, ok = true;
    for (int k = 0; k < n; k++)
        free_lens &= l->view[glint[k].view].seen.n > 0;

    for (int round = 0; ok && round < 8; round++) {
        struct normal sums;
        double square = 0;
        normal_init(&sums, all);
        if (free_lens)
            observe_corners(&r, sigma_px, &sums);
        for (int k = 0; k < n; k++)
            square += observe(&r, glint[k].view, &glint[k], (double[]){0, 0}, glint[k].sigma_h,
                              MOST, look_at_glint, &sums);
        *rms_h = sqrt(square / n);
        if (!free_lens || !(l->camera.distortion_sigma[4] > 0))
            hold(&sums, CAMERA - 1);
        for (int k = 0; k < CAMERA + POSE * l->n; k++)
            if (!free_lens || (k >= CAMERA && !l->view[(k - CAMERA) / POSE].seen.n))
                hold(&sums, k);
        ok = normal_solve(&sums, step, inverse, e);
        normal_finish(&sums);
        for (int k = 0; ok && k < CAMERA; k++)
            nudge(&r, 0, k, step[k]);
        for (int v = 0; ok && v < l->n; v++)
            for (int k = 0; k < POSE; k++)
                nudge(&r, v, CAMERA + k, step[CAMERA + POSE * v + k]);
        for (int k = 0; ok && k < LIGHT; k++)
            nudge(&r, 0, CAMERA + POSE + k, step[all - LIGHT + k]);
    }
    for (int k = 0; ok && k < LIGHT; k++)
        sigma_m[k] = sqrt(inverse[all - LIGHT + k]);
    if (ok)
        *light_m = r.light_m;
    free(step);
    free(inverse);
    return ok;
}
