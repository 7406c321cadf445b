// pitch.c - first orders of tables, spacings of patterns.
#define _GNU_SOURCE
#include "ui/pitch.h"
#include "core/mem.h"
#include "core/spectrum.h"
#include <math.h>
#include <stdlib.h>

enum { RAY = 600 };

// Luminance along a ray of the table; the largest beyond the centre's lobe in *high.
static int ray_of(const struct table *t, bool along_v, double y[RAY], double *high)
{
    for (int k = 0; k < RAY; k++) {
        double xyz[3], rgb[3];
        const double r = t->range * k / (RAY - 1);
        table_eval(t, along_v ? 0 : r, along_v ? r : 0, 2, 0, rgb);
        rgb_to_xyz(rgb, xyz);
        y[k] = xyz[1];
    }
    int k = 1;
    while (k < RAY && y[k] <= y[k - 1]) // down the centre's lobe
        k++;
    *high = 0;
    for (int i = k; i < RAY; i++)
        *high = fmax(*high, y[i]);
    return k;
}

// The first order of 555 nm is where luminance peaks for the first time after the centre's lobe:
// ripples, and what is too weak to be one, do not count.
static double first_peak(const struct table *t, bool along_v, double *high)
{
    double y[RAY], low = INFINITY;
    const int start = ray_of(t, along_v, y, high);
    for (int k = start; k + 1 < RAY; k++) {
        low = fmin(low, y[k]);
        if (y[k] >= y[k - 1] && y[k] > y[k + 1] && y[k] > 0.02 * *high && y[k] > 1.3 * low)
            return 555e-9 / (t->range * k / (RAY - 1));
    }
    return NAN;
}

double pitch_of_table(const struct table *t)
{
    double high[2];
    const double pitch[2] = {first_peak(t, false, &high[0]), first_peak(t, true, &high[1])};
    const int best = high[1] > high[0] && !isnan(pitch[1]);
    return isnan(pitch[best]) ? pitch[1 - best] : pitch[best];
}

// How much the pattern bulges along one axis through its centre: minus the second difference of the
// logarithm, which for a lobe of any strength is the same.
static double *profile_of(const struct lut_pattern *p, bool along_v, int n)
{
    enum { SIDE = 2, STEP = 3 };
    double *y = xcalloc((size_t)n, sizeof *y), *bulge = xcalloc((size_t)n, sizeof *bulge);
    double peak = 0, mean = 0;
    const int cx = (int)lround(p->cx), cy = (int)lround(p->cy);
    for (int k = 0; k < n; k++) {
        for (int q = -SIDE; q <= SIDE; q++) {
            const int i = along_v ? cx + q : k, j = along_v ? k : cy + q;
            if (i >= 0 && j >= 0 && i < p->w && j < p->h)
                y[k] += fmax(0, (double)p->px[(size_t)j * (size_t)p->w + (size_t)i]);
        }
        peak = fmax(peak, y[k]);
    }
    for (int k = 0; k < n; k++)
        y[k] = log(y[k] + 1e-6 * peak + 1e-300);
    for (int k = STEP; k + STEP < n; k++) {
        bulge[k] = fmax(0, 2 * y[k] - y[k - STEP] - y[k + STEP]);
        mean += bulge[k] / n;
    }
    for (int k = 0; k < n; k++)
        bulge[k] -= mean;
    free(y);
    return bulge;
}

static double correlation(const double *y, int n, int lag)
{
    double sum = 0, a = 0, b = 0;
    for (int k = 0; k + lag < n; k++) {
        sum += y[k] * y[k + lag];
        a += y[k] * y[k];
        b += y[k + lag] * y[k + lag];
    }
    return a > 0 && b > 0 ? sum / sqrt(a * b) : 0;
}

// The shortest lag of which the one where the profile is most like itself again is a multiple;
// *like says how much.
static double period_of(const struct lut_pattern *p, bool along_v, double *like)
{
    const int n = along_v ? p->h : p->w, most = n / 4;
    double *y = profile_of(p, along_v, n), *c = xcalloc((size_t)most + 2, sizeof *c);
    double found = NAN;
    int start = 1, best = 0;
    for (int k = 0; k <= most + 1; k++)
        c[k] = correlation(y, n, k);
    while (start < most && c[start] > 0.1) // off the lobe of lag 0
        start++;
    for (int k = start; k < most; k++)
        if (c[k] >= c[k - 1] && c[k] > c[k + 1] && (!best || c[k] > c[best]))
            best = k;
    *like = best ? c[best] : 0;
    const double top = best ? 2 * c[best] - c[best - 1] - c[best + 1] : 0;
    for (int k = start; k <= best && isnan(found) && *like > 0.3; k++) {
        const double times = (double)best / k;
        if (c[k] >= c[k - 1] && c[k] > c[k + 1] && c[k] > 0.25 * *like &&
            fabs(times - round(times)) < 0.15)
            found = (best + (c[best + 1] - c[best - 1]) / (2 * top)) / round(times);
    }
    free(y);
    free(c);
    return found;
}

double pitch_of_pattern(const struct lut_pattern *p, double lambda_m)
{
    double like[2];
    const double period[2] = {period_of(p, false, &like[0]), period_of(p, true, &like[1])};
    return lambda_m / (period[like[1] > like[0]] * p->h_per_px);
}
