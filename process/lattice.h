// lattice.h - the two-dimensional lattice of a periodic picture, from the peaks of its spectrum.
#pragma once
#include "calib/disc.h"

struct lattice {
    double kx[2], ky[2]; // wave vectors, cycles per px: phase s = kx[0] x + ky[0] y, t with [1]
    double ax[2], ay[2]; // the cell's sides in px: along ax[0], ay[0] s grows by 1 and t stays
    int peaks;           // of the spectrum that stand on it
};

// From a flattened disc (disc_flatten). Every peak above 2 % of the strongest must be an integer
// combination of both wave vectors, but for 1 % of their power. ERR_DATA with the numbers: no two
// directions, peaks of no lattice, cells of under 4 px or over a fifth of the disc.
bool lattice_find(struct lattice *l, const struct disc *d, const float *flat, int w, int h,
                  struct err *e);

// The lattice's wave vector next to (kx, ky).
void lattice_nearest(const struct lattice *l, double kx, double ky, double *near_x, double *near_y);
