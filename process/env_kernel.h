// env_kernel.h - a table ready for plane convolutions: on a grid of direction cosines, transformed.
//
// Splines  both sides of a convolution are shared out to the nodes with interpolating cubic splines
//          (bspline.h): power, centre and width are kept, whatever falls between the nodes, and
//          lobes finer than the grid lose only their shape.
// A kernel depends on the table and the Fresnel term, not on light, frame or camera: keep it.
#pragma once
#include "process/env_terms.h"

enum { ENV_RIM = 14 }; // nodes beyond disk and table that splines reach; 0.27^12 is 1e-7

// Nodes at equal steps of the direction cosines, and the transforms over them.
struct env_grid {
    double step;
    double span; // width of the window of o that is asked for, in both cosines: 2 is all
    int reach;   // of the table, in nodes
    int side;    // nodes of light that such a window needs
    int period;  // of the transforms: wide enough that nothing wraps into the window
};

struct env_how {
    double tolerance; // of the zonal weight: relative, env_zonal.h
    int products;     // not 0: so many by env_terms_products() in place of the tolerance
    double step; // 0: 1/3.5 of the table's detail (table_cubic.h) or 1/8 of the light's: one of
                 // the two resolved is enough; 1/2048 to 1/160, coarser above 4 GB
    double detail_rad; // the light's finest detail: a pixel
    double span;       // 0 is 2: the whole disk
    double turn_rad; // the table turned about the normal: its u axis at this angle to the light's t
};

struct env_kernel {
    struct env_grid grid;
    struct env_terms terms;
    double *spec[3][TERMS_MOST]; // [period][period/2 + 1] complex; NULL for a kernel not used
    bool not_negative;           // no node of the table is below zero
};

bool env_kernel_init(struct env_kernel *k, const struct table *rgb, const struct fresnel *f,
                     const struct env_how *how, struct err *e);
void env_kernel_finish(struct env_kernel *k); // accepts a zeroed struct
