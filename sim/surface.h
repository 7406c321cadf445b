// surface.h - made-up height maps that repeat without a seam: sums of waves that fit the tile.
#pragma once
#include "core/hfield.h"
#include <stdint.h>

// Waves whose wave vector lies on a ring or near a direction, with random strengths and phases.
struct surface_recipe {
    double tile_m; // side of the square tile
    int nodes;     // a side
    double period_m;
    double spread;     // width of the band of frequencies, as a part of 1 / period
    double spread_rad; // around the direction x; M_PI: every direction
    double rms_m;
    uint64_t seed;
};

// ERR_DATA when no wave of the tile lies in the band, or the nodes are too coarse for it.
bool surface_make(struct hfield *hf, const struct surface_recipe *r, struct err *e);
// Crossed waves h = depth / 4 (2 + cos x + cos y): one cell of a hologram's grating.
bool surface_egg_crate(struct hfield *hf, double period_m, int nodes, double depth_m,
                       struct err *e);
