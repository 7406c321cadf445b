// lp_middle.c - a few pixels around the centre, where rays are too short to be worth while.
#define _GNU_SOURCE
#include "core/mem.h"
#include "process/lp_ring.h"
#include <math.h>
#include <stdlib.h>

enum { RIM = 12 }; // samples beyond a_high: 3 to read, 9 for the spline fit

bool lp_middle_init(struct lp_middle *m, const struct lp_kernel *k, double a_high, double spacing,
                    bool symmetric, struct err *e)
{
    const int half = (int)ceil(a_high / spacing) + RIM, n = 2 * half + 1;
    struct lp_middle got = {
        .a_high = a_high, .symmetric = symmetric, .per_px = 1 / spacing, .n = n, .middle = half};
    if (!lp_taps_init(&got.taps, k, fmin(spacing / (a_high * lp_kernel_growth(k)), 0.25), 0, e))
        return false;
    got.coef = sample_alloc((size_t)n * (size_t)n * 3, sizeof *got.coef, "table", e);
    if (!got.coef) {
        lp_middle_finish(&got);
        return false;
    }
    *m = got;
    return true;
}

void lp_middle_row(struct lp_middle *m, const struct lp_source *s, int j)
{
    const struct lp_taps *t = &m->taps;
    for (int i = 0; i < m->n; i++) {
        double sum[3] = {0};
        for (int q = 0; q < t->n; q++) {
            const double grow = exp((t->first + q) * t->step) / m->per_px;
            const double x = (i - m->middle) * grow, y = (j - m->middle) * grow;
            double l = lp_source_at(s, x, y);
            if (m->symmetric)
                l = 0.5 * (l + lp_source_at(s, -x, -y));
            for (int c = 0; c < 3; c++)
                sum[c] += (double)t->tap[q][c] * l;
        }
        for (int c = 0; c < 3; c++)
            m->coef[((size_t)j * 3 + (size_t)c) * (size_t)m->n + (size_t)i] = (float)sum[c];
    }
}

void lp_middle_finish(struct lp_middle *m)
{
    lp_taps_finish(&m->taps);
    free(m->coef);
    *m = (struct lp_middle){0};
}
