// patch.h - a height field under its coherence window: what light sees at once.
//
// Window g(x, y) = gx gy, Gaussian about the middle of the field ((nx - 1)/2, (ny - 1)/2), with
// sigma = coherence / 4 (D14: the patch spans four sigma), sum g = 1. Nodes past 6.5 sigma carry
// less than 1e-10 of it and are left out. Heights are kept as x = (h - mid) / half in [-1, 1]: a
// shift of the whole field is a phase that |S|^2 does not see.
#pragma once
#include "core/hfield.h"

enum window { WINDOW_GAUSS, WINDOW_FLAT };

struct patch {
    int nx, ny;             // nodes under the window
    double dx_m, dy_m;      // their spacing
    const float *z;         // first node of the field's memory, not owned
    int stride;             // from row to row of z
    double mid_m, half_m;   // h = mid + half x
    double *gx, *gy;        // [nx], [ny], owned
    int centre_x, centre_y; // the node that phases count from
};

// ERR_DATA: a node under the window was not measured, or the window has no nodes. The field must
// outlive the patch.
bool patch_init(struct patch *p, const struct hfield *hf, enum window window, double coherence_m,
                struct err *e);
void patch_finish(struct patch *p); // accepts a zeroed struct

// Area of coherence (sum g)^2 / sum g^2 dx dy: |S|^2 A / lambda^2 is absolute.
double patch_area(const struct patch *p);
