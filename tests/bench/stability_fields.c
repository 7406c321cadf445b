// stability_fields.c - what works on arrays: transforms, splines, SVD, solvers, blur,
// deconvolution, merging, holes, factors, tables.
#define _GNU_SOURCE
#include "calib/normal.h"
#include "core/mem.h"
#include "process/bspline.h"
#include "process/deconvolve.h"
#include "process/factor.h"
#include "process/fft.h"
#include "process/fill.h"
#include "process/hdr.h"
#include "process/lut.h"
#include "process/svd.h"
#include "tests/bench/stability.h"
#include <complex.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 16, NODES = SIDE * SIDE };

// A forward transform against the sum that it stands for, and back again.
static double fft_of(const double *x, uint64_t seed)
{
    const int n = (int)x[0];
    struct err e;
    double worst = 0, noise[128];
    stability_noise(seed, 2 * n, noise);
    for (int type = 0; type < 2; type++) {
        const bool single = type == FFT_FLOAT;
        const double scale = single ? fmax(1e-30, fmin(1e30, x[1])) : x[1];
        struct fft *to = fft_new(FFT_FORWARD, (enum fft_type)type, 1, n, 1, false, &e);
        struct fft *from = fft_new(FFT_BACKWARD, (enum fft_type)type, 1, n, 1, false, &e);
        const size_t size = single ? sizeof(float) : sizeof(double);
        void *a = sample_alloc(2 * (size_t)n, size, "samples", &e),
             *b = sample_alloc(2 * (size_t)n, size, "samples", &e),
             *c = sample_alloc(2 * (size_t)n, size, "samples", &e);
        for (int k = 0; k < 2 * n; k++)
            if (single)
                ((float *)a)[k] = (float)(scale * noise[k]);
            else
                ((double *)a)[k] = scale * noise[k];
#define AT(p, k) (single ? (double)((float *)(p))[k] : ((double *)(p))[k])
        fft_run(to, a, b);
        fft_run(from, b, c);
        long double power = 0;
        for (int k = 0; k < 2 * n; k++)
            power += powl(AT(a, k) / scale, 2);
        const long double norm = scale * sqrtl(power * n), digits = single ? 1 : 1e-8L;
        const int f = (int)(seed % (unsigned)n);
        long double complex sum = 0;
        for (int k = 0; k < n; k++)
            sum += (AT(a, 2 * k) + AT(a, 2 * k + 1) * (long double complex)I) *
                   cexpl(-2 * 3.14159265358979323846264338328L * I *
                         (long double)((long)k * f % n) / n);
        worst = stability_worse(worst, stability_off(AT(b, 2 * f), creall(sum), norm * digits));
        worst = stability_worse(worst, stability_off(AT(b, 2 * f + 1), cimagl(sum), norm * digits));
        for (int k = 0; k < 2 * n; k++)
            worst = stability_worse(
                worst, stability_off(AT(c, k), (long double)AT(a, k) * n, norm * digits));
#undef AT
        free(a);
        free(b);
        free(c);
        fft_free(to);
        fft_free(from);
    }
    return worst;
}

// A fitted line passes through its samples.
static double fit_of(const double *x, uint64_t seed)
{
    const int n = (int)x[0], degree = seed % 2 ? BSPLINE_CUBIC : BSPLINE_QUINTIC;
    double noise[256], worst = 0, line[256];
    float px[256];
    stability_noise(seed, n, noise);
    const double scale = fmin(x[1], 1e34);
    for (int k = 0; k < n; k++)
        line[k] = (double)(px[k] = (float)(scale * fmax(-3, fmin(3, noise[k]))));
    double sample[256];
    memcpy(sample, line, sizeof sample);
    bspline_fit_line(line, n, degree);
    bspline_fit_rows(px, n, 1, degree);
    for (int k = 0; k < n; k++) {
        long double sum = 0, single = 0;
        for (int m = -2; m <= 2; m++) {
            const long double w = bspline_basis(degree, m);
            sum += w * line[bspline_mirror(k + m, n)];
            single += w * px[bspline_mirror(k + m, n)];
        }
        worst = stability_worse(worst, stability_off((double)sum, sample[k], scale * 1e-8L));
        worst = stability_worse(worst, stability_off((double)single, sample[k], scale + 1e-26L));
    }
    return worst;
}

// Any matrix, from one of equal to one of widely spread singular values, is what its parts say.
static double svd_of(const double *x, uint64_t seed)
{
    const int m = (int)x[0], n = (int)x[1], r = m < n ? m : n;
    double a[144], copy[144], u[144], s[12], vt[144], noise[144 + 24], worst = 0;
    struct err e;
    stability_noise(seed, m * n, noise);
    for (int i = 0; i < m; i++)
        for (int j = 0; j < n; j++)
            copy[i * n + j] = a[i * n + j] =
                x[2] * noise[i * n + j] * pow(x[3], (double)(i + j) / (m + n));
    if (!svd(m, n, a, u, s, vt, &e))
        return NAN;
    for (int i = 0; i < m; i++)
        for (int j = 0; j < n; j++) {
            long double sum = 0;
            for (int k = 0; k < r; k++)
                sum += (long double)u[i * r + k] * s[k] * vt[k * n + j];
            worst = stability_worse(
                worst, stability_off((double)(sum / s[0]), copy[i * n + j] / (long double)s[0], 1));
        }
    for (int p = 0; p < r; p++)
        for (int q = 0; q <= p; q++) {
            long double sum = 0;
            for (int i = 0; i < m; i++)
                sum += (long double)u[i * r + p] * u[i * r + q];
            worst = stability_worse(worst, stability_off((double)sum, p == q, 1));
        }
    return worst;
}

// Least squares with columns as alike as one likes: solved, or refused with its reason.
static double normal_of(const double *x, uint64_t seed)
{
    enum { N = 4, ROWS = 12 };
    static const int at[N] = {0, 1, 2, 3};
    double noise[N * ROWS], want[N] = {1, -2, 3, -4}, out[N], inverse[N], worst = 0;
    struct normal s;
    struct err e;
    stability_noise(seed, N * ROWS, noise);
    normal_init(&s, N);
    for (int k = 0; k < ROWS; k++) {
        double row[N];
        long double y = 0;
        for (int c = 0; c < N; c++) {
            row[c] = x[0] * noise[k * N + c];
            if (c == N - 1) // nearly the one before
                row[c] = row[c - 1] + x[1] * row[c];
            y += (long double)row[c] * want[c];
        }
        normal_add(&s, N, at, row, (double)y, x[2]);
    }
    const bool solved = normal_solve(&s, out, inverse, &e);
    for (int c = 0; solved && c < N; c++) {
        // digits lost to the square of the condition, here about 1/x[1]
        worst = stability_worse(worst, stability_off(out[c], want[c], 1 + 1 / (x[1] * x[1])));
        worst = stability_worse(worst, inverse[c] > 0 ? 0 : NAN);
    }
    normal_finish(&s);
    if (!solved) // no system that is well determined is refused
        return x[1] < 1e-5 ? 0 : NAN;
    return worst;
}

// Light is kept, nothing becomes negative, an even picture stays.
static double deconvolve_of(const double *x, uint64_t seed)
{
    float data[NODES], out[NODES];
    double noise[NODES];
    struct err e;
    stability_noise(seed, NODES, noise);
    for (int k = 0; k < NODES; k++) {
        const double v = seed % 4 == 0 ? 1 : exp(x[1] * noise[k]);
        data[k] = (float)fmin(3e37, x[0] * fmin(v, 1e20));
    }
    struct blur *b = blur_gauss(SIDE, SIDE, 0.3 + 3.5 * x[2], &e);
    const struct deconvolve_options opt = {.iterations = 1 + (int)(seed % 6),
                                           .accelerate = seed % 3 == 0};
    struct deconvolve_result res;
    double worst = b && deconvolve(b, SIDE, SIDE, data, &opt, out, &res, &e) ? 0 : NAN;
    blur_free(b);
    long double in = 0, sum = 0;
    for (int k = 0; k < NODES && !isnan(worst); k++) {
        in += data[k];
        sum += out[k];
        if (!(out[k] >= 0))
            worst = NAN;
        else if (seed % 4 == 0)
            worst = stability_worse(
                worst, stability_off((double)out[k], data[k], 10 * (long double)data[k]));
    }
    return stability_worse(worst, stability_off((double)(sum / in), 1, 1));
}

static double blur_of(const double *x, uint64_t seed)
{
    float data[NODES], out[NODES];
    double noise[NODES];
    struct err e;
    stability_noise(seed, NODES, noise);
    for (int k = 0; k < NODES; k++)
        data[k] = (float)(fmin(x[0], 1e37) * (seed % 3 ? noise[k] : 1));
    struct blur *b = blur_gauss(SIDE, SIDE, fmax(1e-3, 3.9 * x[1]), &e);
    if (!b)
        return NAN;
    blur_apply(b, data, out);
    blur_free(b);
    long double in = 0, sum = 0;
    double worst = 0;
    for (int k = 0; k < NODES; k++) {
        in += data[k];
        sum += out[k];
        if (!(seed % 3))
            worst = stability_worse(worst, stability_off((double)out[k], data[k], x[0] + FLT_MIN));
        worst = stability_worse(worst, isfinite(out[k]) ? 0 : NAN);
    }
    return stability_worse(worst,
                           stability_off((double)sum, in, NODES * ((long double)x[0] + FLT_MIN)));
}

// A scene without noise comes back from any bracket that measured it: exactly, or within the sigma
// that the merge states where saturation is a matter of likelihood.
static double merge_of(const double *x, uint64_t seed)
{
    enum { FRAMES = 4 };
    float px[FRAMES][NODES];
    double noise[NODES], worst = 0;
    const float *frame[FRAMES];
    double time_s[FRAMES];
    struct image out = {0};
    struct hdr_counts counts;
    struct err e;
    stability_noise(seed, NODES, noise);
    for (int f = 0; f < FRAMES; f++) {
        time_s[f] = x[0] * pow(1.1 + 7 * x[1], f);
        for (int k = 0; k < NODES; k++)
            px[f][k] = (float)fmin(4095, 100 * exp(2 * noise[k]) * (time_s[f] / x[0]));
        frame[f] = px[f];
    }
    const struct hdr_frames h = {FRAMES, SIDE, SIDE, 1, frame, time_s, 4095, {x[2] * x[2], x[3]}};
    const enum hdr_method method = (enum hdr_method)(seed % 3);
    if (!hdr_merge(&h, method, &out, &counts, &e))
        return NAN;
    const int nc = out.nc;
    for (int k = 0; k < NODES; k++) {
        const double want = 100 * exp(2 * noise[k]) / x[0];
        const float *p = out.px + (size_t)k * (size_t)nc;
        if (!isfinite(p[0]) || !isfinite(p[1]) || p[1] < 0)
            worst = NAN;
        else if (p[nc - 1] > 0 && want * x[0] < 1000 && method == HDR_POISSON)
            worst = stability_worse(
                worst, stability_off((double)p[0], want, want + 2.5e5 * sqrt((double)p[1])));
    }
    image_finish(&out);
    return worst;
}

// A plane with holes becomes the plane.
static double fill_of(const double *x, uint64_t seed)
{
    struct hfield hf;
    struct err e;
    long filled;
    double noise[NODES], worst;
    const double scale = fmin(x[0], 1e35);
    stability_noise(seed, NODES, noise);
    if (!hfield_init(&hf, SIDE, SIDE, 1e-6, 1e-6, &e))
        return NAN;
    for (int k = 0; k < NODES; k++) {
        const int i = k % SIDE, j = k / SIDE;
        const bool rim = i == 0 || j == 0 || i == SIDE - 1 || j == SIDE - 1;
        hf.z[k] = !rim && noise[k] > 1.5 * x[1] ? NAN : (float)(scale * (i - 2 * j));
    }
    worst = hfield_fill(&hf, &filled, &e) ? 0 : NAN;
    for (int k = 0; k < NODES; k++)
        worst = stability_worse(worst,
                                stability_off((double)hf.z[k], scale * (k % SIDE - 2 * (k / SIDE)),
                                              32 * (long double)scale + FLT_MIN));
    hfield_finish(&hf);
    return worst;
}

// A table of rank one is its two filters, whatever its scale.
static double factor_of(const double *x, uint64_t seed)
{
    enum { N = 9 };
    struct table t;
    struct factors f;
    struct err e;
    double noise[2 * N];
    const double scale = fmax(1e-18, fmin(1e18, x[0]));
    stability_noise(seed, 2 * N, noise);
    if (!table_init(&t, N, 0.5, 1, 1, &e))
        return NAN;
    t.is_rgb = true;
    for (int k = 0; k < N * N; k++)
        for (int c = 0; c < 3; c++)
            t.tab[3 * k + c] = (float)(scale * fabs(noise[k % N] * noise[N + k / N]));
    double worst = factor(&f, &t, 1, false, false, &e) ? 0 : NAN;
    if (!isnan(worst)) {
        for (int c = 0; c < 4; c++)
            worst = stability_worse(worst, stability_off(f.error[c], 0, 1));
        for (int k = 0; k < 3 * N; k++)
            worst = stability_worse(worst, isfinite(f.f[0][k]) && isfinite(f.f[1][k]) ? 0 : NAN);
        factors_finish(&f);
    }
    table_finish(&t);
    return worst;
}

// A pattern times c has the table times c.
static double lut_of(const double *x, uint64_t seed)
{
    enum { N = 9 };
    double lambda[2] = {380e-9, 780e-9}, one[2] = {1, 1};
    const struct spectrum even = {2, lambda, one};
    struct image im;
    struct lut_pattern p[2];
    struct table t[2] = {{0}};
    struct lut_report report;
    struct err e;
    double noise[NODES], worst = 0;
    const double scale[2] = {1, fmax(1e-25, fmin(1e25, x[0]))};
    stability_noise(seed, NODES, noise);
    for (int s = 0; s < 2; s++) {
        if (!image_init(&im, SIDE, SIDE, 1, &e))
            return NAN;
        for (int k = 0; k < NODES; k++)
            im.px[k] = (float)(scale[s] * fabs(noise[k]));
        const bool ok = lut_pattern_init(&p[s], &im, 0, 1, &e);
        image_finish(&im);
        if (!ok)
            return NAN;
        p[s].h_per_px = x[1];
        p[s].cx = p[s].cy = 0.5 * (SIDE - 1);
        const struct lut_request r = {.pattern = &p[s],
                                      .lambda_m = 530e-9,
                                      .light = &even,
                                      .f0 = 1,
                                      .exponent = 2,
                                      .n = N,
                                      .range = fmin(2, 5 * x[1]),
                                      .power = 1,
                                      .method = seed % 2 ? LUT_EXACT : LUT_SAMPLED,
                                      .tolerance = 1e-3};
        if (!lut_build(&r, &t[s], &report, &e))
            worst = NAN;
    }
    double most = 0;
    for (int k = 0; k < 3 * N * N && !isnan(worst); k++)
        most = fmax(most, fabs((double)t[0].tab[k]));
    for (int k = 0; k < 3 * N * N && !isnan(worst); k++)
        worst = stability_worse(
            worst, stability_off((double)t[1].tab[k] / scale[1], (double)t[0].tab[k], most));
    for (int s = 0; s < 2; s++) {
        table_finish(&t[s]);
        lut_pattern_finish(&p[s]);
    }
    return worst;
}

const struct stability_probe stability_fields[] = {
    {"fft, both precisions",
     3e-6,
     "the norm (double 1e-8)",
     200,
     fft_of,
     {{AT_COUNT, 1, 63}, {AT_LOG, 1e-290, 1e290}}},
    {"bspline_fit",
     1e-5,
     "the largest (double 1e-8)",
     40,
     fit_of,
     {{AT_COUNT, 1, 250}, {AT_LOG, 1e-40, 1e36}}},
    {"svd",
     1e-13,
     "the first singular value",
     400,
     svd_of,
     {{AT_COUNT, 1, 12}, {AT_COUNT, 1, 12}, {AT_LOG, 1e-250, 1e250}, {AT_LOG, 1e-30, 1}}},
    {"normal_solve",
     1e-12,
     "1 + condition squared",
     20,
     normal_of,
     {{AT_LOG, 1e-60, 1e60}, {AT_LOG, 1e-16, 1}, {AT_LOG, 1e-20, 1e20}}},
    {"deconvolve",
     1e-5,
     "the flux",
     2000,
     deconvolve_of,
     {{AT_LOG, 1e-30, 1e30}, {AT_LOG, 1e-6, 10}, {AT_UNIT, 0, 1}}},
    {"blur_gauss", 1e-6, "the largest", 400, blur_of, {{AT_LOG, 1e-38, 1e37}, {AT_UNIT, 0, 1}}},
    {"hdr_merge",
     4e-6,
     "the radiance, 2.5e5 sigma",
     400,
     merge_of,
     {{AT_LOG, 1e-12, 1e12}, {AT_UNIT, 0, 1}, {AT_LOG, 1e-6, 100}, {AT_LOG, 1e-6, 100}}},
    {"hfield_fill",
     1e-5,
     "the largest height",
     2000,
     fill_of,
     {{AT_LOG, 1e-36, 1e35}, {AT_UNIT, 0, 1}}},
    {"factor", 1e-5, "the table", 400, factor_of, {{AT_LOG, 1e-18, 1e18}}},
    {"lut_build",
     1e-4,
     "the largest value",
     20000,
     lut_of,
     {{AT_LOG, 1e-25, 1e25}, {AT_LOG, 1e-4, 0.3}}},
    {0},
};
