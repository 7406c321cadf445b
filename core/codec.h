// codec.h - the picture formats, one pair of functions and one file each; imgfile.c lists them.
//
// Messages do not name the file: imgfile.c puts the path in front. A failed read may leave a half
// filled image behind, which the caller finishes; a failed write may leave half a file, which the
// caller removes.
#pragma once
#include "core/image.h"

bool exr_read(struct image *im, const char *path, struct err *e);
bool exr_write(const struct image *im, const char *path, struct err *e);

bool pfm_read(struct image *im, const char *path, struct err *e);
bool pfm_write(const struct image *im, const char *path, struct err *e);

bool rgbe_read(struct image *im, const char *path, struct err *e);
bool rgbe_write(const struct image *im, const char *path, struct err *e);

bool raw_read(struct image *im, const char *path, struct err *e);

// PNG, JPEG and TIFF.
bool picture_read(struct image *im, const char *path, struct err *e);
bool display_write(const struct image *im, const char *path, struct err *e);  // 8-bit sRGB
bool linear16_write(const struct image *im, const char *path, struct err *e); // 0..1, .tif .png

// Exposure data of a JPEG's EXIF block into meta; a file without any adds nothing.
void exif_read(struct meta *m, const char *path);
