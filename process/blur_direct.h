// blur_direct.h - blurs by a symmetric separable kernel between reflecting borders: two direct
// passes over rows that stay in the cache.
#pragma once
#include "process/blur.h"

struct direct {
    int w, h, radius;
    int steps;   // vectors of a row in lanes; 0: rounds take rows as they are
    float *taps; // [2 radius + 1], owned
    float *mid;  // [h][w] between the two blurs of such a round; else NULL
};

// k[m], m = 0 .. radius: one half of the kernel, which should sum to 1. False when memory does not
// hold it.
bool direct_init(struct direct *d, int w, int h, const double *k, int radius, struct err *e);
void direct_finish(struct direct *d); // accepts a zeroed struct

void direct_apply(const struct direct *d, const float *in, blur_on_run *fn, void *ctx);

// Rows in lanes (steps > 0), the order that direct_round() works in: [h][16 steps].
void direct_order(const struct direct *d, const float *in, float *out); // padding 0
void direct_unorder(const struct direct *d, const float *in, float *out);
void direct_round(const struct direct *d, const float *in, blur_on_run *between, blur_on_run *fn,
                  void *ctx);
