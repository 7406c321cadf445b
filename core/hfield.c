// hfield.c - height fields.
#define _GNU_SOURCE
#include "core/hfield.h"
#include "core/image.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

bool hfield_init(struct hfield *hf, int nx, int ny, double dx_m, double dy_m, struct err *e)
{
    if (nx < 2 || ny < 2 || nx > IMAGE_MAX_SIDE || ny > IMAGE_MAX_SIDE)
        return err_set(e, ERR_DATA, "bad size %d x %d: a height field has 2 to %d nodes a side", nx,
                       ny, IMAGE_MAX_SIDE);
    if (!(dx_m > 0 && isfinite(dx_m) && dy_m > 0 && isfinite(dy_m)))
        return err_set(e, ERR_DATA, "bad node spacing %g x %g m: must be positive", dx_m, dy_m);
    const size_t n = (size_t)nx * (size_t)ny;
    float *z = sample_alloc(n, sizeof *z, "height field", e);
    if (!z)
        return false;
    for (size_t k = 0; k < n; k++)
        z[k] = NAN;
    *hf = (struct hfield){.nx = nx, .ny = ny, .dx_m = dx_m, .dy_m = dy_m, .z = z};
    return true;
}

void hfield_finish(struct hfield *hf)
{
    if (!hf)
        return;
    free(hf->z);
    meta_finish(&hf->meta);
    *hf = (struct hfield){0};
}

bool hfield_range(const struct hfield *hf, double *lo_m, double *hi_m)
{
    double lo = INFINITY, hi = -INFINITY;
    const size_t n = (size_t)hf->nx * (size_t)hf->ny;
    for (size_t k = 0; k < n; k++) {
        lo = fmin(lo, (double)hf->z[k]); // fmin and fmax pass over NAN
        hi = fmax(hi, (double)hf->z[k]);
    }
    if (!(lo <= hi))
        return false;
    *lo_m = lo;
    *hi_m = hi;
    return true;
}

long hfield_missing(const struct hfield *hf)
{
    const size_t n = (size_t)hf->nx * (size_t)hf->ny;
    long missing = 0;
    for (size_t k = 0; k < n; k++)
        missing += isnan(hf->z[k]) != 0;
    return missing;
}
