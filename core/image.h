// image.h - a picture of linear samples, with what is known about it.
//
// Shape  px[h][w][nc], interleaved, row 0 is the top row. Pixel (i, j) has its centre at (i, j).
// Values linear; NAN marks "not measured" (0 is a value). Negative values are kept.
// Channels are named in meta "channels" ("R,G,B", "X,Y,Z", "Y"); absent means Y or R,G,B by count.
#pragma once
#include "core/err.h"
#include "core/meta.h"

struct image {
    int w, h, nc;
    float *px; // [h][w][nc], owned
    struct meta meta;
};

enum { IMAGE_MAX_SIDE = 65536, IMAGE_MAX_CHANNELS = 256 };

// All zero. ERR_DATA for sizes out of 1..IMAGE_MAX_*, ERR_FILE when memory does not hold it.
bool image_init(struct image *im, int w, int h, int nc, struct err *e);
void image_finish(struct image *im); // accepts a zeroed struct

// One channel of `im` as a new image; ERR_DATA when it has no such channel. Metadata comes along.
bool image_channel(const struct image *im, int c, struct image *out, struct err *e);

// Index of a channel by its name ("r", "G", "Z"; any case), -1 when there is none.
int image_channel_index(const struct image *im, const char *name);

// Non-finite samples: their number, and the first one's place.
struct flaws {
    long n;
    int i, j, c;
};
struct flaws image_flaws(const struct image *im);
