// lobe.c - the light by the specular lobes of a flat sample in several poses.
//
// The lobe is brightest where the half vector is the normal. Around it the logarithm of the light,
// freed of G and the fall-off, is a quadratic in (u, v); its top must be at 0 in every pose. That
// gives two equations a pose for the three coordinates of the light, solved by Gauss-Newton.
#define _GNU_SOURCE
#include "calib/light.h"
#include "calib/normal.h"
#include "core/mem.h"
#include "core/sort.h"
#include <stdlib.h>

struct lobe {
    int left, right, top, bottom; // px, a box about it
    double floor, peak;
    double x, y; // its middle in the picture
};

static double light_at(const float *light, int w, int i, int j)
{
    return (double)light[(size_t)j * (size_t)w + (size_t)i];
}

static double median_of(const float *light, size_t n)
{
    enum { MOST = 10000 };
    float probe[MOST];
    return (double)probe[sorted_probe(light, n, probe, MOST) / 2];
}

// The box about the brightest place, out to where rows and columns through it fall to a third.
static bool find_lobe(const float *light, int w, int h, struct lobe *b, struct err *e)
{
    int x = 0, y = 0;
    *b = (struct lobe){.floor = median_of(light, (size_t)w * (size_t)h)};
    for (int j = 1; j < h - 1; j++)
        for (int i = 1; i < w - 1; i++) {
            double sum = 0; // of nine: a hot pixel is no lobe
            for (int q = 0; q < 9; q++)
                sum += light_at(light, w, i - 1 + q % 3, j - 1 + q / 3);
            if (sum / 9 > b->peak) {
                b->peak = sum / 9;
                x = i;
                y = j;
            }
        }
    const double level = b->floor + 0.3 * (b->peak - b->floor);
    b->left = b->right = x;
    b->top = b->bottom = y;
    while (b->left > 0 && light_at(light, w, b->left - 1, y) > level)
        b->left--;
    while (b->right < w - 1 && light_at(light, w, b->right + 1, y) > level)
        b->right++;
    while (b->top > 0 && light_at(light, w, x, b->top - 1) > level)
        b->top--;
    while (b->bottom < h - 1 && light_at(light, w, x, b->bottom + 1) > level)
        b->bottom++;
    if (!(b->peak > b->floor))
        return err_set(e, ERR_DATA, "no lobe is seen");
    if (b->left == 0 || b->top == 0 || b->right == w - 1 || b->bottom == h - 1)
        return err_set(e, ERR_DATA, "the lobe is cut off by the picture's border");
    if (b->right - b->left > w / 2 || b->bottom - b->top > h / 2)
        return err_set(e, ERR_DATA, "the brightest place is too wide for a specular lobe");
    double sum = 0, moment[2] = {0};
    for (int j = b->top; j <= b->bottom; j++)
        for (int i = b->left; i <= b->right; i++) {
            const double s = fmax(0, light_at(light, w, i, j) - level);
            sum += s;
            moment[0] += s * i;
            moment[1] += s * j;
        }
    b->x = sum > 0 ? moment[0] / sum : x;
    b->y = sum > 0 ? moment[1] / sum : y;
    return true;
}

struct glance {
    struct vec3 x, wi, wo;
    double u, v, weight; // weight: what frees the light of G and the fall-off
};

static bool glance_at(const struct lens *l, const struct plane *p, struct vec3 light, double i,
                      double j, struct glance *g)
{
    const struct vec3 ray = lens_ray(l, i, j);
    const double far = v3_dot(p->origin_m, p->f.n) / v3_dot(ray, p->f.n);
    g->x = v3_scale(far, ray);
    g->wo = v3_scale(-1, ray);
    const struct vec3 to = v3_sub(light, g->x);
    g->wi = v3_unit(to);
    const struct vec3 h = v3_add(g->wi, g->wo);
    const double cos_i = v3_dot(g->wi, p->f.n), cos_o = v3_dot(g->wo, p->f.n);
    g->u = v3_dot(h, p->f.t);
    g->v = v3_dot(h, p->f.b);
    g->weight = cos_o * v3_dot(to, to) / pow(1 + v3_dot(g->wi, g->wo), 2);
    return far > 0 && cos_i > 0 && cos_o > 0;
}

// Where the lobe is brightest, in h, were the light at `light`.
static bool top_of(const struct lens *l, const struct plane *p, struct vec3 light,
                   const float *picture, const struct lobe *b, double out[2])
{
    static const int all[6] = {0, 1, 2, 3, 4, 5};
    const int w = l->head.w;
    struct glance g;
    struct normal n;
    struct err ignored;
    double c[6];
    int used = 0;
    if (!glance_at(l, p, light, b->x, b->y, &g))
        return false;
    const double u0 = g.u, v0 = g.v;
    out[0] = u0;
    out[1] = v0;
    normal_init(&n, 6);
    for (int j = b->top; j <= b->bottom; j++)
        for (int i = b->left; i <= b->right; i++) {
            const double s = light_at(picture, w, i, j) - b->floor;
            if (!(s > 0.3 * (b->peak - b->floor)) || !glance_at(l, p, light, i, j, &g))
                continue;
            const double u = (g.u - u0) * 1e2, v = (g.v - v0) * 1e2;
            normal_add(&n, 6, all, (double[]){1, u, v, u * u, u * v, v * v}, log(s * g.weight),
                       s * s);
            used++;
        }
    const bool ok = used >= 12 && normal_solve(&n, c, NULL, &ignored);
    normal_finish(&n);
    const double det = ok ? 4 * c[3] * c[5] - c[4] * c[4] : 0;
    if (ok && c[3] < 0 && det > 0) { // else few pixels: a mirror, whose middle is as good
        out[0] += 1e-2 * (c[4] * c[2] - 2 * c[5] * c[1]) / det;
        out[1] += 1e-2 * (c[4] * c[1] - 2 * c[3] * c[2]) / det;
    }
    return true;
}

// One step of Gauss-Newton; the squares of the tops before it.
static bool step(const struct lens *l, const struct plane *plane, const float *const *light,
                 const struct lobe *lobe, int n, struct light *s, double *square, struct err *e)
{
    struct normal sums;
    double by[3], inverse[3];
    const struct vec3 at = v3(s->position_m[0], s->position_m[1], s->position_m[2]);
    normal_init(&sums, 3);
    *square = 0;
    bool ok = true;
    for (int k = 0; ok && k < n; k++) {
        struct glance g;
        double top[2];
        ok = (glance_at(l, &plane[k], at, lobe[k].x, lobe[k].y, &g) &&
              top_of(l, &plane[k], at, light[k], &lobe[k], top)) ||
             err_set(e, ERR_DATA, "the light is not before the sample");
        for (int q = 0; ok && q < 2; q++) {
            const struct vec3 axis = q ? plane[k].f.b : plane[k].f.t;
            const struct vec3 d = v3_scale(1 / v3_norm(v3_sub(at, g.x)),
                                           v3_sub(axis, v3_scale(v3_dot(axis, g.wi), g.wi)));
            normal_add(&sums, 3, (int[]){0, 1, 2}, (double[]){d.x, d.y, d.z}, -top[q], 1);
            *square += top[q] * top[q];
        }
    }
    ok = ok && normal_solve(&sums, by, inverse, e);
    normal_finish(&sums);
    for (int k = 0; ok && k < 3; k++) {
        s->position_m[k] += by[k];
        s->sigma_m[k] = sqrt(*square / (2 * n - 3) * inverse[k]);
    }
    return ok;
}

bool light_lobes(struct light *out, const struct lens *l, const struct plane *plane,
                 const float *const *light, int n, struct err *e)
{
    struct lobe *lobe = xcalloc((size_t)n, sizeof *lobe);
    struct line *line = xcalloc((size_t)n, sizeof *line);
    struct light s;
    bool ok = true;
    for (int k = 0; ok && k < n; k++) {
        ok = find_lobe(light[k], l->head.w, l->head.h, &lobe[k], e) ||
             err_in(e, "picture %d", k + 1);
        const struct vec3 ray = lens_ray(l, lobe[k].x, lobe[k].y), m = plane[k].f.n;
        const double far = v3_dot(plane[k].origin_m, m) / v3_dot(ray, m);
        line[k] = (struct line){v3_scale(far, ray), v3_sub(ray, v3_scale(2 * v3_dot(ray, m), m))};
    }
    ok = ok && light_from_lines(&s, line, n, e);
    double square = 0;
    for (int turn = 0; ok && turn < 12; turn++)
        ok = step(l, plane, light, lobe, n, &s, &square, e);
    if (ok) {
        const struct vec3 at = v3(s.position_m[0], s.position_m[1], s.position_m[2]);
        s.head.residual = sqrt(square / n) * v3_norm(v3_sub(at, line[0].from_m));
        *out = s;
    }
    free(lobe);
    free(line);
    return ok;
}
