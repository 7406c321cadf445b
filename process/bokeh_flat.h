// bokeh_flat.h - the part of a bokeh photograph round its disc, as it is and freed of uneven light.
#pragma once
#include "calib/disc.h"

struct flat {
    int w, h;
    int left, top;    // of the picture
    struct disc disc; // in this part
    double level;     // 0: the disc's own
    float *raw, *px;  // [h][w], owned; in px 1 is the level
};

// `margin_px` is kept round the disc. level: of the calibration, which becomes 1; 0: the disc's
// own.
bool flat_init(struct flat *f, const float *picture, int w, int h, const struct disc *d,
               double level, double margin_px, struct err *e);
// Divides again, by the light that falls on a pattern [h][w] of mean 1 (NULL: on an even sample).
bool flat_divide(struct flat *f, const float *pattern, struct err *e);
void flat_finish(struct flat *f); // accepts a zeroed struct
