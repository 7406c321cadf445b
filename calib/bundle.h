// bundle.h - a lens, its boards and a light in one least-squares adjustment.
//
// The poses of small boards are known to some 1e-4 rad, and a light a metre away is seen with
// twice that error; worse, an error of the lens turns all boards together. A flat mirror tells its
// normal far better, given the light. So neither is taken for granted: corners and glints are
// observations of one rig.
#pragma once
#include "calib/lens.h"

// In the plane of this view's board, the pixel (i, j) sees the light mirrored.
struct glint {
    int view;
    double i, j;
    double sigma_h; // of h across the normal
};

// What a point of a plane shows under a light.
struct glance {
    struct vec3 x, wi, wo; // m; unit
    double u, v;           // h.t, h.b
};
bool glance_at(const struct lens *l, const struct plane *p, struct vec3 light_m, double i, double j,
               struct glance *g); // false: not before the plane

// Moves the light, and the lens and poses by as much as their corners allow; without corners only
// the light. `sigma_m` is the light's, `rms_h` what is left of h at the glints. ERR_DATA when they
// do not determine the light.
bool bundle_adjust(struct lens *l, const struct glint *glint, int n, struct vec3 *light_m,
                   double sigma_m[3], double *rms_h, struct err *e);
