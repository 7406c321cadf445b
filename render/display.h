// display.h - from linear radiance to what a screen shows.
//
// Exposure in stops, then the gamut (a colour that sRGB cannot hold moves towards grey of its own
// luminance until it can), then the highlight: up to 0.8 a value is shown as it is; above, its
// largest channel approaches 1 and its colour fades to white, as film does. The curve of sRGB comes
// last, when the file is written.
#pragma once
#include "core/image.h"

void display_map(struct image *im, double exposure_ev); // R,G,B in place; NAN becomes black

// For files of 8 bits a channel: moves each display value by up to half a step of 255, by a pattern
// without grain (interleaved gradients, Jimenez 2014), so that slow gradients show no steps.
void display_dither(struct image *im);

// What `exposure: auto` means: the stops that bring the 96th percentile of what is lit (by its
// largest channel, pixels within 2^20 of the brightest) to 0.5. A pattern's orders show their
// colours, its specular peak goes to white.
double display_exposure(const struct image *im);
