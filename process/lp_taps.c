// lp_taps.c - kernels integrated against cardinal splines.
#define _GNU_SOURCE
#include "process/lp_taps.h"
#include "core/mem.h"
#include "process/bspline.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

enum { TAIL = 32 }; // reach of the filter from samples to coefficients: 0.431^32 = 2e-12

// A piece of a sequence of three channels: value[0] stands at index `first`.
struct run {
    int first, n;
    double (*value)[3]; // [n] owned
};

static struct run run_new(int first, int last)
{
    const int n = last - first + 1;
    return (struct run){first, n, xcalloc((size_t)n, sizeof(double[3]))};
}

// value[m] = sum over q of weight[q] beta(s[q] / step - m)
static struct run moments(const struct lp_kernel *k, double step)
{
    double low = INFINITY, high = -INFINITY;
    for (int q = 0; q < k->n; q++) {
        low = fmin(low, k->s[q] / step);
        high = fmax(high, k->s[q] / step);
    }
    struct run b = run_new((int)floor(low) - 2, (int)floor(high) + 3);
    for (int q = 0; q < k->n; q++) {
        const double at = k->s[q] / step;
        const int i = (int)floor(at);
        for (int m = i - 2; m <= i + 3; m++) {
            const double beta = bspline_basis(BSPLINE_QUINTIC, at - m);
            for (int c = 0; c < 3; c++)
                b.value[m - b.first][c] += k->weight[q][c] * beta;
        }
    }
    return b;
}

// Replaces a by its correlation with a symmetric filter whose terms stand `spread` apart.
static void spread_out(struct run *a, const double *filter, int reach, int spread)
{
    struct run out = run_new(a->first - reach * spread, a->first + a->n - 1 + reach * spread);
    for (int m = 0; m < a->n; m++)
        for (int t = 0; t <= 2 * reach; t++)
            for (int c = 0; c < 3; c++)
                out.value[m + t * spread][c] += a->value[m][c] * filter[t];
    free(a->value);
    *a = out;
}

// From values to coefficients of the quintic spline through them, or from a kernel's moments to
// taps on samples: the inverse of the sampled basis is its own transpose.
static void refit(struct run *a, int spread)
{
    double impulse[2 * TAIL + 1] = {0};
    impulse[TAIL] = 1;
    bspline_fit_line(impulse, 2 * TAIL + 1, BSPLINE_QUINTIC);
    spread_out(a, impulse, TAIL, spread);
}

// Squared relative error of interpolating every stride-th value of y by a quintic spline.
static double stride_error(const struct run *y, int stride)
{
    const int n = (y->n - 1) / stride + 1;
    double *coef = xcalloc((size_t)n, sizeof *coef), error = 0, norm = 0;
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < n; i++)
            coef[i] = y->value[i * stride][c];
        bspline_fit_line(coef, n, BSPLINE_QUINTIC);
        for (int k = 0; k < y->n; k++) {
            const int i = k / stride;
            float w[6];
            bspline_weights_5((float)(k % stride) / (float)stride, w);
            double value = 0;
            for (int m = 0; m < 6; m++)
                if (i - 2 + m >= 0 && i - 2 + m < n)
                    value += coef[i - 2 + m] * (double)w[m];
            error += (value - y->value[k][c]) * (value - y->value[k][c]);
            norm += y->value[k][c] * y->value[k][c];
        }
    }
    free(coef);
    return norm > 0 ? error / norm : 0;
}

// The finest feature that samples resolve well is a bell of some 1.4 steps: moments (variance 1/2)
// smoothed by binomials (1 and 1/2). What the kernel makes of it must survive the stride.
static int pick_stride(const struct run *m, double tolerance)
{
    static const double four[5] = {1 / 16.0, 4 / 16.0, 6 / 16.0, 4 / 16.0, 1 / 16.0};
    static const double two[3] = {1 / 4.0, 2 / 4.0, 1 / 4.0};
    static const int strides[] = {16, 12, 8, 6, 5, 4, 3, 2, 1};
    struct run y = run_new(m->first - 48, m->first + m->n + 48); // room for a spline's ends
    for (int k = 0; k < m->n; k++)
        for (int c = 0; c < 3; c++)
            y.value[k + 48][c] = m->value[k][c];
    spread_out(&y, four, 2, 1);
    spread_out(&y, two, 1, 1);
    int k = 0;
    while (strides[k] > 1 && stride_error(&y, strides[k]) > tolerance * tolerance)
        k++;
    free(y.value);
    return strides[k];
}

// Cuts off both ends what is nothing beside a channel's largest tap.
static void trim(const struct run *h, int *low, int *high)
{
    double top[3] = {0};
    for (int m = 0; m < h->n; m++)
        for (int c = 0; c < 3; c++)
            top[c] = fmax(top[c], fabs(h->value[m][c]));
    *low = h->n;
    *high = -1;
    for (int m = 0; m < h->n; m++)
        for (int c = 0; c < 3; c++)
            if (fabs(h->value[m][c]) > 1e-8 * top[c]) {
                *low = m < *low ? m : *low;
                *high = m;
            }
    if (*high < 0) // a kernel of zeros
        *low = *high = 0;
}

double lp_kernel_growth(const struct lp_kernel *k)
{
    double s = k->s[0];
    for (int q = 1; q < k->n; q++)
        s = fmax(s, k->s[q]);
    return exp(s);
}

bool lp_taps_init(struct lp_taps *t, const struct lp_kernel *k, double step, double tolerance,
                  struct err *e)
{
    struct run h = moments(k, step);
    const int stride = tolerance > 0 ? pick_stride(&h, tolerance) : 1;
    refit(&h, 1);
    if (tolerance > 0)
        refit(&h, stride);
    int low, high;
    trim(&h, &low, &high);
    struct lp_taps got = {.step = step, .stride = stride, .first = h.first + low};
    got.n = high - low + 1;
    got.pad = 3 * stride;
    float(*tap)[3] = sample_alloc((size_t)(got.n + 2 * got.pad), sizeof *tap, "filter", e);
    for (int m = 0; tap && m < got.n; m++)
        for (int c = 0; c < 3; c++)
            tap[got.pad + m][c] = (float)h.value[low + m][c];
    free(h.value);
    if (!tap)
        return false;
    got.tap = tap + got.pad;
    *t = got;
    return true;
}

void lp_taps_finish(struct lp_taps *t)
{
    if (t->tap)
        free(t->tap - t->pad);
    *t = (struct lp_taps){0};
}
