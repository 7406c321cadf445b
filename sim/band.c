// band.c - quadrature over a passband.
#define _GNU_SOURCE
#include "sim/band.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

void band_finish(struct band *b)
{
    if (!b)
        return;
    free(b->lambda_m);
    free(b->weight);
    *b = (struct band){0};
}

// Sensitivities of a Bayer sensor's channels: Gaussians, as silicon behind dyes roughly is.
static double channel(int c, double lambda_m)
{
    static const double centre_nm[3] = {605, 535, 460}, width_nm[3] = {75, 90, 75};
    const double x = (lambda_m * 1e9 - centre_nm[c]) / width_nm[c];
    return exp(-4 * log(2) * x * x);
}

// The trapezoidal rule: for a smooth band that ends in zeros its error falls as exp(-2 pi^2 width^2
// / step^2), and the lobes of a pattern are no narrower in wavelength than a few nm.
static bool quadrature(struct band *b, const struct spectrum *s, bool bayer, struct err *e)
{
    const double floor_at = 1e-5;
    double peak = 0, sum[3] = {0}, first = INFINITY, last = 0;
    for (int k = 0; k < s->n; k++)
        peak = fmax(peak, s->value[k]);
    for (int k = 0; k < s->n; k++)
        if (s->value[k] > floor_at * peak) {
            first = fmin(first, s->lambda_m[k]);
            last = fmax(last, s->lambda_m[k]);
        }
    if (!(peak > 0))
        return err_set(e, ERR_DATA,
                       "the light, the filter and the camera have no wavelength in "
                       "common");
    const double step = last - first > 16e-9 ? 2e-9 : fmax(0.1e-9, (last - first) / 16);
    const int n = 1 + (int)floor((last - first) / step + 1e-6);
    struct band got = {n, xcalloc((size_t)n, sizeof(double)),
                       xcalloc((size_t)n, 3 * sizeof(double)), b->irradiance};
    for (int k = 0; k < n; k++) {
        got.lambda_m[k] = first + k * step;
        for (int c = 0; c < 3; c++) {
            const double x = spectrum_at(s, got.lambda_m[k]);
            sum[c] += got.weight[3 * k + c] = bayer ? x * channel(c, got.lambda_m[k]) : x;
        }
    }
    const double most = fmax(sum[0], fmax(sum[1], sum[2]));
    for (int k = 0; k < 3 * n; k++)
        got.weight[k] /= most;
    *b = got;
    return true;
}

bool band_of_rig(struct band *b, const struct rig *rig, int light, int filter, bool bayer,
                 struct err *e)
{
    struct spectrum s = {0};
    const double stated = rig_irradiance(rig, light, filter);
    struct band got = {.irradiance = stated > 0 ? stated : 1};
    const bool ok = rig_spectrum(rig, light, filter, &s, e) && quadrature(&got, &s, bayer, e);
    spectrum_finish(&s);
    if (ok)
        *b = got;
    return ok;
}

bool band_of_eye(struct band *b, const struct spectrum *illuminant, struct err *e)
{
    const double step = 1.25e-9, scale = illuminant_scale(illuminant);
    const int n = 1 + (int)lround((CIE_LAST_NM - CIE_FIRST_NM) * 1e-9 / step);
    if (!(scale > 0) || !isfinite(scale))
        return err_set(e, ERR_DATA, "the illuminant has no luminance between %d and %d nm",
                       CIE_FIRST_NM, CIE_LAST_NM);
    *b = (struct band){n, xcalloc((size_t)n, sizeof(double)),
                       xcalloc((size_t)n, 3 * sizeof(double)), 1};
    for (int k = 0; k < n; k++) {
        const double l = CIE_FIRST_NM * 1e-9 + k * step;
        double xyz[3];
        cie_xyz(l, xyz);
        for (int c = 0; c < 3; c++)
            xyz[c] *= (k == 0 || k == n - 1 ? 0.5 : 1) * step * scale * spectrum_at(illuminant, l);
        b->lambda_m[k] = l;
        xyz_to_rgb(xyz, &b->weight[3 * k]);
    }
    return true;
}

bool band_gaussian(struct band *b, double centre_m, double fwhm_m, double irradiance, bool bayer,
                   struct err *e)
{
    enum { N = 161 };
    struct spectrum s = {N, xcalloc(N, sizeof(double)), xcalloc(N, sizeof(double))};
    for (int k = 0; k < N; k++) {
        const double x = (k - N / 2) / 40.; // in widths: 2 widths either side is 1.5e-5
        s.lambda_m[k] = centre_m + x * fwhm_m;
        s.value[k] = exp(-4 * log(2) * x * x);
    }
    struct band got = {.irradiance = irradiance};
    const bool ok = quadrature(&got, &s, bayer, e);
    spectrum_finish(&s);
    if (ok)
        *b = got;
    return ok;
}
