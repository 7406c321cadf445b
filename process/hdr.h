// hdr.h - merge the frames of a bracket into radiance, with its variance and a mask.
//
// Radiance is exposure per second in the units of the frames: counts/s, or for 8-bit codes X/s with
// X = 1 at code 128 (calib/response.h). Every channel has its own weights: a narrow-band spot may
// saturate one channel and leave the others dark.
//
// The result is one image: "R,G,B,var.R,var.G,var.B,mask" (or "Y,var.Y,mask"). A channel of a pixel
// that no frame measured is the bound that is known (saturated: the shortest exposure's limit;
// black: 0), its variance the square of that bound, and mask is 0; mask is 1 where all channels
// were measured.
#pragma once
#include "calib/response.h"
#include "core/image.h"

// POISSON: weights = inverse variance (Granados et al. 2010), reaching the Cramer-Rao bound when
// the noise is known. DEBEVEC: mean of logarithms under a hat (Debevec & Malik 1997). ROBERTSON:
// Gaussian certainty times t^2 (Robertson et al. 2003).
enum hdr_method { HDR_POISSON, HDR_DEBEVEC, HDR_ROBERTSON };
extern const char hdr_methods[]; // "poisson|debevec|robertson"

// Variance of a sample x above black: read + gain * max(x, 0), in squared units of the samples.
struct hdr_noise {
    double read, gain;
};

struct hdr_frames {
    int n, w, h, nc;
    const float *const *px; // [n] frames [h][w][nc], linear, black level removed
    const double *time_s;   // [n] exposure times, drift included
    double saturation;      // samples from here on are saturated (INFINITY: none)
    struct hdr_noise noise;
};

struct hdr_counts {
    long samples, saturated, black; // channels of pixels; saturated and black in every frame
};

// ERR_DATA: fewer than 2 frames or more than BRACKET_MAX; nothing measured anywhere.
bool hdr_merge(const struct hdr_frames *f, enum hdr_method method, struct image *out,
               struct hdr_counts *counts, struct err *e);
bool hdr_merge_codes(const struct bracket *b, const struct response *r, enum hdr_method method,
                     struct image *out, struct hdr_counts *counts, struct err *e);

// log2 of the ratio of the 99.9 and 0.1 percentiles of the measured samples above their own noise.
double hdr_range_stops(const struct image *merged);
