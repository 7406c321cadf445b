// cut.h - a grid of power in rectangles that share it, by median cuts (Debevec 2005).
#pragma once
#include "core/err.h"

struct cut_grid {
    int w, h;
    const double *power; // [h][w], never below 0
    const double *x, *y; // [w + 1], [h + 1] edges of the columns and rows
    const double *slant; // [h] what a step in x is worth in units of y; NULL: 1
};

struct cut_part {
    int i, j, w, h; // the rectangle
    double power;   // of all of it
    double share; // of the rectangle's power that is this part's: below 1 for one node cut in parts
};

// Cells, cut while one has power and more than a node, that of the largest power times extent
// first: what an error in direction costs. Then each in `parts` of equal power as far as nodes
// allow, which stand next to each other. `out` has room for n * parts; returns the cells, or -1
// where memory is short.
int cut_cells(const struct cut_grid *g, int n, int parts, struct cut_part *out, struct err *e);
