// table.c - diffraction tables: nodes, weights, look-up.
#define _GNU_SOURCE
#include "core/table.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

bool table_nodes_check(int n, double range, int power, struct err *e)
{
    if (n < 2 || n > IMAGE_MAX_SIDE)
        return err_set(e, ERR_DATA, "bad table size %d: must be 2 to %d nodes a side", n,
                       IMAGE_MAX_SIDE);
    if (!(range > 0 && range <= 2))
        return err_set(e, ERR_DATA, "bad table range %g: must be above 0 and at most 2 (|h| = 2)",
                       range);
    if (power < 1 || power > 99 || power % 2 == 0)
        return err_set(e, ERR_DATA, "bad table power %d: must be odd (1, 3, 5, ...)", power);
    return true;
}

bool table_init(struct table *t, int n, double range, int power, int count, struct err *e)
{
    if (!table_nodes_check(n, range, power, e))
        return false;
    if (count < 1 || count > 1000)
        return err_set(e, ERR_DATA, "bad table count %d: must be 1 to 1000", count);
    float *tab = sample_alloc((size_t)count * (size_t)n * (size_t)n * 3, sizeof *tab, "table", e);
    if (!tab)
        return false;
    *t = (struct table){.n = n, .range = range, .power = power, .count = count, .tab = tab};
    return true;
}

void table_finish(struct table *t)
{
    if (!t)
        return;
    free(t->tab);
    free(t->curve);
    free(t->sigma);
    free(t->cover);
    meta_finish(&t->meta);
    *t = (struct table){0};
}

double table_node(const struct table *t, int i)
{
    const double s = 2.0 * i / (t->n - 1) - 1;
    return t->range * copysign(pow(fabs(s), t->power), s);
}

double table_index(const struct table *t, double u)
{
    if (!(fabs(u) <= t->range))
        return NAN;
    const double s = copysign(pow(fabs(u) / t->range, 1.0 / t->power), u);
    return fmin((s + 1) * 0.5 * (t->n - 1), t->n - 1);
}

double table_weight(const struct table *t, int m, double w)
{
    switch (t->basis) {
    case TABLE_PLAIN: return m == 0;
    case TABLE_TAYLOR: return pow(w, m);
    case TABLE_CHEBYSHEV: {
        const double x = (2 * w - t->w_min - t->w_max) / (t->w_max - t->w_min);
        return cos(m * acos(fmax(-1, fmin(1, x))));
    }
    case TABLE_POD: break;
    }
    const double at = (w - t->w_min) / (t->w_max - t->w_min) * (t->nw - 1);
    const double x = fmax(0, fmin(t->nw - 1, at));
    const int k = x < t->nw - 2 ? (int)x : t->nw - 2;
    const double *c = t->curve + (size_t)m * (size_t)t->nw + k;
    return c[0] + (x - k) * (c[1] - c[0]);
}

void table_eval(const struct table *t, double u, double v, double w, int count, double out[3])
{
    out[0] = out[1] = out[2] = 0;
    const double x = table_index(t, u), y = table_index(t, v);
    if (isnan(x) || isnan(y))
        return;
    const int i = x < t->n - 1 ? (int)x : t->n - 2, j = y < t->n - 1 ? (int)y : t->n - 2;
    const double fx = x - i, fy = y - j;
    const size_t n = (size_t)t->n, at = ((size_t)j * n + (size_t)i) * 3;
    const int used = count > 0 && count < t->count ? count : t->count;
    for (int m = 0; m < used; m++) {
        const float *a = t->tab + (size_t)m * n * n * 3 + at, *b = a + n * 3;
        const double weight = table_weight(t, m, w);
        for (int c = 0; c < 3; c++)
            out[c] += weight * ((1 - fy) * ((1 - fx) * a[c] + fx * a[c + 3]) +
                                fy * ((1 - fx) * b[c] + fx * b[c + 3]));
    }
}
