// diffraction_rows.h - what every column of a grid shares: how its rows are read and weighed.
#pragma once
#include "process/diffraction.h"
#include "process/moments.h"

struct row_tap {
    int slot;
    float weight[TAPS];
};

struct diffraction_rows {
    struct row_tap *tap; // [wavelengths][2: at fy, at -fy][nv], owned
    float *gain;         // [wavelengths][nv][3] colour weight times the array factor along y, owned
    bool *used;          // [wavelengths][2][y.kept] slots that are read, owned
};

// Keeps in y what the rows need, and closes it.
bool diffraction_rows_init(struct diffraction_rows *r, const struct diffraction *d, struct bins *y,
                           struct err *e);
void diffraction_rows_finish(struct diffraction_rows *r); // accepts a zeroed struct

// |sum of n copies|^2 / n^2 at f cycles a copy.
double array_factor(int n, double f);
