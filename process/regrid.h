// regrid.h - a height field on another grid: a part of it, turned, or with other node spacings.
//
// Between nodes heights follow a cubic spline through them, about their least-squares plane, so
// that a plane stays that plane up to its borders. A node of the result is missing when the nearest
// old one is. `out` and `in` differ; metadata comes along.
#pragma once
#include "core/hfield.h"

// The part whose corner lies at (x, y) from node (0, 0), of the nodes' extent w x h; whole nodes.
// ERR_DATA when it is not inside or smaller than 2 x 2 nodes.
bool hfield_crop(struct hfield *out, const struct hfield *in, double x_m, double y_m, double w_m,
                 double h_m, struct err *e);

// Turned by the angle from x towards y: what pointed along x now points along it. Quarter turns
// move the nodes; others take the largest rectangle that lies inside the turned field, with square
// nodes of the finer spacing. ERR_DATA when nothing is measured, or that rectangle is too small.
bool hfield_turn(struct hfield *out, const struct hfield *in, double angle_rad, struct err *e);

// Node (0, 0) stays. Where the new spacing is coarser, heights are first smoothed by a Gaussian of
// sigma = 0.375 sqrt(new^2 - old^2): ISO 16610-61's filter whose cut-off is two new spacings.
// ERR_DATA when fewer than 2 or more than 65536 nodes a side would result.
bool hfield_resample(struct hfield *out, const struct hfield *in, double dx_m, double dy_m,
                     struct err *e);
