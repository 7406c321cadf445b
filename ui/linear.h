// linear.h - light from pictures that carry the curve of a display.
#pragma once
#include "core/image.h"

// 8-bit samples are taken for sRGB and made linear, with a note that names `path`
// (NULL: silently); alpha stays. Others are linear.
void make_linear(struct image *im, const char *path);
