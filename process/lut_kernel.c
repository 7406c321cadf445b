// lut_kernel.c - from wavelengths to scalings.
#define _GNU_SOURCE
#include "process/lut_kernel.h"
#include "core/mem.h"
#include "process/lut_band.h"
#include <math.h>
#include <stdlib.h>

double lut_factor(const struct lut_request *r, double lambda_m)
{
    const double part = r->filters ? lut_filters_weight(r->filters, r->filter, lambda_m) : 1;
    return part * pow(r->lambda_m / lambda_m, r->exponent) / (4 * M_PI * M_PI * r->f0 * r->f0);
}

bool lut_kernel_init(struct lp_kernel *k, const struct lut_request *r, double *skipped,
                     struct err *e)
{
    struct lut_band band;
    if (!lut_band_init(&band, r->light, 1e-3, e))
        return false;
    *skipped = band.skipped;
    *k = (struct lp_kernel){0, xcalloc((size_t)band.n, sizeof *k->s), band.weight};
    for (int q = 0; q < band.n; q++) {
        const double factor = lut_factor(r, band.lambda_m[q]);
        if (factor == 0) // another photograph's wavelength
            continue;
        k->s[k->n] = log(r->lambda_m / band.lambda_m[q]);
        for (int c = 0; c < 3; c++)
            k->weight[k->n][c] = band.weight[q][c] * factor;
        k->n++;
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
