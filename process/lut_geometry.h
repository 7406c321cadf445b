// lut_geometry.h - from pixels of a real camera to a pattern over (u, v).
//
// A geometry record is a picture with the channels u, v, w (the half vector h = wi + wo of every
// pixel in the sample's frame) and weight (turns L/E into Lm: 1 / (G F^2/F0^2) and the light's
// fall-off; NaN where the sample is not seen).
#pragma once
#include "process/lut_pattern.h"

// The photograph's channel, times weight and scale, on an even grid of h out to |u|, |v| <= reach,
// no coarser than the camera's pixels. Where several pixels see the same h their mean counts; where
// none does the pattern is not seen. ERR_DATA: missing channels, sizes that differ, no pixel seen.
bool lut_geometry(const struct image *photo, int channel, const struct image *geometry,
                  double scale, double reach, struct lut_pattern *out, struct err *e);
