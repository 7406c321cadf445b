// mosaic.h - colour from a sensor's mosaic without mixing channels.
//
// Every channel is read from its own sites; between them it is the mean of the nearest measured
// ones, so a narrow-band pattern in red is red's sites and nothing else.
#pragma once
#include "core/image.h"

// A merged mosaic "Y,var.Y,mask" (process/hdr.h) with the 2 x 2 `cell` ("RGGB", by rows) becomes
// "R,G,B,var.R,var.G,var.B,mask" of the same size. ERR_DATA: a cell of other letters.
bool mosaic_spread(const struct image *merged, const char *cell, struct image *out, struct err *e);

// Pixels with hot[k] != 0 take the mean of their measured neighbours at distance 2 (own sites in a
// mosaic) and mask 0.
void mosaic_fill_hot(struct image *merged, const unsigned char *hot);
