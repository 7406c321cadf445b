// cv_warp.h - OpenCV's getAffineTransform and warpAffine, as C.
#pragma once
#ifdef __cplusplus
extern "C" {
#endif
#include "core/err.h"

// to = m (from, 1), row by row m[2][3], from three pairs of points (pixels, x then y).
bool cv_affine(const double from[3][2], const double to[3][2], double m[2][3], struct err *e);

// out[oh][ow][3] at (x, y) = in[h][w][3] at m (x, y, 1), Lanczos; 0 beyond the border.
bool cv_warp(const float *in, int w, int h, const double m[2][3], float *out, int ow, int oh,
             struct err *e);

#ifdef __cplusplus
}
#endif
