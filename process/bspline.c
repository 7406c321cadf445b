// bspline.c - B-spline coefficients by two passes of a recursive filter per pole.
#define _GNU_SOURCE
#include "process/bspline.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LANES = 16 }; // lines filtered side by side

// Poles of the inverse of the sampled basis (Unser 1999, table 1) and its gain.
static int poles_of(int degree, double z[2], double *gain)
{
    if (degree == BSPLINE_CUBIC) {
        z[0] = sqrt(3) - 2;
        *gain = 6;
        return 1;
    }
    z[0] = sqrt(135 / 2.0 - sqrt(17745 / 4.0)) + sqrt(105 / 4.0) - 13 / 2.0;
    z[1] = sqrt(135 / 2.0 + sqrt(17745 / 4.0)) - sqrt(105 / 4.0) - 13 / 2.0;
    *gain = 120;
    return 2;
}

enum { START_TERMS = 40 }; // of the mirrored start sum: 0.431^40 = 2e-15

void bspline_fit_line(double *c, int n, int degree)
{
    double z[2], gain;
    const int poles = poles_of(degree, z, &gain);
    if (n == 1)
        return;
    for (int i = 0; i < n; i++)
        c[i] *= gain;
    for (int p = 0; p < poles; p++) {
        double sum = c[0], power = 1;
        for (int k = 1; k < START_TERMS; k++)
            sum += (power *= z[p]) * c[bspline_mirror(k, n)];
        c[0] = sum;
        for (int i = 1; i < n; i++)
            c[i] += z[p] * c[i - 1];
        c[n - 1] = z[p] / (z[p] * z[p] - 1) * (c[n - 1] + z[p] * c[n - 2]);
        for (int i = n - 2; i >= 0; i--)
            c[i] = z[p] * (c[i + 1] - c[i]);
    }
}

// A filter that rings into a dark region must not end in denormal numbers, which are slow.
static inline float calm(float x)
{
    return fabsf(x) < 1e-32f ? 0 : x;
}

// c[n][LANES], n >= 2
__attribute__((target_clones("avx512f", "avx2", "default"))) static void fit_lanes(float *c, int n,
                                                                                   int degree)
{
    double z[2], gain;
    const int poles = poles_of(degree, z, &gain);
    for (int k = 0; k < n * LANES; k++)
        c[k] *= (float)gain;
    for (int p = 0; p < poles; p++) {
        const float pole = (float)z[p], end = (float)(z[p] / (z[p] * z[p] - 1));
        float sum[LANES] = {0}, power = 1;
        for (int k = 0; k < START_TERMS; k++, power *= pole)
            for (int q = 0; q < LANES; q++)
                sum[q] += power * c[bspline_mirror(k, n) * LANES + q];
        memcpy(c, sum, sizeof sum);
        for (float *row = c + LANES; row < c + n * LANES; row += LANES)
            for (int q = 0; q < LANES; q++)
                row[q] = calm(row[q] + pole * row[q - LANES]);
        float *last = c + (n - 1) * LANES;
        for (int q = 0; q < LANES; q++)
            last[q] = end * (last[q] + pole * last[q - LANES]);
        for (float *row = last - LANES; row >= c; row -= LANES)
            for (int q = 0; q < LANES; q++)
                row[q] = calm(pole * (row[q + LANES] - row[q]));
    }
}

// LANES lines of n samples each go through a buffer [n][LANES]: sample i of line q is
// px[q * line_step + i * step].
static void fit_lines(float *px, int n, int lines, size_t line_step, size_t step, int degree)
{
    if (n < 2)
        return;
#pragma omp parallel
    {
        float *buf = xcalloc((size_t)n * LANES, sizeof *buf);
#pragma omp for
        for (int q0 = 0; q0 < lines; q0 += LANES) {
            const int used = lines - q0 < LANES ? lines - q0 : LANES;
            for (int i = 0; i < n; i++)
                for (int q = 0; q < used; q++)
                    buf[i * LANES + q] = px[(size_t)(q0 + q) * line_step + (size_t)i * step];
            fit_lanes(buf, n, degree);
            for (int i = 0; i < n; i++)
                for (int q = 0; q < used; q++)
                    px[(size_t)(q0 + q) * line_step + (size_t)i * step] = buf[i * LANES + q];
        }
        free(buf);
    }
}

void bspline_fit_rows(float *px, int w, int h, int degree)
{
    fit_lines(px, w, h, (size_t)w, 1, degree);
}

void bspline_fit_columns(float *px, int w, int h, int degree)
{
    fit_lines(px, h, w, 1, (size_t)w, degree);
}

void bspline_fit_image(float *px, int w, int h, int degree)
{
    bspline_fit_rows(px, w, h, degree);
    bspline_fit_columns(px, w, h, degree);
}

double bspline_basis(int degree, double x)
{
    // Truncated powers: sum over k of (-1)^k binomial(n + 1, k) (x + (n + 1) / 2 - k)_+^n / n!
    static const double binomial[2][6] = {{1, -4, 6, -4}, {1, -6, 15, -20, 15, -6}};
    const bool is_cubic = degree == BSPLINE_CUBIC;
    double sum = 0, y = 0.5 * (degree + 1) - fabs(x);
    for (const double *b = binomial[!is_cubic]; y > 0; y -= 1)
        sum += *b++ * y * y * y * (is_cubic ? 1 : y * y);
    return sum / (is_cubic ? 6 : 120);
}

void bspline_weights(double x, double w[4])
{
    const double y = 1 - x;
    w[0] = y * y * y / 6;
    w[1] = 2 / 3. - x * x * (1 - .5 * x);
    w[2] = 2 / 3. - y * y * (1 - .5 * y);
    w[3] = x * x * x / 6;
}

double bspline_at(const float *c, int w, int h, double x, double y)
{
    const int i = (int)floor(x), j = (int)floor(y);
    double wx[4], wy[4], sum = 0;
    bspline_weights(x - i, wx);
    bspline_weights(y - j, wy);
    for (int q = 0; q < 4; q++) {
        const float *row = c + (size_t)bspline_mirror(j - 1 + q, h) * (size_t)w;
        for (int p = 0; p < 4; p++)
            sum += wy[q] * wx[p] * (double)row[bspline_mirror(i - 1 + p, w)];
    }
    return sum;
}

void bspline_fit_vectors(double *v, int n, size_t stride, size_t lanes)
{
    const double z = sqrt(3) - 2;
    for (int k = 1; k < n; k++) {
        double *at = v + (size_t)k * stride;
        for (size_t q = 0; q < lanes; q++)
            at[q] += z * at[q - stride];
    }
    double *last = v + (size_t)(n - 1) * stride;
    for (size_t q = 0; q < lanes; q++) // the tail beyond the end, z^k last, summed
        last[q] *= -6 * z / (1 - z * z);
    for (int k = n - 2; k >= 0; k--) {
        double *at = v + (size_t)k * stride;
        for (size_t q = 0; q < lanes; q++)
            at[q] = z * (at[q + stride] - 6 * at[q]);
    }
}

double bspline_gain(int k, int period)
{
    return 3 / (2 + cos(2 * M_PI * k / period));
}
