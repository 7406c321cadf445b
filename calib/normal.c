// normal.c - normal equations, Cholesky.
#include "calib/normal.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

void normal_init(struct normal *s, int n)
{
    *s = (struct normal){.n = n,
                         .a = xcalloc((size_t)n * (size_t)n, sizeof(double)),
                         .b = xcalloc((size_t)n, sizeof(double))};
}

void normal_finish(struct normal *s)
{
    free(s->a);
    free(s->b);
    *s = (struct normal){0};
}

void normal_add(struct normal *s, int k, const int at[], const double x[], double y, double w)
{
    for (int i = 0; i < k; i++) {
        for (int j = 0; j < k; j++)
            if (at[j] <= at[i])
                s->a[at[i] * s->n + at[j]] += w * x[i] * x[j];
        s->b[at[i]] += w * x[i] * y;
    }
    s->yy += w * y * y;
    s->count++;
}

// a = L L^T in the lower triangle; false when a pivot loses too much to the ones before.
static bool cholesky(double *a, int n, double *condition)
{
    *condition = 1;
    for (int i = 0; i < n; i++) {
        double *ri = a + (size_t)i * (size_t)n;
        const double before = ri[i];
        for (int j = 0; j < i; j++) {
            const double *rj = a + (size_t)j * (size_t)n;
            double sum = ri[j];
            for (int k = 0; k < j; k++)
                sum -= ri[k] * rj[k];
            ri[j] = sum / rj[j];
        }
        double pivot = before;
        for (int k = 0; k < i; k++)
            pivot -= ri[k] * ri[k];
        *condition = pivot > 0 ? fmax(*condition, before / pivot) : INFINITY;
        if (!(*condition < NORMAL_LIMIT))
            return false;
        ri[i] = sqrt(pivot);
    }
    return true;
}

bool normal_solve(struct normal *s, double *out, double *inverse_diagonal, struct err *e)
{
    const int n = s->n;
    if (!cholesky(s->a, n, &s->condition))
        return err_set(e, ERR_DATA,
                       "the observations do not determine the %d unknowns (condition %.1g, at most "
                       "%.0g)",
                       n, s->condition, NORMAL_LIMIT);
    for (int i = 0; i < n; i++) {
        double sum = s->b[i];
        for (int k = 0; k < i; k++)
            sum -= s->a[i * n + k] * out[k];
        out[i] = sum / s->a[i * n + i];
    }
    for (int i = n; i-- > 0;) {
        double sum = out[i];
        for (int k = i + 1; k < n; k++)
            sum -= s->a[k * n + i] * out[k];
        out[i] = sum / s->a[i * n + i];
    }
    if (!inverse_diagonal)
        return true;
    double *col = xcalloc((size_t)n, sizeof *col); // one column of L^-1 after the other
    for (int c = 0; c < n; c++) {
        double sum2 = 0;
        for (int i = c; i < n; i++) {
            double sum = i == c;
            for (int k = c; k < i; k++)
                sum -= s->a[i * n + k] * col[k];
            col[i] = sum / s->a[i * n + i];
            sum2 += col[i] * col[i];
        }
        inverse_diagonal[c] = sum2;
    }
    free(col);
    return true;
}
