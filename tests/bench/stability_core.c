// stability_core.c - vectors, frames, spectra, colour, quantities, tables between nodes.
#define _GNU_SOURCE
#include "core/geom.h"
#include "core/mem.h"
#include "core/spectrum.h"
#include "core/table.h"
#include "core/units.h"
#include "process/level.h"
#include "process/roughness.h"
#include "tests/bench/stability.h"
#include <float.h>
#include <stdio.h>
#include <stdlib.h>

static long double norm_l(const double *x)
{
    return hypotl(hypotl(x[0], x[1]), x[2]);
}

static double norm_of(const double *x, uint64_t seed)
{
    (void)seed;
    const long double want = norm_l(x); // a denormal result is off by its own grain
    return want > DBL_MAX ? 0 : stability_off(v3_norm(v3(x[0], x[1], x[2])), want, want + DBL_MIN);
}

static double unit_of(const double *x, uint64_t seed)
{
    (void)seed;
    const long double n = norm_l(x);
    if (n < DBL_TRUE_MIN || n > DBL_MAX)
        return 0;
    const struct vec3 u = v3_unit(v3(x[0], x[1], x[2]));
    double worst = stability_off(u.x, x[0] / n, 1);
    worst = stability_worse(worst, stability_off(u.y, x[1] / n, 1));
    return stability_worse(worst, stability_off(u.z, x[2] / n, 1));
}

static double frame_of(const double *x, uint64_t seed)
{
    (void)seed;
    struct frame f;
    const long double nt = norm_l(x), nn = norm_l(x + 3);
    if (nt > DBL_MAX || nn > DBL_MAX)
        return 0;
    if (!frame_from(v3(x[0], x[1], x[2]), v3(x[3], x[4], x[5]), &f)) {
        long double sine = 0; // a refusal must have its reason
        for (int k = 0; k < 3 && nt > 0 && nn > 0; k++) {
            const int a = (k + 1) % 3, b = (k + 2) % 3;
            const long double c = x[a] / nt * (x[3 + b] / nn) - x[b] / nt * (x[3 + a] / nn);
            sine += c * c;
        }
        return sqrtl(sine) < 1.1e-6L ? 0 : NAN;
    }
    double worst = stability_off(v3_dot(f.t, f.n), 0, 1);
    worst = stability_worse(worst, stability_off(v3_dot(f.b, f.n), 0, 1));
    worst = stability_worse(worst, stability_off(v3_norm(f.t), 1, 1));
    worst = stability_worse(worst, stability_off(v3_norm(f.b), 1, 1));
    for (int k = 0; k < 3; k++)
        worst = stability_worse(worst, stability_off((&f.n.x)[k], x[3 + k] / nn, 1));
    return worst;
}

static struct vec3 direction(double cosine, double turn)
{
    const double sine = sqrt((1 - cosine) * (1 + cosine)), ph = 2 * M_PI * turn;
    return v3(sine * cos(ph), sine * sin(ph), cosine);
}

static double latlong(const double *x, uint64_t seed)
{
    const int w = (int)x[2], h = (int)x[3];
    const struct vec3 d = direction(seed % 2 ? x[0] : -x[0], x[1]);
    double col, row;
    latlong_pixel(d, w, h, &col, &row);
    const struct vec3 back = latlong_dir(col, row, w, h);
    return stability_off(v3_norm(v3_sub(back, d)), 0, 1);
}

static double spectrum_between(const double *x, uint64_t seed)
{
    const double at[3] = {380e-9, 380e-9 + 400e-9 * x[1], 780e-9}, l = 370e-9 + 420e-9 * x[0];
    double noise[3];
    stability_noise(seed, 3, noise);
    if (!(at[1] > at[0] && at[1] < at[2]))
        return 0;
    double lambda[3] = {at[0], at[1], at[2]}, value[3];
    for (int k = 0; k < 3; k++)
        value[k] = x[2] * fabs(noise[k]);
    const struct spectrum s = {3, lambda, value};
    const int k = l >= at[1];
    const bool inside = l >= at[0] && l <= at[2];
    const long double f = ((long double)l - at[k]) / ((long double)at[k + 1] - at[k]);
    const double got = spectrum_at(&s, l), most = fmax(value[0], fmax(value[1], value[2]));
    if (!inside) // a little beyond the ends still counts
        return isfinite(got) && got >= 0 && got <= most ? 0 : NAN;
    return stability_off(got, value[k] + f * ((long double)value[k + 1] - value[k]),
                         most + DBL_MIN) *
           fmin(1, (at[k + 1] - at[k]) / 1e-9); // steps under a nanometre have fewer digits of l
}

static double light_scale(const double *x, uint64_t seed)
{
    double lambda[2] = {380e-9, 780e-9}, value[2] = {x[0], x[0]};
    const struct spectrum s = {2, lambda, value};
    double one[2] = {1, 1};
    const struct spectrum even = {2, lambda, one};
    (void)seed;
    const long double want = (long double)illuminant_scale(&even) / x[0];
    return want > DBL_MAX ? 0 : stability_off(illuminant_scale(&s), want, want);
}

static double colour_there_and_back(const double *x, uint64_t seed)
{
    (void)seed;
    double rgb[3], back[3], worst = 0;
    const double most = fmax(fabs(x[0]), fmax(fabs(x[1]), fabs(x[2])));
    xyz_to_rgb(x, rgb);
    rgb_to_xyz(rgb, back);
    for (int c = 0; c < 3; c++)
        worst = stability_worse(worst, stability_off(back[c], x[c], most + DBL_MIN));
    return worst;
}

static double srgb_there_and_back(const double *x, uint64_t seed)
{
    (void)seed;
    return stability_off(srgb_encode(srgb_decode(x[0])), x[0], 1);
}

static double quantity_there_and_back(const double *x, uint64_t seed)
{
    (void)seed;
    char text[64];
    struct err e;
    double got = NAN;
    snprintf(text, sizeof text, "%.17gnm", x[0]);
    if (!quantity_parse(text, UNIT_M, &got, &e))
        return NAN;
    return stability_off(got, x[0] * 1e-9L, fabsl(x[0] * 1e-9L) + DBL_MIN);
}

static double node_there_and_back(const double *x, uint64_t seed)
{
    (void)seed;
    const int power = 2 * (int)x[2] - 1;
    const struct table t = {.n = (int)x[0], .range = x[1], .power = power};
    const double u = (2 * x[3] - 1) * t.range, at = table_index(&t, u);
    const long double s = 2.0L * at / (t.n - 1) - 1;
    return stability_off(isnan(at) ? NAN : (double)(t.range * copysignl(powl(fabsl(s), power), s)),
                         u, (long double)t.range * power);
}

static double table_between(const double *x, uint64_t seed)
{
    enum { N = 5 };
    float tab[N * N * 3];
    double noise[N * N * 3], out[3], worst = 0;
    struct table t = {.n = N, .range = x[0], .power = 1, .count = 1, .tab = tab};
    stability_noise(seed, N * N * 3, noise);
    for (int k = 0; k < N * N * 3; k++)
        tab[k] = (float)(x[1] * fmax(-1, fmin(1, noise[k])));
    const double u = (2 * x[2] - 1) * t.range, v = (2 * x[3] - 1) * t.range;
    const long double i = ((long double)u / t.range + 1) * 0.5L * (N - 1);
    const long double j = ((long double)v / t.range + 1) * 0.5L * (N - 1);
    const int i0 = (int)fminl(N - 2, floorl(i)), j0 = (int)fminl(N - 2, floorl(j));
    const long double fx = i - i0, fy = j - j0;
    table_eval(&t, u, v, 2, 0, out);
    for (int c = 0; c < 3; c++) {
        const float *a = tab + (j0 * N + i0) * 3 + c, *b = a + N * 3;
        const long double want =
            (1 - fy) * ((1 - fx) * a[0] + fx * a[3]) + fy * ((1 - fx) * b[0] + fx * b[3]);
        worst = stability_worse(worst, stability_off(out[c], want, x[1]));
    }
    return worst;
}

static struct hfield *field(uint64_t seed, double scale, double offset)
{
    enum { N = 12 };
    struct hfield *hf = xcalloc(1, sizeof *hf);
    struct err e;
    double noise[N * N];
    stability_noise(seed, N * N, noise);
    if (!hfield_init(hf, N, N, 1e-7, 1e-7, &e))
        abort();
    for (int k = 0; k < N * N; k++)
        hf->z[k] = (float)(offset + scale * fmax(-3, fmin(3, noise[k])));
    return hf;
}

static void drop(struct hfield *hf)
{
    hfield_finish(hf);
    free(hf);
}

static double roughness_of(const double *x, uint64_t seed)
{
    struct hfield *hf = field(seed, x[0], x[1]);
    struct roughness r;
    struct err e;
    const int n = hf->nx * hf->ny;
    long double mean = 0, two = 0, three = 0, four = 0;
    for (int k = 0; k < n; k++)
        mean += (long double)hf->z[k] / n;
    for (int k = 0; k < n; k++) {
        const long double d = hf->z[k] - mean;
        two += d * d / n;
        three += d * d * d / n;
        four += d * d * d * d / n;
    }
    double worst = NAN, lo, hi;
    if (hfield_roughness(&r, hf, &e) && hfield_range(hf, &lo, &hi)) {
        // of heights on a pedestal only the digits above its rounding are there
        const long double sq = sqrtl(two), grain = fmaxl(1, fabsl(mean) / (sq + 1e-300L));
        worst = stability_off(r.sq_m, sq, (sq + 1e-300L) * grain);
        if (lo < hi) {
            worst = stability_worse(worst, stability_off(r.ssk, three / (two * sq), 10 * grain));
            worst = stability_worse(worst, stability_off(r.sku, four / (two * two), 10 * grain));
        }
    }
    drop(hf);
    return worst;
}

static double level_of(const double *x, uint64_t seed)
{
    struct hfield *hf = field(seed, x[0], 0);
    struct form f;
    struct err e;
    for (int j = 0; j < hf->ny; j++)
        for (int i = 0; i < hf->nx; i++)
            hf->z[j * hf->nx + i] = (float)(x[1] * i + x[2] * j);
    const double most = fmax(fabs(x[1]), fabs(x[2])) * hf->nx;
    double worst = form_fit(&f, hf, 1 + (int)(seed % 2), &e) ? 0 : NAN;
    for (int j = 0; j < hf->ny; j++)
        for (int i = 0; i < hf->nx; i++)
            worst = stability_worse(
                worst,
                stability_off(form_at(&f, i, j), (long double)x[1] * i + x[2] * j, most + FLT_MIN));
    drop(hf);
    return worst;
}

#define HUGE_TINY 1e-320, 1e300
const struct stability_probe stability_core[] = {
    {"v3_norm",
     1e-15,
     "the norm",
     1,
     norm_of,
     {{AT_SIGNED, HUGE_TINY}, {AT_SIGNED, HUGE_TINY}, {AT_SIGNED, HUGE_TINY}}},
    {"v3_unit",
     1e-15,
     "1",
     1,
     unit_of,
     {{AT_SIGNED, HUGE_TINY}, {AT_SIGNED, HUGE_TINY}, {AT_SIGNED, HUGE_TINY}}},
    {"frame_from",
     1e-9,
     "1",
     2,
     frame_of,
     {{AT_SIGNED, HUGE_TINY},
      {AT_SIGNED, HUGE_TINY},
      {AT_SIGNED, HUGE_TINY},
      {AT_SIGNED, HUGE_TINY},
      {AT_SIGNED, HUGE_TINY},
      {AT_SIGNED, HUGE_TINY}}},
    {"latlong_pixel and _dir",
     1e-14,
     "1",
     2,
     latlong,
     {{AT_UNIT, 0, 1}, {AT_UNIT, 0, 1}, {AT_COUNT, 1, 65536}, {AT_COUNT, 1, 65536}}},
    {"spectrum_at",
     1e-12,
     "the largest value",
     1,
     spectrum_between,
     {{AT_UNIT, 0, 1}, {AT_UNIT, 0, 1}, {AT_LOG, 1e-300, 1e300}}},
    {"illuminant_scale", 1e-13, "the scale", 10, light_scale, {{AT_LOG, 1e-300, 1e300}}},
    {"xyz_to_rgb and back",
     1e-14,
     "the largest",
     1,
     colour_there_and_back,
     {{AT_SIGNED, 1e-320, 1e300}, {AT_SIGNED, 1e-320, 1e300}, {AT_SIGNED, 1e-320, 1e300}}},
    {"srgb_decode and _encode", 2e-7, "1", 1, srgb_there_and_back, {{AT_UNIT, 0, 1}}},
    {"quantity_parse", 1e-15, "the quantity", 4, quantity_there_and_back, {{AT_SIGNED, HUGE_TINY}}},
    {"table_index and _node",
     1e-14,
     "range times power",
     1,
     node_there_and_back,
     {{AT_COUNT, 2, 65536}, {AT_LOG, 1e-300, 2}, {AT_COUNT, 1, 50}, {AT_UNIT, 0, 1}}},
    {"table_eval",
     1e-14,
     "the largest value",
     4,
     table_between,
     {{AT_LOG, 1e-300, 2}, {AT_LOG, 1e-44, 3e38}, {AT_UNIT, 0, 1}, {AT_UNIT, 0, 1}}},
    {"hfield_roughness",
     1e-12,
     "sq, on its pedestal",
     20,
     roughness_of,
     {{AT_LOG, 1e-44, 1e37}, {AT_SIGNED, 1e-44, 1e37}}},
    {"form_fit",
     2e-6,
     "the largest height",
     40,
     level_of,
     {{AT_LOG, 1e-30, 1e30}, {AT_SIGNED, 1e-36, 1e36}, {AT_SIGNED, 1e-36, 1e36}}},
    {0},
};
