// deconvolve.h - Richardson-Lucy: the sharp picture that best explains a blurred, noisy one.
//
// u' = u H^T(d / H u) / H^T 1 with reflecting borders (process/blur.h). The result is never negative and
// its flux is that of the data (to 1e-6 for symmetric PSFs, whose H^T 1 is 1). Float samples, double sums.
#pragma once
#include "process/blur.h"

struct deconvolve_options {
    int iterations;  // > 0; 0: chosen by the held-out residual, up to `most`
    int most;        // limit of the automatic choice; 0: 400
    bool accelerate; // Biggs & Andrews 1997: extrapolate along the path
    double tv;       // weight of total variation (Dey et al. 2006), 0: none; below 0.1
};

struct deconvolve_result {
    int iterations;
    bool reached_most;    // the held-out residual still fell at the limit
    double flux_in, flux; // sums of the data (negative samples counted as 0) and of the result
    double residual;      // rms of H u - d
    long negative;        // samples of the data below 0, taken as 0
};

// data, out [h][w], not the same. ERR_DATA when a sample is not finite, or all are zero.
bool deconvolve(struct blur *b, int w, int h, const float *data, const struct deconvolve_options *opt,
                float *out, struct deconvolve_result *res, struct err *e);
