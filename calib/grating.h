// grating.h - the lines of a known grating inside a disc: period, direction, profile, blur.
#pragma once
#include "calib/disc.h"
#include <complex.h>

enum { GRATING_HARMONICS = 16, GRATING_SAMPLES = 256 };

struct grating {
    double kx, ky;  // cycles per px, along columns and rows; the half plane is chosen by the caller
    double k_sigma; // of |k|, from the four quadrants of the disc
    double lines;   // |k| times the disc's diameter
    int harmonics;  // that the pixels resolve, <= GRATING_HARMONICS
    double noise;   // rms of a pixel about the profile, mean 1
    // F[m]: mean over the phase of profile * exp(-2 pi i m phase), of all pixels, and of two halves
    // of them (a checkerboard of 16 px); phase 0 at the disc's centre, growing along (kx, ky).
    double complex f[GRATING_HARMONICS + 1], half[2][GRATING_HARMONICS + 1];
    double f_sigma; // of each part of F[m], m > 0
};

// From a flattened disc (disc_flatten). ERR_DATA with the numbers: fewer than 5 lines, no lines at
// all.
bool grating_find(struct grating *g, const struct disc *d, const float *flat, int w, int h,
                  struct err *e);

// Takes a wave vector near a peak of the disc's spectrum to its top.
void grating_climb(const struct disc *d, const float *flat, int w, int h, double *kx, double *ky);

// The profile alone, along g->kx, g->ky: fills harmonics, f, half and noise.
bool grating_measure(struct grating *g, const struct disc *d, const float *flat, int w, int h,
                     struct err *e);
void grating_profile(const struct grating *g, double out[GRATING_SAMPLES]); // sum of the harmonics

// A blazed profile under a Gaussian and the pixel's own square: I = 1 + contrast * (t' - 1/2) with
// t' the phase behind the jump, running up (rises > 0) or down along (kx, ky).
struct blaze {
    double sigma_px;       // the Gaussian alone
    double contrast, jump; // peak to peak; phase of the jump, 0 to 1
    int rises;             // +1 or -1
    double held_out;       // relative residual of the half that was not fitted
};
// sigma by the least held-out residual. ERR_DATA when the profile is no blaze (residual over 20 %).
bool grating_fit_blaze(const struct grating *g, struct blaze *b, struct err *e);

// The profile freed of that blur, GRATING_SAMPLES over a period: the one with the least total
// variation about a constant slope (few jumps, one slope) that explains the harmonics to their
// noise.
void grating_sharpen(const struct grating *g, double sigma_px, double out[GRATING_SAMPLES]);

// Its mean over `box` of a period, below a half, in place of every sample.
void grating_widen(double profile[GRATING_SAMPLES], double box);

// h = gain (I - offset) by least squares (T17 eq. 27), heights 0..height; rmse relative to height.
// The profile's samples are means over `box` of a period: a pixel's are |k|.
void grating_affine(const double profile[GRATING_SAMPLES], const struct blaze *b, double height,
                    double box, double *gain, double *offset, double *rmse);
