// blur.h - a blur of a picture whose borders reflect, and its adjoint.
//
// Borders reflect about the outer edge of the border pixels (... b a | a b c ...): a constant stays
// a constant, and with a symmetric kernel the sum of the samples is kept. Fixed order of sums: the
// same bytes for any number of threads. A blur may be used by one thread at a time; it uses all
// cores.
#pragma once
#include "core/err.h"
#include <stddef.h>

struct blur;

// Gaussian of sigma_px > 0, cut at 4 sigma. Direct separable passes, or FFTs where those are
// cheaper. NULL and ERR_DATA for a sigma that is not positive or over a quarter of the smaller
// side.
struct blur *blur_gauss(int w, int h, double sigma_px, struct err *e);

// A measured point spread function [ph][pw], its centre at the middle sample, made to sum to 1.
// NULL and ERR_DATA when it is negative somewhere, sums to nothing, or is larger than the picture.
struct blur *blur_psf(int w, int h, const float *psf, int pw, int ph, struct err *e);

void blur_apply(struct blur *b, const float *in, float *out);   // [h][w] each; in and out differ
void blur_adjoint(struct blur *b, const float *in, float *out); // <blur x, y> = <x, adjoint y>

// A round takes rows in an order of the blur's own, `stride` samples each, w of them the picture's
// and the others padding, which is 0 in `out` and must stay finite.
size_t blur_stride(const struct blur *b);
void blur_order(const struct blur *b, const float *in, float *out); // [h][w] to [h][stride]
void blur_unorder(const struct blur *b, const float *in, float *out);

struct blur_run { // samples of a row in that order, while they are in the cache
    int i, j, n;  // places i .. i + n - 1 of row j
    bool again;   // another thread hands out the same samples too, and they are its own
    float *px;    // [n]
};
typedef void blur_on_run(void *ctx, const struct blur_run *run); // from any thread

// adjoint(between(blur(in))): `between` changes the blur's samples in place, `fn` takes the
// result's. Neither may write to `in`. Much faster than one after the other: rows stay in the
// cache.
void blur_round(struct blur *b, const float *in, blur_on_run *between, blur_on_run *fn, void *ctx);

bool blur_is_symmetric(const struct blur *b); // then it is its own adjoint, and keeps every sum
void blur_free(struct blur *b);               // accepts NULL

// Index of the sample of 0 .. n - 1 that stands for i: any, also far beyond the borders.
int blur_reflect(int i, int n);
