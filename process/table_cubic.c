// table_cubic.c - a diffraction table between its nodes, to fourth order.
#define _GNU_SOURCE
#include "process/table_cubic.h"
#include "core/spectrum.h"
#include <math.h>
#include <stddef.h>

bool table_stencil(const struct table *t, double u, int *first, double weight[STENCIL])
{
    const double at = table_index(t, u);
    if (isnan(at))
        return false;
    const int count = t->n < STENCIL ? t->n : STENCIL;
    const int i = (int)at - (count - 2) / 2;
    *first = i < 0 ? 0 : i > t->n - count ? t->n - count : i;
    const double x = at - *first;
    for (int k = 0; k < STENCIL; k++) {
        weight[k] = k < count;
        for (int m = 0; m < count && k < count; m++)
            if (m != k)
                weight[k] *= (x - m) / (k - m);
    }
    return true;
}

void table_cubic(const struct table *t, double u, double v, double w, double out[3])
{
    double wx[STENCIL], wy[STENCIL];
    int i, j;
    out[0] = out[1] = out[2] = 0;
    if (!table_stencil(t, u, &i, wx) || !table_stencil(t, v, &j, wy))
        return;
    const size_t n = (size_t)t->n;
    const int side = t->n < STENCIL ? t->n : STENCIL;
    for (int m = 0; m < t->count; m++) {
        const float *a = t->tab + ((size_t)m * n * n + (size_t)j * n + (size_t)i) * 3;
        double sum[3] = {0};
        for (int q = 0; q < side; q++, a += 3 * n)
            for (int p = 0; p < side; p++)
                for (int c = 0; c < 3; c++)
                    sum[c] += wy[q] * wx[p] * (double)a[3 * p + c];
        const double weight = t->basis == TABLE_PLAIN ? 1 : table_weight(t, m, w);
        for (int c = 0; c < 3; c++)
            out[c] += weight * sum[c];
    }
}

bool table_not_negative(const struct table *t)
{
    const size_t samples = (size_t)t->count * (size_t)t->n * (size_t)t->n * 3;
    for (size_t k = 0; k < samples; k++)
        if (t->tab[k] < 0)
            return false;
    return true;
}

// Of one row of cells between nodes: integrals of S^2 and |grad S|^2.
static void row_detail(const struct table *t, const float *row, double dv, double sum[2])
{
    const size_t up = 3 * (size_t)t->n;
    for (int i = 0; i + 1 < t->n; i++) {
        const double du = table_node(t, i + 1) - table_node(t, i);
        for (int c = 0; c < 3; c++) {
            const float *a = row + 3 * i + c;
            const double s = (double)*a, s_u = ((double)a[3] - s) / du,
                         s_v = ((double)a[up] - s) / dv;
            sum[0] += s * s * du * dv;
            sum[1] += (s_u * s_u + s_v * s_v) * du * dv;
        }
    }
}

double table_detail(const struct table *t)
{
    const size_t n = (size_t)t->n;
    double sum[2] = {0};
    for (int m = 0; m < t->count; m++)
        for (int j = 0; j + 1 < t->n; j++)
            row_detail(t, t->tab + ((size_t)m * n + (size_t)j) * n * 3,
                       table_node(t, j + 1) - table_node(t, j), sum);
    return sum[0] > 0 ? fmin(sqrt(sum[0] / sum[1]), t->range) : 0;
}

void table_to_rgb(struct table *t)
{
    if (t->is_rgb)
        return;
    const size_t n = (size_t)t->count * (size_t)t->n * (size_t)t->n;
    for (size_t k = 0; k < n; k++) {
        float *px = t->tab + 3 * k;
        double rgb[3];
        xyz_to_rgb((double[]){(double)px[0], (double)px[1], (double)px[2]}, rgb);
        for (int c = 0; c < 3; c++)
            px[c] = (float)rgb[c];
    }
    t->is_rgb = true;
}
