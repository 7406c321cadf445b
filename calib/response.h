// response.h - how a camera turns exposure into 8-bit codes, recovered from a bracket.
//
// Model: ln X(code) = ln E + ln t, with X the exposure a code stands for, E the radiance and t the
// exposure time. Every channel has its own curve, scaled to X = 1 at code 128.
#pragma once
#include "core/err.h"
#include <stdbool.h>
#include <stdint.h>

enum { RESPONSE_CODES = 256, RESPONSE_MIDDLE = 128, RESPONSE_CHANNELS = 4 };

struct response {
    int nc;                                              // channels
    double log_x[RESPONSE_CHANNELS][RESPONSE_CODES];     // ln X, never falling
    double log_sigma[RESPONSE_CHANNELS][RESPONSE_CODES]; // one standard deviation of ln X at a code
    int code_min, code_max; // codes that say something; those outside are black or saturated
    double residual;        // root mean square of ln X - ln E - ln t over the pixels used
    int pixels;             // used, in each channel
};

// Neither black nor saturated.
bool response_code_ok(const struct response *r, int code);

enum { BRACKET_MAX = 64 }; // frames

// Frames of 8-bit codes of one scene, in any order of time.
struct bracket {
    int n, w, h, nc;
    const uint8_t *const *code; // [n] frames [h][w][nc]
    double *time_s;             // [n]
};

// The curve of an 8-bit sRGB picture: what is assumed where nothing is known.
void response_srgb(struct response *r, int nc);
// Codes proportional to exposure.
void response_linear(struct response *r, int nc);

// Least squares over ln X, ln E and, when log_scale is not NULL, a correction of each exposure time
// (added to ln t; Debevec & Malik 1997, with every ln E eliminated, so that many pixels can be
// used). Corrections neither shift nor stretch the scale of ln t as a whole: no bracket can tell
// that. ERR_DATA: fewer than two frames, all black, all saturated, frames that follow no curve.
bool response_debevec(struct response *r, const struct bracket *b, double *log_scale,
                      struct err *e);

// Alternating estimates of E and X with Gaussian certainty (Robertson et al. 2003).
bool response_robertson(struct response *r, const struct bracket *b, struct err *e);

// ERR_DATA where the residual is not that of one scene at these exposure times.
bool response_check(const struct response *r, struct err *e);

double response_slope(const double log_x[RESPONSE_CODES], int z); // d ln X / d code, never 0

// Alters a curve to the nearest one that never falls.
void response_make_monotone(double y[RESPONSE_CODES]);
