// blur_passes.h - the inner loops of the direct blurs: sums with the taps k[0 .. 2 radius], which
// are symmetric, radius at least 1; each with the widest vectors that the machine has.
#pragma once
#include <stddef.h>

enum {
    BLUR_VEC = 16,   // samples of a vector
    BLUR_LANES = 64, // samples of a step along a row
    BLUR_ROWS = 4,   // rows of the result that are made together
};

// out[i] = sum over m of k[m] in[i + m]; n a multiple of BLUR_LANES.
void row_pass(const float *in, float *out, size_t n, const float *k, int radius);

// out[q][i] = sum over m of k[m] row[q + m][i], q = 0 .. BLUR_ROWS - 1, rows of `out` `stride`
// apart; n is rounded up to a vector.
void column_pass(const float *const *row, float *out, size_t stride, size_t n, const float *k,
                 int radius);

// The same along a row whose neighbours lie in neighbouring vectors: n vectors, rounded up to
// BLUR_ROWS; in[0] is the vector `radius` before the first.
void lanes_pass(const float *in, float *out, int n, const float *k, int radius);

// Copies, and asks for what will be wanted soon: the samples `ahead` of those.
void copy_ahead(float *to, const float *from, int n, size_t ahead);
