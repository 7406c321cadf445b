// lut_band.h - the visible band as the table's integral sees it: P cmf dl as quadrature lines.
//
//   integral f(l) P(l) cmf(l) dl  =  sum over q of weight[q] f(lambda_m[q]),   integral P ybar = 1
//
// The lines are Gauss points between the knots of spectrum and observer, so that a smooth f is
// integrated exactly for all purposes, and a spectrum of narrow lines is not stepped over.
#pragma once
#include "core/spectrum.h"

struct lut_band {
    int n;
    double *lambda_m;    // [n] rising, owned
    double (*weight)[3]; // [n] X, Y, Z, owned
    double skipped;      // of 380..780 nm: the share of wavelengths where P cmf is nothing
};

// Gauss points are at most `step` apart in ln(lambda). ERR_DATA when the light has no luminance.
bool lut_band_init(struct lut_band *b, const struct spectrum *light, double step, struct err *e);
void lut_band_finish(struct lut_band *b); // accepts a zeroed struct

// The same integral on `n` equally spaced wavelengths, 380 to 780 nm, for an f that is linear
// between them: the trapezoidal rule where P cmf is linear too.
bool lut_band_sampled(struct lut_band *b, const struct spectrum *light, int n, struct err *e);
