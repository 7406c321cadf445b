// lut_pattern.h - the photographed pattern as the table methods need it: finite, with its mask.
//
// Pixel (i, j) shows the half vector h = ((i - cx), (j - cy)) h_per_px in (t, b). Beyond the frame
// nothing is known: methods count it as 0 and mark the nodes that wanted it (table.cover).
#pragma once
#include "core/image.h"
#include <stdint.h>

struct lut_pattern {
    int w, h;
    float *px;       // [h][w] Lm: radiance per unit of incident irradiance; finite; owned
    uint8_t *seen;   // [h][w] 1 where measured, owned; NULL: everywhere
    float *variance; // [h][w] of px, owned; NULL: not known
    long unseen;     // pixels not measured; a hole holds a smooth guess from around, the outside 0
    double h_per_px;
    double cx, cy; // px, where h = 0
};

// One channel of `im` times `scale`; a channel "var.R" (for "R") gives the variance, and with
// "mask" what every frame of the bracket saturated (process/hdr.h) counts as not measured.
// ERR_DATA: no such channel, no finite pixel, smaller than 4 x 4.
bool lut_pattern_init(struct lut_pattern *p, const struct image *im, int channel, double scale,
                      struct err *e);
void lut_pattern_finish(struct lut_pattern *p); // accepts a zeroed struct

// The sub-pixel centre of the brightest lobe (order 0), from its flanks: a lobe clipped by the
// sensor or with its core masked has the same centre. A hot pixel is no lobe.
// ERR_DATA when there is no light.
bool lut_pattern_center(struct lut_pattern *p, struct err *e);
