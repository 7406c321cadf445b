// measure.h - what pixels say about an exposure: against another one of the same scene, and alone.
//
// Two frames of one bracket show the same scene under the same light, so the ratio of their signals
// is the ratio of their exposures, whatever the camera says. Pixels are chosen by the sum of both
// frames: shot noise then favours neither (given the sum of two Poisson counts, their split does
// not depend on it), where choosing by one frame would bias the ratio by some per cent.
// Black is what pixels without light show, if there are any, and of several limits between bright
// and dark the one is taken that gives the ratio best.
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct measure_frame {
    int w, h;
    const uint16_t *raw; // [h][w]
    double black;        // counts
    int white;           // largest count
    int64_t exposure_ns; // claimed
};

struct measure_ratio {
    double ratio; // of the signals, first to second
    double sigma; // its relative standard deviation; black is taken to be known to 1.5 counts,
                  // or to 0.3 where pixels without light show it
    double worst; // the band of rows that differs most: its ratio over `ratio`
    double worst_sigma;
    int worst_first, worst_last; // its rows
    double residual;             // rms of first - ratio * second, relative to the rms of first
    double spill; // share of the picture left out because the longer frame saturates there
    size_t pixels;
};

// false: too few pixels tell anything (under 64 well exposed).
bool measure_ratio(const struct measure_frame *a, const struct measure_frame *b,
                   struct measure_ratio *out);

struct measure_level {
    double saturated; // share of pixels at white
    double mean;      // counts above black
    double bright;    // count above black that one pixel in 10,000 exceeds
};
void measure_level(const struct measure_frame *f, struct measure_level *out);

// Noise never repeats: rows with the very counts of another frame are its rows. *first and *last of
// them, -1: there are none. True when no row differs.
bool measure_same_rows(const struct measure_frame *a, const struct measure_frame *b, int *first,
                       int *last);
