// bokeh_lines.h - the 1-D path for gratings and CDs: all lines of the disc folded into one profile,
// which has hardly any noise left and can be sharpened far beyond what a picture allows.
#pragma once
#include "calib/bokeh_record.h"
#include "calib/disc.h"

struct lines {
    double kx, ky;       // cycles per px of the picture
    double cx_px, cy_px; // where the phase is 0
    double unexplained;  // variance of the picture about the lines, relative to theirs
    double profile[256]; // over one period, mean 1; freed of blur and pixel
};

// From a flattened disc (disc_flatten) at (cx, cy) of `flat`. ERR_DATA when there are no lines that
// hang together, or their second harmonic is lost in the optics.
bool lines_find(struct lines *l, const struct disc *d, const float *flat, int w, int h,
                double sigma_px, struct err *e);

// Mean of the profile over the pixel at (i, j).
double lines_at(const struct lines *l, double i, double j);
