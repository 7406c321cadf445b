// diffraction_rows.c - what every column of a grid shares.
#include "process/diffraction_rows.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// sin(pi n f) / (n sin(pi f)), whose limit at whole f is +-1. Folding f to the nearest whole number
// first keeps all digits beside the zeros of the denominator. (S13 2.7 has the same as (p + i q)
// per axis; the product of two axes has the imaginary part p1 q2 + q1 p2, not the one printed.)
double array_factor(int n, double f)
{
    const double pi = 3.14159265358979323846, x = f - rint(f);
    if (fabs(x) * n < 1e-8)
        return 1;
    const double a = sin(pi * n * x) / (n * sin(pi * x));
    return a * a;
}

double diffraction_scale(const struct diffraction *d, double lambda_m)
{
    const double area = patch_area(d->patch) * d->repeat[0] * d->repeat[1];
    return d->absolute ? area / (lambda_m * lambda_m) : 1;
}

// Marks the slots that each wavelength reads, so that columns are blended only there.
static bool mark_used(struct diffraction_rows *r, const struct diffraction *d, const struct bins *y,
                      struct err *e)
{
    const size_t lists = (size_t)d->light->n * 2, nv = (size_t)d->nv, kept = (size_t)y->kept;
    r->used = sample_alloc(lists, kept, "table rows", e);
    for (size_t k = 0; r->used && k < lists * nv; k++) {
        r->tap[k].slot = bins_slot(y, r->tap[k].slot);
        memset(r->used + k / nv * kept + r->tap[k].slot, 1, TAPS);
    }
    return r->used;
}

bool diffraction_rows_init(struct diffraction_rows *r, const struct diffraction *d, struct bins *y,
                           struct err *e)
{
    const struct patch *p = d->patch;
    const size_t nv = (size_t)d->nv, nl = (size_t)d->light->n;
    *r = (struct diffraction_rows){0};
    r->tap = sample_alloc(nl * 2 * nv, sizeof *r->tap, "table rows", e);
    r->gain = r->tap ? sample_alloc(nl * nv, 3 * sizeof *r->gain, "table rows", e) : NULL;
    if (!r->gain)
        return false;
    for (size_t l = 0; l < nl; l++) {
        const double lambda_m = d->light->lambda_m[l], scale = diffraction_scale(d, lambda_m);
        for (size_t j = 0; j < nv; j++) {
            const double cycles = d->v[j] * p->dy_m / lambda_m, f = taps_fold(cycles);
            const double factor = array_factor(d->repeat[1], cycles * p->ny) * scale;
            for (size_t side = 0; side < 2; side++) {
                struct row_tap *t = r->tap + (l * 2 + side) * nv + j;
                taps_weights(y->fine, side ? -f : f, t->weight);
                t->slot = taps_first(y->fine, side ? -f : f);
                bins_need(y, t->slot);
            }
            for (size_t c = 0; c < 3; c++)
                r->gain[(l * nv + j) * 3 + c] = (float)(d->light->weight[l][c] * factor);
        }
    }
    bins_close(y);
    return mark_used(r, d, y, e);
}

void diffraction_rows_finish(struct diffraction_rows *r)
{
    free(r->tap);
    free(r->gain);
    free(r->used);
    *r = (struct diffraction_rows){0};
}
