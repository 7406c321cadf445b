// wnodes.c - polynomials in w through Gauss-Legendre nodes.
#include "process/wnodes.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

static const double pi = 3.14159265358979323846;

// P_n(x) and its derivative by the three-term recurrence.
static double legendre(int n, double x, double *slope)
{
    double before = 1, now = x;
    for (int k = 2; k <= n; k++) {
        const double next = ((2 * k - 1) * x * now - (k - 1) * before) / k;
        before = now;
        now = next;
    }
    *slope = n * (x * now - before) / (x * x - 1);
    return now;
}

void wnodes_init(struct wnodes *q, int n, double lo, double hi)
{
    *q = (struct wnodes){.n = n, .lo = lo, .hi = hi};
    q->w = xcalloc((size_t)n, sizeof *q->w);
    q->weight = xcalloc((size_t)n, sizeof *q->weight);
    q->bary = xcalloc((size_t)n, sizeof *q->bary);
    for (int k = 0; k < n; k++) {
        double x = -cos(pi * (k + 0.75) / (n + 0.5)), slope; // Tricomi's start
        for (int step = 0; step < 8; step++)
            x -= legendre(n, x, &slope) / slope;
        legendre(n, x, &slope);
        q->w[k] = lo + 0.5 * (hi - lo) * (1 + x);
        q->weight[k] = 1 / ((1 - x * x) * slope * slope);
        q->bary[k] = (k % 2 ? -1 : 1) * sqrt((1 - x * x) * q->weight[k]); // Wang & Xiang 2012
    }
}

void wnodes_finish(struct wnodes *q)
{
    free(q->w);
    free(q->weight);
    free(q->bary);
    *q = (struct wnodes){0};
}

void wnodes_at(const struct wnodes *q, double w, double *row)
{
    double sum = 0;
    for (int k = 0; k < q->n; k++) {
        if (w == q->w[k]) {
            for (int m = 0; m < q->n; m++)
                row[m] = m == k;
            return;
        }
        sum += row[k] = q->bary[k] / (w - q->w[k]);
    }
    for (int k = 0; k < q->n; k++)
        row[k] /= sum;
}

void wnodes_chebyshev(const struct wnodes *q, double *c)
{
    const int n = q->n;
    double *row = xcalloc((size_t)n, sizeof *row);
    for (int k = 0; k < n * n; k++)
        c[k] = 0;
    for (int i = 0; i < n; i++) { // cosine transform of the values at the Chebyshev points
        const double angle = pi * (i + 0.5) / n;
        wnodes_at(q, q->lo + 0.5 * (q->hi - q->lo) * (1 + cos(angle)), row);
        for (int m = 0; m < n; m++) {
            const double share = (m ? 2.0 : 1.0) / n * cos(m * angle);
            for (int k = 0; k < n; k++)
                c[m * n + k] += share * row[k];
        }
    }
    free(row);
}
