// view.h - pictures for judging: luminance in false colour, the difference of two, two halves.
//
// False colour is logarithmic and ends at `peak`, `decades` below which it is black. The scale
// lies along the lower edge, a tick at every decade. In place, R,G,B; display values come out.
#pragma once
#include "core/image.h"

double view_peak(const struct image *im); // the largest luminance, 0 when nothing is lit
void view_false_color(struct image *im, double peak, double decades);

// |a - b| of the worst channel in false colour, relative to b's peak; sizes must be the same.
void view_difference(struct image *a, const struct image *b, double decades);

// The right half of b behind the left half of a, a white line between them.
void view_split(struct image *a, const struct image *b);
