// grey.h - any picture as one channel of light, for finding things in it.
#pragma once
#include "core/image.h"
#include <stddef.h>
#include <stdint.h>

// [h][w] from sample_alloc, linear, black level removed; not finite becomes 0. 8-bit pictures are
// taken for sRGB. A mosaic's sites are averaged with their neighbours, (1 2 1) / 4 across and down,
// which is even for every colour.
float *light_from(const struct image *im, struct err *e);

// The same in 8 bits, as eyes would see it: a square root, white at the 99.5th percentile.
uint8_t *grey_from(const float *light, size_t n, struct err *e);
