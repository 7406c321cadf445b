// lut.c - checks a request, picks the method, runs it.
#define _GNU_SOURCE
#include "process/lut.h"
#include "core/log.h"
#include <math.h>

static bool check(const struct lut_request *r, struct err *e)
{
    const struct lut_pattern *p = r->pattern;
    const double first_m = CIE_FIRST_NM * 1e-9, last_m = CIE_LAST_NM * 1e-9, eps = 1e-15;
    if (!(r->lambda_m >= first_m - eps && r->lambda_m <= last_m + eps))
        return err_set(e, ERR_DATA, "wavelength %g nm is out of range: must be %d to %d nm",
                       r->lambda_m * 1e9, CIE_FIRST_NM, CIE_LAST_NM);
    if (!(p->h_per_px > 0 && isfinite(p->h_per_px)))
        return err_set(e, ERR_DATA, "bad h per pixel %g: must be positive", p->h_per_px);
    if (!(p->cx >= 0 && p->cy >= 0 && p->cx <= p->w - 1 && p->cy <= p->h - 1))
        return err_set(e, ERR_DATA, "centre (%g, %g) is outside the %d x %d image", p->cx, p->cy,
                       p->w, p->h);
    if (!(r->f0 > 0 && isfinite(r->f0)))
        return err_set(e, ERR_DATA, "bad F0 %g: must be positive", r->f0);
    if (!(fabs(r->exponent) <= 8))
        return err_set(e, ERR_DATA, "bad exponent %g: must be within -8 to 8", r->exponent);
    if (!(r->tolerance > 0 && r->tolerance <= 1))
        return err_set(e, ERR_DATA, "bad tolerance %g: must be above 0 and at most 1",
                       r->tolerance);
    if (r->wavelengths && (r->wavelengths < 2 || r->wavelengths > 100001))
        return err_set(e, ERR_DATA, "bad number of wavelengths %d: must be 2 to 100001",
                       r->wavelengths);
    return table_nodes_check(r->n, r->range, r->power, e);
}

bool lut_build(const struct lut_request *r, struct table *t, struct lut_report *report,
               struct err *e)
{
    struct table got = {0};
    *report = (struct lut_report){.method = LUT_SAMPLED};
    const double start_s = now_s();
    if (!check(r, e) || !table_init(&got, r->n, r->range, r->power, 1, e))
        return false;
    got.is_rgb = r->is_rgb;
    if (!lut_sampled(r, &got, report, e)) {
        table_finish(&got);
        return false;
    }
    report->seconds = now_s() - start_s;
    *t = got;
    return true;
}
