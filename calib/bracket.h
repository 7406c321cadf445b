// bracket.h - frames of one scene at several exposure times, and pixels chosen from them.
#pragma once
#include "calib/response.h"
#include <stddef.h>

struct bracket_pixels {
    int n, nc, count; // frames, channels, pixels
    uint8_t *code;    // [count][nc][n], owned
};

// One pixel of every tile: the one where the frames are flattest, since an edge shows the lens, the
// JPEG and the tripod more than the response. At most some 12000. ERR_DATA when fewer than 100 of
// them are usable in two frames.
bool bracket_pick(struct bracket_pixels *px, const struct bracket *b, const struct response *r,
                  struct err *e);
void bracket_pixels_finish(struct bracket_pixels *px);

static inline const uint8_t *bracket_codes(const struct bracket_pixels *px, int i, int c) // [n]
{
    return px->code + ((size_t)i * (size_t)px->nc + (size_t)c) * (size_t)px->n;
}
