// tile.h - the border of a height field, made fit for being one of many or the only one.
#pragma once
#include "core/hfield.h"

// Heights fade to their mean over the outer eighth on every side (raised cosine): the square that
// was cut out has no edge that diffracts.
void hfield_window(struct hfield *hf);

// Cuts the field so that copies side by side continue each other, in x and y: by the length, over
// half of the field, after which it repeats itself best; over an eighth of the field it goes over
// from one copy to the next. *seam: rms difference of the copies there, over the heights' standard
// deviation, the worse of both directions. ERR_DATA: fewer than 32 nodes, heights missing.
bool hfield_tile(struct hfield *hf, double *seam, struct err *e);
