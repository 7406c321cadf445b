// lut_cover.c - which nodes the photograph speaks for.
#define _GNU_SOURCE
#include "core/mem.h"
#include "process/lut_kernel.h"
#include <math.h>
#include <stdlib.h>

// The frame is convex and holds the centre, so a node's band leaves it at its far end or not at
// all.
// Returns the nodes that are covered.
static long cover_frame(const struct lut_pattern *p, double grow, const double *x, struct table *t)
{
    uint8_t *column = xcalloc((size_t)t->n, 1), *row = xcalloc((size_t)t->n, 1);
    for (int i = 0; i < t->n; i++) {
        const double at_x = p->cx + x[i] * grow, at_y = p->cy + x[i] * grow;
        column[i] = at_x >= -0.5 && at_x <= p->w - 0.5;
        row[i] = at_y >= -0.5 && at_y <= p->h - 0.5;
    }
    long seen = 0;
#pragma omp parallel for reduction(+ : seen)
    for (int j = 0; j < t->n; j++)
        for (int i = 0; i < t->n; i++) {
            t->cover[(size_t)j * (size_t)t->n + (size_t)i] = row[j] & column[i];
            seen += row[j] & column[i];
        }
    free(column);
    free(row);
    return seen;
}

// 1 where a pixel or a neighbour was not measured.
static float *unseen_picture(const struct lut_pattern *p, struct err *e)
{
    float *px = sample_alloc((size_t)p->w * (size_t)p->h, sizeof *px, "mask", e);
    for (int j = 0; px && j < p->h; j++)
        for (int i = 0; i < p->w; i++)
            for (int y = j > 0 ? j - 1 : 0; y <= j + 1 && y < p->h; y++)
                for (int x = i > 0 ? i - 1 : 0; x <= i + 1 && x < p->w; x++)
                    if (!p->seen[(size_t)y * (size_t)p->w + (size_t)x])
                        px[(size_t)j * (size_t)p->w + (size_t)i] = 1;
    return px;
}

// How much of a node's band is not seen is itself a sum over scalings, of the mask. One pixel on
// the ray at distance a is 1/a of it; half of that marks the node.
static bool cover_holes(const struct lut_pattern *p, double low, double high, const double *x,
                        struct table *t, long *seen, struct err *e)
{
    enum { LINES = 4000 };
    const size_t n = (size_t)t->n;
    float *mask = unseen_picture(p, e);
    float *amount = mask ? sample_alloc(n * n * 3, sizeof *amount, "mask", e) : NULL;
    bool ok = amount != NULL;
    if (ok) {
        struct lp_kernel k = {LINES, xcalloc(LINES, sizeof(double)),
                              xcalloc(LINES, sizeof(double[3]))};
        const double step = (high - low) / (LINES - 1);
        for (int q = 0; q < LINES; q++) {
            k.s[q] = low + q * step;
            k.weight[q][0] = step;
        }
        const struct lp_picture picture = {mask, p->w, p->h, p->cx, p->cy, NULL};
        const struct lp_nodes nodes = {.n = t->n, .x = x};
        struct lp_stats stats;
        ok = lp_correlate(&picture, &k, &nodes, 1, 1e-2, amount, &stats, e);
        lut_kernel_finish(&k);
    }
    for (int j = 0; j < t->n; j++)
        for (int i = 0; ok && i < t->n; i++) {
            const double far = fmax(fabs(x[i]), fabs(x[j])) * exp(high);
            float *cover = &t->cover[(size_t)j * n + (size_t)i];
            if (*cover > 0 &&
                amount[((size_t)j * n + (size_t)i) * 3] > 0.5 * fmin(1 / far, high - low)) {
                *cover = 0;
                --*seen;
            }
        }
    free(mask);
    free(amount);
    return ok;
}

bool lut_cover(const struct lut_pattern *p, const struct lp_kernel *k, struct table *t,
               double *uncovered, struct err *e)
{
    const size_t count = (size_t)t->n * (size_t)t->n;
    double low = INFINITY, high = -INFINITY;
    for (int q = 0; q < k->n; q++) {
        low = fmin(low, k->s[q]);
        high = fmax(high, k->s[q]);
    }
    if (!(t->cover = sample_alloc(count, sizeof *t->cover, "coverage", e)))
        return false;
    double *x = lut_node_px(t, p);
    long seen = cover_frame(p, exp(high), x, t);
    const bool ok = !p->seen || cover_holes(p, low, high, x, t, &seen, e);
    free(x);
    *uncovered = 1 - (double)seen / (double)count;
    return ok;
}
