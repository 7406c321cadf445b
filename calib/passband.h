// passband.h - the light of a photograph: effective wavelength and band, with uncertainty.
//
// The band is the product of the curves of light, filter and camera channel. Its effective
// wavelength is the centroid; the uncertainty says how far the centroid moves when every curve's
// wavelength scale is off by its accuracy, and when every other sample of a curve is left out.
#pragma once
#include "calib/record.h"
#include "core/spectrum.h"

struct passband {
    struct record head;                // residual: lambda_sigma_m
    struct spectrum band;              // peak 1, owned
    double lambda_m, lambda_sigma_m;   // centroid
    double rms_m;                      // standard deviation about it
    double width_m, width_sigma_m;     // full width at half maximum
    double grating_m, grating_sigma_m; // the wavelength that a known grating shows; NAN: not asked
    double lines_per_m;
};
void passband_finish(struct passband *s); // accepts a zeroed struct

// ERR_DATA where the curves have no wavelength in common.
bool passband_product(struct passband *s, const struct spectrum *curve, int n, double accuracy_m,
                      struct err *e);
bool passband_gaussian(struct passband *s, double lambda_m, double width_m, double accuracy_m,
                       struct err *e);

// Does the grating agree within two standard uncertainties of the difference? True when not asked.
bool passband_agrees(const struct passband *s);

// The wavelength by the first-order ring (or pair of spots) of a grating with this many lines: |h|
// = lambda lines. px, u, v: [h][w] light and half vectors of the pixels, NAN where nothing is seen;
// looked for within 28 % below and 38 % above `expected_m`. ERR_DATA when none stands out.
struct ring {
    double lambda_m, sigma_m;
    int sectors; // of 36, where it is seen
};
bool ring_find(struct ring *r, const float *px, const float *u, const float *v, int w, int h,
               double lines_per_m, double expected_m, struct err *e);

bool passband_write(const struct passband *s, const char *command, const char *path, struct err *e);
bool passband_read(struct passband *s, const char *path, struct err *e);
