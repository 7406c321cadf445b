// dark.h - what a sensor counts without light: per pixel a black level and a current.
//
// counts = black + rate * t. The rate of a pixel is its own only as far as it stands out of the
// noise (shrunk towards the median by 1 - 1/z^2, z its distance in sigmas), so that subtracting the
// dark adds little noise where nothing is to be corrected.
#pragma once
#include "calib/record.h"
#include <stdint.h>

struct dark {
    struct record head;
    int w, h;
    float *black; // [h][w] counts, owned
    float *rate;  // [h][w] counts / s, owned
    uint8_t *hot; // [h][w] 1: leave this pixel out, owned
    double black_mean, rate_median;
    double read_noise; // counts rms of one frame
    double level;      // mean dark current, counts, in the frames that read_noise was seen in
    int frames, exposures;
    long n_hot;
};

// Sums over dark frames, one at a time.
struct dark_sums {
    int w, h, frames, exposures;
    double first_time_s, t, tt, ttt; // sums
    float reference;                 // taken off every count: keeps the sums exact in float
    float *x, *xt, *xx;              // [h][w], owned
};
bool dark_begin(struct dark_sums *s, int w, int h, struct err *e);
void dark_add(struct dark_sums *s, const float *counts, double time_s);
void dark_drop(struct dark_sums *s); // accepts a zeroed struct
// Frees the sums. ERR_DATA: fewer than two frames (no noise to be seen); light in the frames.
bool dark_end(struct dark_sums *s, struct dark *d, struct err *e);
void dark_finish(struct dark *d); // accepts a zeroed struct

double dark_at(const struct dark *d, size_t k, double time_s); // counts of pixel k
double dark_variance(const struct dark *d);                    // that subtracting it adds, counts^2

// EXR, channels "black,rate,hot".
bool dark_write(const struct dark *d, const char *command, const char *path, struct err *e);
bool dark_read(struct dark *d, const char *path, struct err *e);
