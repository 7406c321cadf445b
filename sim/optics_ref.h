// optics_ref.h - diffraction by a height field, by direct summation in double: the judge of the
// fast code. No FFT, no interpolation, nothing shared with process/.
//
//     S(u, v, w; l) = sum over nodes of g(x) r(x) exp(-2 pi i (u x + v y) / l),
// r = exp(2 pi i w h / l), or 1 + 2 pi i w h / l to first order (T17 App. B); g the coherence
// window, a Gaussian of sigma = patch / 4 about the middle of the grid, sum g = 1 (docs/optics.md
// 4).
#pragma once
#include "core/hfield.h"
#include "core/spectrum.h"
#include <complex.h>

struct optics_ref {
    const struct hfield *height; // every node measured
    double coherence_m;          // patch
    bool first_order;
};

struct uvw {
    double u, v, w;
};

// S at one wavelength for n points: out[n].
bool optics_ref_amplitude(const struct optics_ref *o, const struct uvw *at, int n, double lambda_m,
                          double complex *out, struct err *e);

// XYZ = K sum over 380, 385, ... 780 nm of P cmf |S|^2, with K sum P ybar = 1, so that a mirror has
// the colour of the light at (0, 0): out[n][3].
bool optics_ref_xyz(const struct optics_ref *o, const struct spectrum *illuminant,
                    const struct uvw *at, int n, double (*out)[3], struct err *e);
