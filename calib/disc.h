// disc.h - the bright disc of a defocused highlight: where it is, and its light made even.
#pragma once
#include "calib/poly.h"
#include "core/image.h"

struct disc {
    double cx_px, cy_px, radius_px;
    double residual_px; // rms distance of the rim's points from the circle
};

// One channel. The rim is where rays from the middle cross half the level inside, sub-pixel,
// through a robust circle. ERR_DATA with the measured numbers: no disc, two discs, cut by the
// frame, saturated (more than 1 % of it at the largest sample), not round.
bool disc_find(struct disc *d, const float *px, int w, int h, struct err *e);

// The smooth light inside the disc, a polynomial of degree 4 in (x, y) fitted within 0.97 of the
// radius, scaled so that its mean there is 1; then px / (level * light) has the mean `mean`: 1 when
// the level is the disc's own.
struct disc_light {
    struct disc disc;
    double level;            // of the samples that becomes 1
    double mean;             // of the disc over that level
    double term[POLY_TERMS]; // x and y in radii
};
// `pattern`, the sample's own brightness [h][w] of mean 1, is what the light falls on; NULL: even.
// Patterns that repeat a few times over the disc would else be taken for light in part.
bool disc_light_fit(struct disc_light *l, const struct disc *d, const float *px,
                    const float *pattern, int w, int h, struct err *e);
double disc_light_at(const struct disc_light *l, double i, double j); // samples of even reflectance

// Makes another level 1: that of a calibration, so that brightness compares with it.
void disc_light_relate(struct disc_light *l, double level);

// px / light within the radius; its mean outside, so that the picture has no step at the rim.
void disc_flatten(const struct disc_light *l, const float *px, int w, int h, float *out);
