// table_spline.c - quintic splines through the planes of a table.
#include "process/table_spline.h"
#include "core/mem.h"
#include "process/bspline.h"
#include <math.h>
#include <stdlib.h>

// plane[n][n]: rows, then columns, in double, so that nodes come back to the last digit.
static bool fit(double *plane, int n, struct err *e)
{
    bool ok = true;
#pragma omp parallel reduction(&& : ok)
    {
        struct err mine;
        double *column = sample_alloc((size_t)n, sizeof *column, "table", &mine);
        ok = column != NULL;
#pragma omp for
        for (int j = 0; j < n; j++)
            bspline_fit_line(plane + (size_t)j * (size_t)n, n, BSPLINE_QUINTIC);
#pragma omp for
        for (int i = 0; i < n; i++) {
            for (int j = 0; column && j < n; j++)
                column[j] = plane[(size_t)j * (size_t)n + (size_t)i];
            if (column)
                bspline_fit_line(column, n, BSPLINE_QUINTIC);
            for (int j = 0; column && j < n; j++)
                plane[(size_t)j * (size_t)n + (size_t)i] = column[j];
        }
        free(column);
    }
    return ok || err_set(e, ERR_FILE, "no memory for a table of %d nodes a side", n);
}

bool table_spline_init(struct table_spline *s, const struct table *t, struct err *e)
{
    const size_t n2 = (size_t)t->n * (size_t)t->n;
    double *coef = sample_alloc((size_t)t->count * 3 * n2, sizeof *coef, "table", e);
    bool ok = coef != NULL;
    for (int plane = 0; ok && plane < 3 * t->count; plane++) {
        const float *from = t->tab + (size_t)(plane / 3) * 3 * n2 + plane % 3;
        for (size_t k = 0; k < n2; k++)
            coef[(size_t)plane * n2 + k] = (double)from[3 * k];
        ok = fit(coef + (size_t)plane * n2, t->n, e);
    }
    if (ok)
        *s = (struct table_spline){t, coef};
    else
        free(coef);
    return ok;
}

void table_spline_finish(struct table_spline *s)
{
    free(s->coef);
    *s = (struct table_spline){0};
}

void table_spline_at(const struct table_spline *s, double u, double v, double w, int count,
                     double out[3])
{
    const struct table *t = s->table;
    const double x = table_index(t, u), y = table_index(t, v);
    out[0] = out[1] = out[2] = 0;
    if (isnan(x) || isnan(y))
        return;
    const int i = x < t->n - 1 ? (int)x : t->n - 2, j = y < t->n - 1 ? (int)y : t->n - 2;
    double wx[6], wy[6];
    for (int a = 0; a < 6; a++) {
        wx[a] = bspline_basis(BSPLINE_QUINTIC, x - (i - 2 + a));
        wy[a] = bspline_basis(BSPLINE_QUINTIC, y - (j - 2 + a));
    }
    const int used = count > 0 && count < t->count ? count : t->count;
    for (int m = 0; m < used; m++) {
        const double weight = table_weight(t, m, w);
        for (int c = 0; c < 3; c++) {
            const double *plane = s->coef + (size_t)(3 * m + c) * (size_t)t->n * (size_t)t->n;
            double sum = 0;
            for (int b = 0; b < 6; b++) {
                const double *row = plane + (size_t)bspline_mirror(j - 2 + b, t->n) * (size_t)t->n;
                for (int a = 0; a < 6; a++)
                    sum += wy[b] * wx[a] * row[bspline_mirror(i - 2 + a, t->n)];
            }
            out[c] += weight * sum;
        }
    }
}
