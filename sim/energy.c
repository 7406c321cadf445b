// energy.c - sums over orders.
#define _GNU_SOURCE
#include "sim/energy.h"
#include "core/mem.h"
#include "sim/farfield.h"
#include <math.h>
#include <stdlib.h>

static double mean_power(const struct sample *s)
{
    double sum = s->ground * s->ground;
    for (int k = 0; k < s->n_shapes; k++) {
        const struct shape *p = &s->shape[k];
        const double area = (p->s1 - p->s0) * (p->t1 - p->t0);
        sum += (p->amplitude * p->amplitude - s->ground * s->ground) * area;
    }
    return s->map.z ? 1 : sum;
}

static bool sum_orders(const struct sample *s, double q, int reach, double *sum, struct err *e)
{
    const int m_max = s->map.z && reach > s->map.nx / 2 ? s->map.nx / 2 : reach;
    const int n_max = isinf(s->period_y_m)                ? 0
                      : s->map.z && reach > s->map.ny / 2 ? s->map.ny / 2
                                                          : reach;
    const size_t count = (size_t)(2 * m_max + 1) * (size_t)(2 * n_max + 1);
    double complex *c = sample_alloc(count, sizeof *c, "orders", e);
    if (!c)
        return false;
    sample_orders(s, q, m_max, n_max, c);
    *sum = 0;
    for (size_t k = 0; k < count; k++)
        *sum += creal(c[k]) * creal(c[k]) + cimag(c[k]) * cimag(c[k]);
    free(c);
    return true;
}

bool energy_of(const struct sample *s, double lambda_m, int reach, struct energy *out,
               struct err *e)
{
    const struct farfield_range all = {1, lambda_m, lambda_m, 1, 2};
    struct energy got = {.reflectance = mean_power(s)};
    struct farfield f;
    if (!sum_orders(s, 2 / lambda_m, reach, &got.orders, e) || !farfield_init(&f, s, &all, e))
        return false;
    const bool one_d = isinf(s->period_y_m);
    for (int n = -f.n_max; n <= f.n_max; n++)
        for (int m = -f.m_max; m <= f.m_max; m++) {
            const double u = m * lambda_m / s->period_x_m;
            const double v = one_d ? 0 : n * lambda_m / s->period_y_m;
            if (u * u + v * v >= 1)
                continue;
            const double cos_o = sqrt(1 - u * u - v * v);
            const double own = farfield_order(&f, m, n, (1 + cos_o) / lambda_m);
            got.propagating += own;
            got.returned += own / cos_o;
        }
    farfield_finish(&f);
    *out = got;
    return true;
}
