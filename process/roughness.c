// roughness.c - moments of the heights about their mean.
#include "process/roughness.h"
#include <math.h>
#include <stddef.h>

bool hfield_roughness(struct roughness *out, const struct hfield *hf, struct err *e)
{
    struct roughness r = {0};
    const size_t n = (size_t)hf->nx * (size_t)hf->ny;
    double sum = 0, two = 0, three = 0, four = 0, lo = 0, hi = 0;
    const double count = (double)(n - (size_t)hfield_missing(hf));
    if (!hfield_range(hf, &lo, &hi))
        return err_set(e, ERR_DATA, "no node was measured");
    for (size_t k = 0; k < n; k++)
        if (!isnan(hf->z[k]))
            sum += (double)hf->z[k];
    r.mean_m = sum / count;
    for (size_t k = 0; k < n; k++) {
        if (isnan(hf->z[k]))
            continue;
        const double d = (double)hf->z[k] - r.mean_m;
        r.sa_m += fabs(d) / count;
        two += d * d / count;
        three += d * d * d / count;
        four += d * d * d * d / count;
    }
    r.sq_m = sqrt(two);
    r.sp_m = hi - r.mean_m;
    r.sv_m = r.mean_m - lo;
    r.sz_m = hi - lo;
    r.ssk = lo < hi ? three / (two * r.sq_m) : NAN;
    r.sku = lo < hi ? four / (two * two) : NAN;
    *out = r;
    return true;
}
