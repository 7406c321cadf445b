// lobe.c - the light by the specular lobes of a flat sample in several poses.
//
// The lobe is brightest where the half vector is the normal. Around it the logarithm of the light,
// freed of G and the fall-off, is a quadratic in (u, v); its top must be at 0 in every pose. That
// gives two equations a pose for the three coordinates of the light, solved by Gauss-Newton.
#define _GNU_SOURCE
#include "calib/bundle.h"
#include "calib/light.h"
#include "calib/normal.h"
#include "core/mem.h"
#include "core/sort.h"
#include <stdlib.h>
#include <string.h>

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

// What frees the light of G and of the fall-off.
static double weight_of(const struct glance *g, const struct plane *p, struct vec3 light)
{
    const struct vec3 to = v3_sub(light, g->x);
    const double w = v3_dot(v3_add(g->wi, g->wo), p->f.n);
    return v3_dot(g->wo, p->f.n) * v3_dot(to, to) * w * w / pow(1 + v3_dot(g->wi, g->wo), 2);
}

// The pixel where the lobe is brightest over h, were the light at `light`.
static bool top_of(const struct lens *l, const struct plane *p, struct vec3 light,
                   const float *picture, const struct lobe *b, struct glint *out)
{
    static const int all[6] = {0, 1, 2, 3, 4, 5};
    const int w = l->head.w;
    struct glance g, right, down;
    struct normal n;
    struct err ignored;
    double c[6], inverse[6];
    if (!glance_at(l, p, light, b->x, b->y, &g) ||
        !glance_at(l, p, light, b->x + 1, b->y, &right) ||
        !glance_at(l, p, light, b->x, b->y + 1, &down))
        return false;
    const double u0 = g.u, v0 = g.v;
    out->i = b->x;
    out->j = b->y;
    out->sigma_h = 1e-5;
    normal_init(&n, 6);
    for (int j = b->top; j <= b->bottom; j++)
        for (int i = b->left; i <= b->right; i++) {
            const double s = light_at(picture, w, i, j) - b->floor;
            if (!(s > 0.3 * (b->peak - b->floor)) || !glance_at(l, p, light, i, j, &g))
                continue;
            const double u = (g.u - u0) * 1e2, v = (g.v - v0) * 1e2;
            normal_add(&n, 6, all, (double[]){1, u, v, u * u, u * v, v * v},
                       log(s * weight_of(&g, p, light)), s * s);
        }
    const bool ok = n.count >= 12 && normal_solve(&n, c, inverse, &ignored);
    normal_finish(&n);
    const double det = ok ? 4 * c[3] * c[5] - c[4] * c[4] : 0;
    if (ok && c[3] < 0 && det > 0) { // else few pixels: a mirror, whose middle is as good
        const double u = 1e-2 * (c[4] * c[2] - 2 * c[5] * c[1]) / det;
        const double v = 1e-2 * (c[4] * c[1] - 2 * c[3] * c[2]) / det;
        const double ui = right.u - u0, vi = right.v - v0, uj = down.u - u0, vj = down.v - v0;
        out->i += (vj * u - uj * v) / (ui * vj - uj * vi);
        out->j += (ui * v - vi * u) / (ui * vj - uj * vi);
    }
    return true;
}

bool light_lobes(struct light *out, const struct lens *lens, const int *view,
                 const float *const *light, int n, struct err *e)
{
    struct lobe *lobe = xcalloc((size_t)n, sizeof *lobe);
    struct line *line = xcalloc((size_t)n, sizeof *line);
    struct glint *glint = xcalloc((size_t)n, sizeof *glint);
    struct lens l = lens_copy(lens);
    struct light s;
    double rms_h = 0;
    bool ok = true;
    for (int k = 0; ok && k < n; k++) {
        ok = find_lobe(light[k], l.head.w, l.head.h, &lobe[k], e) || err_in(e, "picture %d", k + 1);
        const struct plane p = lens_plane(&l, view[k]);
        const struct vec3 ray = lens_ray(&l, lobe[k].x, lobe[k].y);
        const double far = v3_dot(p.origin_m, p.f.n) / v3_dot(ray, p.f.n);
        line[k] =
            (struct line){v3_scale(far, ray), v3_sub(ray, v3_scale(2 * v3_dot(ray, p.f.n), p.f.n))};
    }
    ok = ok && light_from_lines(&s, line, n, e);
    struct vec3 at = ok ? v3(s.position_m[0], s.position_m[1], s.position_m[2]) : v3(0, 0, 0);
    for (int turn = 0; ok && turn < 4; turn++) {
        for (int k = 0; ok && k < n; k++) {
            const struct plane p = lens_plane(&l, view[k]);
            glint[k].view = view[k];
            ok = top_of(&l, &p, at, light[k], &lobe[k], &glint[k]) ||
                 err_set(e, ERR_DATA, "the light is not before the sample");
        }
        ok = ok && bundle_adjust(&l, glint, n, &at, s.sigma_m, &rms_h, e);
    }
    if (ok) {
        memcpy(s.position_m, &at, sizeof s.position_m);
        s.head.residual = rms_h * v3_norm(v3_sub(at, line[0].from_m));
        *out = s;
    }
    lens_finish(&l);
    free(lobe);
    free(line);
    free(glint);
    return ok;
}
