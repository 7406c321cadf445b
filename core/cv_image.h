// cv_image.h - OpenCV's imread and imwrite, as C.
#pragma once
#ifdef __cplusplus
extern "C" {
#endif
#include "core/image.h"

// 8- and 16-bit samples scaled to 0..1, float ones as stored; meta "nacre.encoded" is 1 for 8 bit.
bool cv_read(struct image *im, const char *path, struct err *e);

// px[h][w][nc], nc 1 or 3 (R, G, B), of 1 or 2 bytes a sample; the extension chooses the format.
bool cv_write(const void *px, int w, int h, int nc, int sample_bytes, const char *path,
              struct err *e);

#ifdef __cplusplus
}
#endif
