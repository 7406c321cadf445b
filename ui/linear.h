// linear.h - light from pictures that carry the curve of a display.
#pragma once
#include "core/image.h"

// 8-bit samples are taken for sRGB and made linear, with a note that names `path`
// (NULL: silently); alpha stays. Others are linear.
void make_linear(struct image *im, const char *path);

// The same by --response: NULL or auto as above, srgb, linear, or a response record (calib
// response) that the picture's camera fits. ERR_DATA: a record for a picture that is not of 8 bits,
// or of other channels.
bool make_linear_by(struct image *im, const char *path, const char *response, struct err *e);
