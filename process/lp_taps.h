// lp_taps.h - the kernel of logpolar.h as a discrete filter on samples at equal steps of s.
//
// The samples stand for the quintic spline through them, and the kernel is integrated against that
// spline exactly; results come out as B-spline coefficients at every `stride`-th step, so nothing
// is left to filter before reading between them.
#pragma once
#include "process/logpolar.h"

struct lp_taps {
    double step; // of s between samples
    int stride;  // samples from result to result
    int first;   // result r is the sum over m of tap[m] sample[r stride + first + m]
    int n;
    float (*tap)[3]; // [n] owned, with `pad` zeros before and behind
    int pad;
};

double lp_kernel_growth(const struct lp_kernel *k); // the largest e^s

// Taps for samples at `step`. The stride is the largest that keeps the results' interpolation
// error, for features as fine as the samples resolve, below `tolerance`; 0 asks for plain values.
bool lp_taps_init(struct lp_taps *t, const struct lp_kernel *k, double step, double tolerance,
                  struct err *e);
void lp_taps_finish(struct lp_taps *t); // accepts a zeroed struct
