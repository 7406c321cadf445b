// stability_process.c - splines, Bessel functions, slits, remainders, taps, nodes, weights.
#define _GNU_SOURCE
#include "process/bessel.h"
#include "process/bspline.h"
#include "process/diffraction_rows.h"
#include "process/env_zonal.h"
#include "process/exposure.h"
#include "process/lut_filters.h"
#include "process/multislit.h"
#include "process/rainbow.h"
#include "process/table_cubic.h"
#include "process/tables_taylor.h"
#include "process/taps.h"
#include "process/wnodes.h"
#include "tests/bench/stability.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>

static const long double pi_l = 3.14159265358979323846264338327950288L;

// The basis function, from its definition by truncated powers (de Boor).
static long double basis(int degree, long double x)
{
    long double sum = 0, binomial = 1, factorial = 1;
    for (int k = 1; k <= degree; k++)
        factorial *= k;
    const long double half = 0.5L * (degree + 1);
    if (fabsl(x) >= half)
        return 0;
    x = -fabsl(x); // the side with fewer terms
    for (int k = 0; k <= degree + 1; k++) {
        const long double t = x + half - k;
        if (t > 0)
            sum += (k % 2 ? -1 : 1) * binomial * powl(t, degree);
        binomial *= (long double)(degree + 1 - k) / (k + 1);
    }
    return sum / factorial;
}

static double weights_3(const double *x, uint64_t seed)
{
    (void)seed;
    const float f = (float)x[0];
    float w[4];
    double wd[4], worst = 0;
    bspline_weights_3(f, w);
    bspline_weights(f < 1 ? (double)f : 0, wd);
    for (int k = 0; k < 4; k++) {
        worst =
            stability_worse(worst, stability_off((double)w[k], basis(3, (double)f - (k - 1)), 1));
        if (f < 1)
            worst =
                stability_worse(worst, stability_off(wd[k], basis(3, (double)f - (k - 1)), 1e-8L));
    }
    return worst;
}

static double weights_5(const double *x, uint64_t seed)
{
    (void)seed;
    const float f = (float)x[0];
    float w[6];
    double worst = 0;
    bspline_weights_5(f, w);
    for (int k = 0; k < 6; k++)
        worst =
            stability_worse(worst, stability_off((double)w[k], basis(5, (double)f - (k - 2)), 1));
    return worst;
}

static double basis_of(const double *x, uint64_t seed)
{
    const int degree = seed % 2 ? 3 : 5;
    return stability_off(bspline_basis(degree, x[0]), basis(degree, x[0]), 1);
}

static double gain_of(const double *x, uint64_t seed)
{
    (void)seed;
    const int period = (int)x[1], k = (int)x[0] % period;
    const long double want = 3 / (2 + cosl(2 * pi_l * k / period));
    return stability_off(bspline_gain(k, period), want, want);
}

// J_n by downward recurrence in long double from far above, the independent starting point of
// which is the argument itself.
static double bessel(const double *x, uint64_t seed)
{
    (void)seed;
    double j[256];
    const int n = (int)x[1];
    const double z = x[0];
    bessel_j(z, n, j);
    double worst = 0;
    const int few[3] = {0, n / 2, n - 1};
    for (int k = 0; k < 3; k++)
        worst = stability_worse(worst, stability_off(j[few[k]], jnl(few[k], z), 1));
    return worst;
}

static long double array_l(long double n, long double f)
{
    const long double x = f - rintl(f);
    if (x == 0)
        return 1;
    const long double a = sinl(pi_l * n * x) / (n * sinl(pi_l * x));
    return a * a;
}

// Between its zeros the factor moves by pi for 1/n of f: digits of f are digits of the phase.
static double array_of(const double *x, uint64_t seed)
{
    (void)seed;
    const int n = (int)x[0];
    return stability_off(array_factor(n, x[1]), array_l(n, x[1]), 1);
}

static double multislit_of(const double *x, uint64_t seed)
{
    (void)seed;
    const struct multislit s = {
        .pitch_m = x[0], .width_m = x[0] * (1 - 0.999 * x[1]), .count = (int)x[2]};
    const double u = x[3], l = 380e-9 + 400e-9 * x[4];
    const long double a = pi_l * s.width_m * u / l, f = (long double)s.pitch_m * u / l;
    const long double slit = a == 0 ? 1 : sinl(a) / a;
    const long double want = slit * slit * array_l(s.count, f);
    return stability_off(multislit_power(&s, u, l), want, 1 + s.count * fabsl(f));
}

static double remainder_of(const double *x, uint64_t seed)
{
    (void)seed;
    const int order = (int)x[1];
    const long double log_want = (order + 1) * logl(x[0]) - lgammal(order + 2);
    const double got = taylor_remainder(x[0], order);
    if (log_want > 700)
        return got > 1e300 ? 0 : NAN; // beyond what a double holds
    return stability_off(got, expl(log_want), expl(log_want) + DBL_MIN) / (order + 1);
}

static double order_of(const double *x, uint64_t seed)
{
    (void)seed;
    const int n = taylor_order(x[0], x[1]);
    const long double l = logl(x[0]), at = logl(x[1]);
    const long double here = (n + 1) * l - lgammal(n + 2), before = n * l - lgammal(n + 1);
    // the least: one less is not enough
    return n >= 0 && here <= at + 1e-9L && (n == 0 || before > at - 1e-9L) ? 0 : NAN;
}

// One sample of a padded transform, read between its bins.
static double taps_of(const double *x, uint64_t seed)
{
    (void)seed;
    const int n = 4 * (int)x[0], fine = 2 * n, o = (int)floor((x[1] - 0.5) * n);
    const double f = 0.5 * (2 * x[2] - 1), c = taps_correction(fine, o);
    float w[TAPS];
    const int first = taps_first(fine, f);
    taps_weights(fine, f, w);
    long double re = 0, im = 0;
    for (int t = 0; t < TAPS; t++) {
        const long double phase = 2 * pi_l * o * (long double)(first + t) / fine;
        re += c * (long double)w[t] * cosl(phase);
        im += c * (long double)w[t] * sinl(phase);
    }
    const long double phase = 2 * pi_l * o * (long double)f;
    return stability_worse(stability_off((double)re, cosl(phase), 1),
                           stability_off((double)im, sinl(phase), 1));
}

static double fold_of(const double *x, uint64_t seed)
{
    (void)seed;
    const double f = taps_fold(x[0]);
    return fabs(f) <= 0.5 ? stability_off(f, x[0] - rintl(x[0]), 1) : NAN;
}

// Weights integrate, and rows interpolate, the powers that they must.
static double nodes_of(const double *x, uint64_t seed)
{
    (void)seed;
    struct wnodes q;
    const int n = (int)x[0];
    const double lo = x[1], hi = lo * (1 + x[2]);
    if (!(hi > lo * (1 + 1e-9)))
        return 0;
    wnodes_init(&q, n, lo, hi);
    double *row = calloc((size_t)n, sizeof *row), worst = 0;
    const int power = (int)(seed % (unsigned)n);
    long double sum = 0, mean = 0, value = 0;
    const double at = lo + (hi - lo) * x[3];
    const long double t = ((long double)at - lo) / ((long double)hi - lo);
    wnodes_at(&q, at, row);
    for (int k = 0; k < n; k++) {
        const long double s = ((long double)q.w[k] - lo) / ((long double)hi - lo);
        sum += q.weight[k];
        mean += q.weight[k] * powl(s, 2 * power + 1);
        value += row[k] * powl(s, power);
    }
    const double grain = 1 + 1e-3 * lo / (hi - lo); // digits of w that the interval has
    worst = stability_off((double)sum, 1, 1);
    worst = stability_worse(worst, stability_off((double)mean, 1 / (2.0L * power + 2), grain));
    worst = stability_worse(worst, stability_off((double)value, powl(t, power), grain * n));
    free(row);
    wnodes_finish(&q);
    return worst;
}

static double rainbow_of(const double *x, uint64_t seed)
{
    (void)seed;
    const struct rainbow r = {x[0], x[1], {1, 0.5, 0.25}};
    double rgb[3], worst = 0;
    rainbow_rgb(&r, x[2], x[3], rgb);
    const long double um = fabsl(x[2]) * (long double)x[0] * 1e6L, q = x[1] * um / x[3];
    static const long double peak[3] = {0.75L, 0.5L, 0.25L};
    for (int c = 0; c < 3; c++) {
        long double want = x[1] > 0 ? r.highlight[c] * expl(-q * q) : 0;
        for (int n = 1; n < 8; n++) {
            const long double b = 4 * (2 * um / n - 1 - peak[c]);
            want += fmaxl(0, 1 - b * b);
        }
        worst = stability_worse(worst, stability_off(rgb[c], want, 1));
    }
    return worst;
}

static double zonal_of(const double *x, uint64_t seed)
{
    const struct fresnel f = {seed % 2, x[0]};
    const double c = 2 * x[1] - 1;
    const long double s = 1 + (long double)c, lost = 1 - sqrtl(s / 2);
    const long double one = s * s,
                      want = f.schlick ? one * (f.r0 + (1 - f.r0) * powl(lost, 5)) / f.r0 : one;
    return stability_off(zonal_weight(&f, c), want, want + DBL_MIN);
}

static double filters_of(const double *x, uint64_t seed)
{
    struct lut_filters f = {.n = (int)x[0]};
    double noise[LUT_FILTERS], sum = 0, line = 0, most = 1;
    stability_noise(seed, LUT_FILTERS, noise);
    for (int k = 0; k < f.n; k++)
        f.lambda_m[k] =
            (k ? f.lambda_m[k - 1] : 380e-9) + 5e-9 + fmin(20e-9, 5e-9 * fabs(noise[k]));
    const double l = 380e-9 + 400e-9 * x[1];
    for (int k = 0; k < f.n; k++) {
        const double w = lut_filters_weight(&f, k, l);
        sum += w;
        line += w / f.lambda_m[k];
        most = fmax(most, fabs(w));
    }
    // a pattern that is constant, or straight over 1/lambda, is followed exactly
    const double worst = stability_off(sum, 1, most);
    return f.n < 2 ? worst : stability_worse(worst, stability_off(line * l, 1, 10 * most));
}

static double snap_of(const double *x, uint64_t seed)
{
    (void)seed;
    const double once = exposure_snap(x[0]), twice = exposure_snap(once);
    if (!(fabs(log(once / x[0])) < 0.1))
        return NAN;
    return stability_off(twice, once, once);
}

static double stencil_of(const double *x, uint64_t seed)
{
    (void)seed;
    const struct table t = {.n = (int)x[0], .range = x[1], .power = 1};
    const double u = (2 * x[2] - 1) * t.range;
    double w[STENCIL], sum = 0;
    int first;
    if (!table_stencil(&t, u, &first, w))
        return fabs(u) > t.range ? 0 : NAN;
    long double at = 0;
    for (int k = 0; k < STENCIL; k++) {
        sum += w[k];
        at += w[k] * (first + k);
    }
    const long double want = ((long double)u / t.range + 1) / 2 * (t.n - 1);
    return stability_worse(stability_off(sum, 1, 1), stability_off((double)at, want, t.n));
}

const struct stability_probe stability_process[] = {
    {"bspline_weights_3, and in double", 3e-7, "1 (double 1e-8)", 1, weights_3, {{AT_UNIT, 0, 1}}},
    {"bspline_weights_5", 3e-7, "1", 1, weights_5, {{AT_UNIT, 0, 1}}},
    {"bspline_basis", 1e-14, "1", 1, basis_of, {{AT_SIGNED, 1e-320, 1e300}}},
    {"bspline_gain", 1e-14, "the gain", 1, gain_of, {{AT_COUNT, 1, 1e6}, {AT_COUNT, 1, 1e6}}},
    {"bessel_j", 1e-13, "1", 20, bessel, {{AT_LOG, 1e-320, 2000}, {AT_COUNT, 1, 250}}},
    {"array_factor", 1e-8, "1", 1, array_of, {{AT_COUNT, 1, 1e6}, {AT_SIGNED, 1e-320, 1e4}}},
    {"multislit_power",
     1e-14,
     "1 + phases",
     2,
     multislit_of,
     {{AT_LOG, 1e-9, 1},
      {AT_UNIT, 0, 1},
      {AT_COUNT, 1, 1e6},
      {AT_SIGNED, 1e-320, 2},
      {AT_UNIT, 0, 1}}},
    {"taylor_remainder",
     1e-14,
     "the remainder, per order",
     4,
     remainder_of,
     {{AT_LOG, 1e-300, 1e5}, {AT_COUNT, 1, 500}}},
    {"taylor_order", 0, "-", 20, order_of, {{AT_LOG, 1e-12, 2e4}, {AT_LOG, 1e-15, 1}}},
    {"taps_weights, _correction",
     1e-6,
     "1",
     8,
     taps_of,
     {{AT_COUNT, 1, 500}, {AT_UNIT, 0, 1}, {AT_UNIT, 0, 1}}},
    {"taps_fold", 0, "1", 1, fold_of, {{AT_SIGNED, 1e-320, 1e300}}},
    {"wnodes",
     1e-12,
     "1, on its interval",
     100,
     nodes_of,
     {{AT_COUNT, 2, 64}, {AT_LOG, 1e-3, 2}, {AT_LOG, 1e-6, 1e3}, {AT_UNIT, 0, 1}}},
    {"rainbow_rgb",
     1e-12,
     "1",
     1,
     rainbow_of,
     {{AT_LOG, 1e-12, 1}, {AT_LOG, 1e-300, 1e9}, {AT_SIGNED, 1e-320, 2}, {AT_LOG, 1e-150, 2}}},
    {"zonal_weight", 1e-12, "the weight", 1, zonal_of, {{AT_LOG, 1e-12, 1}, {AT_UNIT, 0, 1}}},
    {"lut_filters_weight",
     1e-12,
     "the largest weight",
     8,
     filters_of,
     {{AT_COUNT, 1, 16}, {AT_UNIT, 0, 1}}},
    {"exposure_snap", 1e-15, "the time", 1, snap_of, {{AT_LOG, 1e-12, 1e6}}},
    {"table_stencil",
     1e-13,
     "1, or nodes",
     1,
     stencil_of,
     {{AT_COUNT, 2, 65536}, {AT_LOG, 1e-300, 2}, {AT_UNIT, 0, 1}}},
    {0},
};
