// lut_kernel.c - from wavelengths to scalings.
#define _GNU_SOURCE
#include "process/lut_kernel.h"
#include "core/mem.h"
#include "process/lut_band.h"
#include <math.h>
#include <stdlib.h>

bool lut_kernel_init(struct lp_kernel *k, const struct lut_request *r, double *skipped,
                     struct err *e)
{
    struct lut_band band;
    if (!lut_band_init(&band, r->light, 1e-3, e))
        return false;
    *skipped = band.skipped;
    *k = (struct lp_kernel){band.n, xcalloc((size_t)band.n, sizeof *k->s), band.weight};
    for (int q = 0; q < band.n; q++) {
        k->s[q] = log(r->lambda_m / band.lambda_m[q]);
        const double factor = exp(r->exponent * k->s[q]) / (4 * M_PI * M_PI * r->f0 * r->f0);
        for (int c = 0; c < 3; c++)
            k->weight[q][c] *= factor;
    }
    free(band.lambda_m);
    return true;
}

void lut_kernel_finish(struct lp_kernel *k)
{
    free(k->s);
    free(k->weight);
    *k = (struct lp_kernel){0};
}

double *lut_node_px(const struct table *t, const struct lut_pattern *p)
{
    double *x = xcalloc((size_t)t->n, sizeof *x);
    for (int i = 0; i < t->n; i++)
        x[i] = table_node(t, i) / p->h_per_px;
    return x;
}
