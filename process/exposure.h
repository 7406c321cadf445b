// exposure.h - how long each frame of a bracket really was.
#pragma once
#include "process/hdr.h"

// A camera's printed time is nominal: "1/15" is 1/16 s. The third (or half) stop 2^(k/3) s nearest
// to it; times over 32 s (bulb, a clock's) and those 9 % off any stop stay as they are.
double exposure_snap(double nominal_s);

// Two frames whose times differ by under 1 %: their indices, or false.
bool exposure_same(const double *time_s, int n, int *a, int *b);

// Light drift and shutter errors: the logarithm of each frame's true exposure over time_s, from
// pixels that neighbouring frames (in time_s) share unsaturated; their mean is 0. Pairs that share
// fewer than 100 samples keep their nominal ratio and are counted in *unlinked. f->noise must be
// known.
void exposure_drift(const struct hdr_frames *f, double *log_scale, int *unlinked);
void exposure_drift_codes(const struct bracket *b, const struct response *r, double *log_scale,
                          int *unlinked);

// The noise of linear frames from the bracket itself: residuals of neighbouring frames by level.
// A floor of 1e-7 of the largest sample stands where the frames are free of noise.
struct hdr_noise exposure_noise(const struct hdr_frames *f);
