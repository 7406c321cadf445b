// imgfile.h - pictures in files, by extension.
//
// Read: .exr .pfm .hdr (linear, as stored), .png .jpg .tif (8 or 16 bit, scaled to 0..1, still with
// the file's own curve: meta "nacre.encoded" is 1 for 8-bit pictures, 0 for 16-bit ones), .dng and
// camera raw (sensor counts of the mosaic, black level not removed, one channel, meta
// "nacre.bayer"). Exposure data found in the file goes to the standard meta keys ("expTime" in s,
// "isoSpeed", "aperture"). Write: .exr .pfm .hdr (linear), .png .jpg (display sRGB, 8 bit), .tif
// (16 bit linear, clipped to 0..1). A file that cannot be opened is ERR_FILE; one whose content is
// not what its name says is ERR_DATA. Nothing is left behind by a failed write.
#pragma once
#include "core/image.h"

bool image_read(struct image *im, const char *path, struct err *e);
bool image_write(const struct image *im, const char *path, struct err *e);

// Refuse non-finite samples: "x.pfm: pixel (3, 7) is NaN (12 such samples)", ERR_DATA.
bool image_check_finite(const struct image *im, const char *path, struct err *e);

// ".exr" in lower case, "" when there is none. Lives until the thread's eighth next call.
const char *path_ext(const char *path);
