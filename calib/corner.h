// corner.h - where two edges cross, to hundredths of a pixel.
//
// A corner of a board is two lines through one point; behind lens and pixel its light is
// m + a E(d1) E(d2), with d1, d2 the distances from the lines and E a blurred edge, averaged over a
// pixel. The point, both
// directions, the blur and the levels are fitted to the pixels around it. What OpenCV finds is off
// by 0.04 to 0.1 px, which is more than the half vectors can bear.
#pragma once
#include "calib/cv_board.h"

// Refines all corners in `light` [h][w], linear. One that has no neighbours, or that the model does
// not fit, stays as it is.
void corners_refine(const struct board *b, struct corners *c, const float *light, int w, int h);
