// preview.h - the newest frame for whoever looks on, in shared memory, never in the way.
//
// A memfd of two pictures: the writer fills the one that is not current and then makes it current.
// A reader maps the memory, reads `current`, copies that picture, and keeps it if its `serial` is
// still the same and even. A reader that is stopped costs nothing; what it misses is gone.
// Large frames are thinned to at most PREVIEW_SIDE on a side, mosaic cells kept whole.
#pragma once
#include "acquire/camera.h"
#include <stdatomic.h>

enum { PREVIEW_SIDE = 1024, PREVIEW_MAGIC = 0x6e637276 };

struct preview_picture {
    _Atomic uint32_t serial; // odd while being written
    int32_t w, h, pattern, white;
    double black;
    int64_t exposure_ns, device_ns;
    uint64_t seq;
    uint16_t px[PREVIEW_SIDE * PREVIEW_SIDE]; // [h][w] counts
};

struct preview_memory {
    uint32_t magic, version;
    _Atomic uint32_t current; // 0 or 1
    struct preview_picture picture[2];
};

struct preview;

struct preview *preview_new(struct err *e);
void preview_free(struct preview *p);    // accepts NULL
int preview_fd(const struct preview *p); // sealed against growing and shrinking
void preview_show(struct preview *p, const struct cam_frame *f, const struct cam_caps *caps);
