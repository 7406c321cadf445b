// view_stats.h - what a photographer wants to know of a frame while it is on the screen.
#pragma once
#include "core/image.h"

enum { STATS_BINS = 128 };

struct stats {
    float bin[STATS_BINS]; // pixels by value, 0 to 1, on a logarithmic height 0..1
    double mean, brightest;
    double clipped; // share of pixels at white
    double focus;   // relative energy of the finest detail: sharper is more
};

// Samples 0 (black) to 1 (white). Neighbours are `step` pixels apart: 2 in a mosaic.
void stats_of(struct stats *s, const struct image *im, int step);
