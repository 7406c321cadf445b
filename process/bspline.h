// bspline.h - uniform B-splines of degree 3 and 5 through samples: fit once, evaluate anywhere.
//
// A fit turns samples into coefficients, in place; the spline then passes through the samples and
// is C2 (cubic) or C4 (quintic). Beyond the border the samples count as mirrored about the
// outermost one (M. Unser, "Splines: a perfect fit", 1999).
#pragma once
#include "core/err.h"
#include <stddef.h>

enum { BSPLINE_CUBIC = 3, BSPLINE_QUINTIC = 5, BSPLINE_MAX_TAPS = 6 };

// px[h][w], in parallel; the same bytes for any number of threads. An image is rows, then columns.
void bspline_fit_rows(float *px, int w, int h, int degree);
void bspline_fit_columns(float *px, int w, int h, int degree);
void bspline_fit_image(float *px, int w, int h, int degree);

void bspline_fit_line(double *line, int n, int degree);

// Weights of the coefficients i - 1 .. i + 2 (cubic) or i - 2 .. i + 3 (quintic) at i + f,
// 0 <= f <= 1.
static inline void bspline_weights_3(float f, float w[4])
{
    const float g = 1 - f, sixth = 1.0f / 6;
    w[0] = sixth * g * g * g;
    w[3] = sixth * f * f * f;
    w[1] = 2.0f / 3 - 0.5f * f * f * (1 + g);
    w[2] = 2.0f / 3 - 0.5f * g * g * (1 + f);
}

static inline void bspline_weights_5(float f, float w[6])
{
    const float g = 1 - f, f2 = f * f, g2 = g * g, unit = 1.0f / 120;
    w[0] = unit * g2 * g2 * g;
    w[5] = unit * f2 * f2 * f;
    w[1] = unit * (1 + g * (5 + g * (10 + g * (10 + g * (5 - 5 * g)))));
    w[4] = unit * (1 + f * (5 + f * (10 + f * (10 + f * (5 - 5 * f)))));
    w[2] = unit * (66 + f2 * (-60 + f2 * (30 - 10 * f)));
    w[3] = unit * (66 + g2 * (-60 + g2 * (30 - 10 * g)));
}

// The cubic weights in double: of the coefficients i - 1 .. i + 2 at i + x, 0 <= x < 1. Also the
// way to share a point's value out to four nodes; the fit then keeps its value, place and width.
void bspline_weights(double x, double w[4]);

// A cubic fit's value at (x, y), mirrored beyond the border.
double bspline_at(const float *c, int w, int h, double x, double y);

// Cubic, n vectors of `lanes` values, `stride` apart, zero beyond the ends.
void bspline_fit_vectors(double *v, int n, size_t stride, size_t lanes);

// What a cubic fit does to the frequency k of a period.
double bspline_gain(int k, int period);

// The basis function itself, in double: support |x| < (degree + 1) / 2.
double bspline_basis(int degree, double x);

// Index that mirrors i into 0..n-1 (about 0 and n - 1, as often as needed).
static inline int bspline_mirror(int i, int n)
{
    if (n == 1)
        return 0;
    const int period = 2 * n - 2;
    i %= period;
    if (i < 0)
        i += period;
    return i < n ? i : period - i;
}
