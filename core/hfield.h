// hfield.h - a height field: one height per node of a regular grid.
//
// Axes   x right, y down the rows, z towards the viewer's side as the sample's normal; node (i, j)
//        is z[j * nx + i] at (i * dx_m, j * dy_m): the row index grows with y.
// Units  metres everywhere. NAN marks a node that was not measured; never 0.
#pragma once
#include "core/err.h"
#include "core/meta.h"

struct hfield {
    int nx, ny;        // nodes, >= 2
    double dx_m, dy_m; // node spacing, need not be equal
    float *z;          // [ny][nx] metres, owned
    struct meta meta;  // e.g. "nacre.cutoff_per_m": where the optics stopped
};

// z all NAN. ERR_DATA for sizes under 2 or spacings that are not positive and finite.
bool hfield_init(struct hfield *hf, int nx, int ny, double dx_m, double dy_m, struct err *e);
void hfield_finish(struct hfield *hf); // accepts a zeroed struct

// Smallest and largest measured height; false when nothing is measured.
bool hfield_range(const struct hfield *hf, double *lo_m, double *hi_m);
long hfield_missing(const struct hfield *hf); // number of NAN nodes
