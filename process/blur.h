// blur.h - a blur of a picture whose borders reflect, and its adjoint.
//
// Borders reflect about the outer edge of the border pixels (... b a | a b c ...): a constant stays a
// constant, and with a symmetric kernel the sum of the samples is kept. Fixed order of sums: the same
// bytes for any number of threads. A blur may be used by one thread at a time; it uses all cores.
#pragma once
#include "core/err.h"

struct blur;

// Gaussian of sigma_px > 0, cut at 4.5 sigma. Direct separable passes, or FFTs where those are cheaper.
// NULL and ERR_DATA for a sigma that is not positive or over a quarter of the smaller side.
struct blur *blur_gauss(int w, int h, double sigma_px, struct err *e);

// A measured point spread function [ph][pw], its centre at the middle sample, made to sum to 1.
// NULL and ERR_DATA when it is negative somewhere, sums to nothing, or is larger than the picture.
struct blur *blur_psf(int w, int h, const float *psf, int pw, int ph, struct err *e);

void blur_apply(struct blur *b, const float *in, float *out);   // [h][w] each; in and out differ
void blur_adjoint(struct blur *b, const float *in, float *out); // <blur x, y> = <x, adjoint y>
void blur_free(struct blur *b);                                 // accepts NULL
