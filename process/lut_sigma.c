// lut_sigma.c - the noise of the pixels, carried to the table.
//
// A node is a sum over the pixels p along its ray with weights w_p, and its variance the sum of
// w_p^2 var_p. Along the ray a pixel at distance a (the larger of |x| and |y|) takes 1/a of ln a,
// whatever the direction: a slanted ray is longer, but shares its pixels with more neighbours. So
//     var S = integral K(s)^2 var(x e^s) / (a e^s) ds,
// the same kind of sum as S itself, of the picture var / a with the kernel K^2. Where a is so small
// that the whole band falls into one pixel, var / a stops growing.
#define _GNU_SOURCE
#include "core/mem.h"
#include "process/lut_kernel.h"
#include <math.h>
#include <stdlib.h>

// K^2 on equal steps. `width`: of K in s, as (integral Y)^2 / integral Y^2.
static struct lp_kernel square(const struct lp_kernel *k, bool is_rgb, double *width)
{
    const double step = 2e-3; // a pixel at a distance of 500
    double low = INFINITY, high = -INFINITY, sum = 0, sum2 = 0;
    for (int q = 0; q < k->n; q++) {
        low = fmin(low, k->s[q]);
        high = fmax(high, k->s[q]);
    }
    const int n = (int)((high - low) / step) + 2;
    struct lp_kernel sq = {n, xcalloc((size_t)n, sizeof(double)),
                           xcalloc((size_t)n, sizeof(double[3]))};
    for (int q = 0; q < k->n; q++) { // a line shares its weight between two steps
        const double at = (k->s[q] - low) / step, f = at - (int)at;
        for (int c = 0; c < 3; c++) {
            sq.weight[(int)at][c] += (1 - f) * k->weight[q][c];
            sq.weight[(int)at + 1][c] += f * k->weight[q][c];
        }
    }
    for (int m = 0; m < n; m++) {
        double *w = sq.weight[m];
        sq.s[m] = low + m * step;
        sum += w[1];
        sum2 += w[1] * w[1] / step;
        if (is_rgb)
            xyz_to_rgb(w, w);
        for (int c = 0; c < 3; c++)
            w[c] *= w[c] / step;
    }
    *width = sum * sum / sum2;
    return sq;
}

bool lut_sigma(const struct lut_pattern *p, const struct lp_kernel *k, bool averaged,
               struct table *t, struct err *e)
{
    const size_t count = (size_t)t->n * (size_t)t->n * 3;
    float *var = sample_alloc((size_t)p->w * (size_t)p->h, sizeof *var, "variance", e);
    if (!var || !(t->sigma = sample_alloc(count, sizeof *t->sigma, "variance", e))) {
        free(var);
        return false;
    }
    double width;
    struct lp_kernel sq = square(k, t->is_rgb, &width);
#pragma omp parallel for
    for (int j = 0; j < p->h; j++)
        for (int i = 0; i < p->w; i++) {
            const size_t at = (size_t)j * (size_t)p->w + (size_t)i;
            const double a = fmax(fabs(i - p->cx), fabs(j - p->cy));
            var[at] = (float)((double)p->variance[at] / hypot(a, 1 / width));
        }
    double *x = lut_node_px(t, p);
    const struct lp_picture picture = {var, p->w, p->h, p->cx, p->cy, NULL};
    const struct lp_nodes nodes = {.n = t->n, .x = x};
    struct lp_stats stats;
    const bool ok = lp_correlate(&picture, &sq, &nodes, 1, 1e-2, t->sigma, &stats, e);
#pragma omp parallel for
    for (size_t q = 0; q < count; q++)
        t->sigma[q] = sqrtf(fmaxf(t->sigma[q], 0) * (averaged ? 0.5f : 1));
    lut_kernel_finish(&sq);
    free(x);
    free(var);
    return ok;
}
