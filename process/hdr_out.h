// hdr_out.h - the image that a merge fills: radiance, variance and mask (process/hdr.h).
#pragma once
#include "process/hdr.h"
#include <stddef.h>

enum hdr_state { HDR_MEASURED, HDR_SATURATED, HDR_BLACK };

struct hdr_out {
    struct image im; // [h][w][2 nc + 1]
    int nc;
    long *state; // [h][3] channels in each state, per row: counted without order
};

bool hdr_out_init(struct hdr_out *o, int w, int h, int nc, struct err *e);

// Channel 0 of a pixel first: it begins the mask. Rows from any thread.
static inline void hdr_out_set(struct hdr_out *o, int i, int j, int c, float radiance,
                               float variance, enum hdr_state state)
{
    const size_t nc = (size_t)o->nc;
    float *p = o->im.px + ((size_t)j * (size_t)o->im.w + (size_t)i) * (2 * nc + 1);
    p[c] = radiance;
    p[o->nc + c] = state == HDR_MEASURED ? variance : radiance * radiance;
    p[2 * nc] = state == HDR_MEASURED && (c == 0 || p[2 * nc] > 0);
    o->state[3 * j + (int)state]++;
}

// Moves the image to `out`, or fails when nothing was measured. Ends `o` either way.
bool hdr_out_take(struct hdr_out *o, struct image *out, struct hdr_counts *counts, struct err *e);
