// lut_geometry.c - every cell between four pixels lays its light on the grid nodes it covers.
#define _GNU_SOURCE
#include "process/lut_geometry.h"
#include "core/mem.h"
#include "core/sort.h"
#include "process/lp_source.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct record {
    const struct image *im;
    int u, v, weight; // channels
};

static double at(const struct record *g, int channel, int i, int j)
{
    return g->im
        ->px[((size_t)j * (size_t)g->im->w + (size_t)i) * (size_t)g->im->nc + (size_t)channel];
}

static bool sees(const struct record *g, int i, int j)
{
    const double weight = at(g, g->weight, i, j);
    return isfinite(weight) && weight > 0 && isfinite(at(g, g->u, i, j)) &&
           isfinite(at(g, g->v, i, j));
}

static bool open_record(struct record *g, const struct image *im, const struct image *photo,
                        struct err *e)
{
    *g = (struct record){im, image_channel_index(im, "u"), image_channel_index(im, "v"),
                         image_channel_index(im, "weight")};
    if (g->u < 0 || g->v < 0 || g->weight < 0)
        return err_set(e, ERR_DATA, "not a geometry record: needs the channels u, v, w, weight");
    if (im->w != photo->w || im->h != photo->h)
        return err_set(e, ERR_DATA, "the geometry is %d x %d, the photograph %d x %d", im->w, im->h,
                       photo->w, photo->h);
    return true;
}

// The step of h that nine tenths of the pixels exceed, along rows and columns; 0: nothing seen.
static double pixel_step(const struct record *g)
{
    enum { PROBES = 100 };
    double step[2 * PROBES * PROBES];
    size_t n = 0;
    for (int q = 0; q < PROBES * PROBES; q++) {
        const int i = (int)((long)(q % PROBES) * (g->im->w - 1) / PROBES);
        const int j = (int)((long)(q / PROBES) * (g->im->h - 1) / PROBES);
        for (int d = 0; d < 2; d++)
            if (sees(g, i, j) && sees(g, i + d, j + !d))
                step[n++] = hypot(at(g, g->u, i + d, j + !d) - at(g, g->u, i, j),
                                  at(g, g->v, i + d, j + !d) - at(g, g->v, i, j));
    }
    sort_doubles(step, n);
    return n ? step[n / 10] : 0;
}

// The even grid while it fills: node (i, j) is h = ((i - middle), (j - middle)) step.
struct grid {
    int n, middle;
    double step;
    double *sum, *var; // [n][n]
    int *hits;
};

// (f, g) in the cell whose bilinear (u, v) is the wanted one: Newton from the middle.
static bool find_in_cell(const double u[4], const double v[4], double want_u, double want_v,
                         double *f, double *g)
{
    *f = *g = 0.5;
    for (int turn = 0; turn < 4; turn++) {
        const double a = *f, b = *g;
        const double du = (1 - a) * (1 - b) * u[0] + a * (1 - b) * u[1] + (1 - a) * b * u[2] +
                          a * b * u[3] - want_u;
        const double dv = (1 - a) * (1 - b) * v[0] + a * (1 - b) * v[1] + (1 - a) * b * v[2] +
                          a * b * v[3] - want_v;
        const double ua = (1 - b) * (u[1] - u[0]) + b * (u[3] - u[2]);
        const double ub = (1 - a) * (u[2] - u[0]) + a * (u[3] - u[1]);
        const double va = (1 - b) * (v[1] - v[0]) + b * (v[3] - v[2]);
        const double vb = (1 - a) * (v[2] - v[0]) + a * (v[3] - v[1]);
        const double det = ua * vb - ub * va;
        if (det == 0)
            return false;
        *f -= (vb * du - ub * dv) / det;
        *g -= (ua * dv - va * du) / det;
    }
    return *f > -1e-6 && *f < 1 + 1e-6 && *g > -1e-6 && *g < 1 + 1e-6;
}

static void lay_cell(const struct record *r, const struct lut_pattern *p,
                     const struct lp_source *source, int i, int j, struct grid *to)
{
    double u[4], v[4], box[4] = {INFINITY, -INFINITY, INFINITY, -INFINITY};
    for (int q = 0; q < 4; q++) {
        const int x = i + q % 2, y = j + q / 2;
        if (!sees(r, x, y) || (p->seen && !p->seen[(size_t)y * (size_t)p->w + (size_t)x]))
            return;
        u[q] = at(r, r->u, x, y) / to->step + to->middle;
        v[q] = at(r, r->v, x, y) / to->step + to->middle;
        box[0] = fmin(box[0], u[q]);
        box[1] = fmax(box[1], u[q]);
        box[2] = fmin(box[2], v[q]);
        box[3] = fmax(box[3], v[q]);
    }
    if (box[1] - box[0] > 50 || box[3] - box[2] > 50) // a fold of the sample, not a cell
        return;
    const int first = (int)fmax(0, ceil(box[0] - 1e-6)), last = (int)fmin(to->n - 1, box[1] + 1e-6);
    for (int y = (int)fmax(0, ceil(box[2] - 1e-6)); y <= (int)fmin(to->n - 1, box[3] + 1e-6); y++)
        for (int x = first; x <= last; x++) {
            double f, g;
            if (!find_in_cell(u, v, x, y, &f, &g))
                continue;
            const size_t k = (size_t)y * (size_t)to->n + (size_t)x;
            to->sum[k] += lp_source_at(source, i + f, j + g);
            to->hits[k]++;
            if (p->variance) {
                const int nx = i + (f > 0.5), ny = j + (g > 0.5);
                to->var[k] += p->variance[(size_t)ny * (size_t)p->w + (size_t)nx];
            }
        }
}

// The photograph's channel (and its variance) times the weights.
static bool weigh(const struct image *photo, int channel, const struct record *g, double scale,
                  struct lut_pattern *p, struct err *e)
{
    if (!lut_pattern_init(p, photo, channel, scale, e))
        return false;
    for (int j = 0; j < p->h; j++)
        for (int i = 0; i < p->w; i++) {
            const size_t k = (size_t)j * (size_t)p->w + (size_t)i;
            const double w = sees(g, i, j) ? at(g, g->weight, i, j) : 1;
            p->px[k] = (float)(p->px[k] * w);
            if (p->variance)
                p->variance[k] = (float)(p->variance[k] * w * w);
        }
    return true;
}

// What nodes have received becomes a picture; nodes without are NaN.
static bool to_pattern(const struct grid *to, bool has_variance, struct lut_pattern *out,
                       struct err *e)
{
    struct image im;
    const int nc = has_variance ? 2 : 1;
    if (!image_init(&im, to->n, to->n, nc, e))
        return false;
    meta_set_text(&im.meta, "channels", has_variance ? "Y,var.Y" : "Y");
    const size_t count = (size_t)to->n * (size_t)to->n;
    for (size_t k = 0; k < count; k++) {
        im.px[k * (size_t)nc] = to->hits[k] ? (float)(to->sum[k] / to->hits[k]) : NAN;
        if (has_variance)
            im.px[k * 2 + 1] = to->hits[k] ? (float)(to->var[k] / to->hits[k] / to->hits[k]) : 0;
    }
    const bool ok = lut_pattern_init(out, &im, 0, 1, e);
    image_finish(&im);
    if (ok) {
        out->h_per_px = to->step;
        out->cx = out->cy = to->middle;
    }
    return ok;
}

bool lut_geometry(const struct image *photo, int channel, const struct image *geometry,
                  double scale, double reach, struct lut_pattern *out, struct err *e)
{
    struct record g;
    if (!open_record(&g, geometry, photo, e))
        return false;
    struct grid to = {.step = 0.8 * pixel_step(&g)}; // resampling must not blur
    if (!(to.step > 0))
        return err_set(e, ERR_DATA, "the geometry shows no pixel of the sample");
    double largest = 0;
    for (int j = 0; j < geometry->h; j++)
        for (int i = 0; i < geometry->w; i++)
            if (sees(&g, i, j))
                largest = fmax(largest, fmax(fabs(at(&g, g.u, i, j)), fabs(at(&g, g.v, i, j))));
    const double side = fmin(reach, largest);
    to.step = fmax(to.step, side / 4000);
    to.middle = (int)ceil(side / to.step) + 4;
    to.n = 2 * to.middle + 1;
    const size_t count = (size_t)to.n * (size_t)to.n;
    struct lut_pattern p = {0};
    struct lp_source source = {0};
    to.sum = sample_alloc(count, sizeof *to.sum, "pattern", e);
    to.var = to.sum ? sample_alloc(count, sizeof *to.var, "pattern", e) : NULL;
    to.hits = to.var ? sample_alloc(count, sizeof *to.hits, "pattern", e) : NULL;
    bool ok = to.hits && weigh(photo, channel, &g, scale, &p, e);
    const struct lp_picture picture = {p.px, p.w, p.h, 0, 0, NULL};
    ok = ok && lp_source_init(&source, &picture, e);
    for (int j = 0; ok && j < photo->h - 1; j++) // in order: the same sums on any machine
        for (int i = 0; i < photo->w - 1; i++)
            lay_cell(&g, &p, &source, i, j, &to);
    ok = ok && to_pattern(&to, p.variance != NULL, out, e);
    lp_source_finish(&source);
    lut_pattern_finish(&p);
    free(to.sum);
    free(to.var);
    free(to.hits);
    return ok;
}
