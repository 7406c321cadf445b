// env_kernel.h - a table ready for plane convolutions: on a grid of direction cosines, transformed.
//
// Grid     node g of `side` is the direction cosine (g - half) * step; it covers -1 to 1 and a rim.
// Period   of the transforms: the grid and the table's reach behind each other, so nothing wraps.
// Splines  both sides of a convolution are shared out to the nodes with interpolating cubic splines
//          (bspline.h): power, centre and width are kept, whatever falls between the nodes, and
//          lobes finer than the grid lose only their shape.
// A kernel depends on the table and the Fresnel term, not on light, frame or camera: keep it.
#pragma once
#include "process/env_zonal.h"

struct env_grid {
    double step;
    int half, side, period;
};

struct env_kernel {
    struct env_grid grid;
    struct zonal zonal;
    double *spec[3][ZONAL_MOST + 1]; // [period][period/2 + 1] complex: channel, power of w; or NULL
    bool not_negative;               // no node of the table is below zero
};

// step: 0 chooses the table's node spacing, or a third of the finest detail that light has
// (detail_rad), whichever is larger, and at least 1/2048.
bool env_kernel_init(struct env_kernel *k, const struct table *rgb, const struct fresnel *f,
                     double tolerance, double step, double detail_rad, struct err *e);
void env_kernel_finish(struct env_kernel *k); // accepts a zeroed struct
