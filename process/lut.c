// lut.c - checks a request, picks the method, runs it.
#define _GNU_SOURCE
#include "core/log.h"
#include "process/lut_kernel.h"
#include <math.h>
#include <stdio.h>

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
    if (r->band && !(r->noise_limit > 1 && isfinite(r->noise_limit)))
        return err_set(e, ERR_DATA, "bad noise limit %g: must be above 1", r->noise_limit);
    if (r->filters && !lut_filters_check(r->filters, e))
        return false;
    if (r->band && r->method != LUT_AUTO && r->method != LUT_EXACT)
        return err_set(e, ERR_DATA, "only the exact method can undo the photograph's band");
    return table_nodes_check(r->n, r->range, r->power, e);
}

const char *lut_method_name(enum lut_method m)
{
    static const char *const names[] = {"auto", "exact", "sampled", "floor"};
    return names[m];
}

// Rough cost in look-ups: enough to tell methods apart that differ by factors.
static enum lut_method pick(const struct lut_request *r, char *why, size_t size)
{
    const double nodes = (double)r->n * r->n, pixels = (double)r->pattern->w * r->pattern->h;
    const int wavelengths = r->wavelengths ? r->wavelengths : lut_sampled_wavelengths(r->tolerance);
    const double floor_cost = nodes * 81 / 8, sampled_cost = nodes * wavelengths;
    const double exact_cost = 2 * pixels + nodes + 1e5;
    if (r->band) {
        snprintf(why, size, "only it can undo the photograph's band");
        return LUT_EXACT;
    }
    if (r->tolerance >= 0.3 && floor_cost < fmin(sampled_cost, exact_cost)) {
        snprintf(why, size, "an error of %g is allowed, and the table is small", r->tolerance);
        return LUT_FLOOR;
    }
    if (sampled_cost < exact_cost) {
        snprintf(why, size,
                 "%d wavelengths keep the error near %g, and for so few nodes that is "
                 "less work than resampling the pattern",
                 wavelengths, r->tolerance);
        return LUT_SAMPLED;
    }
    snprintf(why, size, "it keeps the error below %g with some %.0f times less work than sampling",
             r->tolerance, sampled_cost / exact_cost);
    return LUT_EXACT;
}

// What no sum with these weights can be below, a pattern nowhere below its least value given.
static void find_lowest(const struct lut_request *r, const struct lp_kernel *k, float lowest[3])
{
    const struct lut_pattern *p = r->pattern;
    float least = 0;
    double sum[3] = {0};
    for (size_t i = 0; i < (size_t)p->w * (size_t)p->h; i++)
        least = fminf(least, p->px[i]);
    for (int q = 0; q < k->n; q++)
        for (int c = 0; c < 3; c++)
            sum[c] += k->weight[q][c];
    for (int c = 0; c < 3; c++)
        lowest[c] = r->filters ? -INFINITY : (float)(sum[c] * (double)least);
}

// Splines swing below zero around sharp lobes; the table is cut off where only they can reach.
static void settle(struct table *t, const float lowest[3], bool to_rgb)
{
#pragma omp parallel for
    for (int j = 0; j < t->n; j++)
        for (float *v = t->tab + (size_t)j * (size_t)t->n * 3, *end = v + (size_t)t->n * 3; v < end;
             v += 3) {
            double xyz[3], rgb[3];
            for (int c = 0; c < 3; c++)
                xyz[c] = (double)(v[c] = v[c] > lowest[c] ? v[c] : lowest[c]);
            if (!to_rgb)
                continue;
            xyz_to_rgb(xyz, rgb);
            for (int c = 0; c < 3; c++)
                v[c] = (float)rgb[c];
        }
    t->is_rgb = to_rgb;
}

static bool build(const struct lut_request *r, struct table *t, struct lut_report *report,
                  struct err *e)
{
    static lut_fn *const methods[] = {NULL, lut_exact, lut_sampled, lut_floor};
    struct lp_kernel k;
    if (!lut_kernel_init(&k, r, &report->skipped_band, e))
        return false;
    float lowest[3];
    find_lowest(r, &k, lowest);
    bool ok = lut_cover(r->pattern, &k, t, &report->uncovered, e) &&
              (!r->band || lut_deband(&k, r, &report->noise_gain, e)) &&
              methods[report->method](r, &k, t, report, e);
    if (ok)
        settle(t, lowest, r->is_rgb);
    ok =
        ok && (!r->pattern->variance || lut_sigma(r->pattern, &k, report->skipped.symmetric, t, e));
    lut_kernel_finish(&k);
    return ok;
}

bool lut_build(const struct lut_request *r, struct table *t, struct lut_report *report,
               struct err *e)
{
    const double start_s = now_s();
    struct lut_report did = {.method = r->method};
    struct table got = {0};
    if (!check(r, e))
        return false;
    snprintf(did.why, sizeof did.why, "as asked for");
    if (did.method == LUT_AUTO)
        did.method = pick(r, did.why, sizeof did.why);
    if (!table_init(&got, r->n, r->range, r->power, 1, e))
        return false;
    if (!build(r, &got, &did, e)) {
        table_finish(&got);
        return false;
    }
    did.seconds = now_s() - start_s;
    *report = did;
    *t = got;
    return true;
}
