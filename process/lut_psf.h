// lut_psf.h - tables under a light that is not a point (T17 6.2): S_d convolved with its picture.
#pragma once
#include "process/lut.h"

struct lut_psf {
    const struct image *image; // the light as a mirror shows it, 1 or 3 channels (linear sRGB)
    double h_per_px;
    double cx, cy; // px: the point of the light that `center` of the pattern belongs to
};

// As lut_build, then per channel of linear sRGB the convolution with the picture, its sum scaled to
// 1. `cover` needs all of the light; `sigma` is an upper bound (noise taken as fully correlated).
// ERR_DATA: a picture without light, or larger than |h| = 1.
bool lut_build_psf(const struct lut_request *r, const struct lut_psf *psf, struct table *t,
                   struct lut_report *report, struct err *e);
