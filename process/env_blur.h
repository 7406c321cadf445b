// env_blur.h - one-dimensional filters along great circles of a lat-long map: R17's passes.
//
// R17 finds half vector and light direction of every tap at every pixel. Around the poles the
// sphere looks the same at each column, so here that is done once a row: a tap is a row and a
// shift, and four weights of bilinear look-up. Taps that read the same pixels are merged, and a
// pass is a sum of shifted rows.
#pragma once
#include "process/env_separable.h"

// A map as planes [3][h + 2][line]: each row runs on beyond its end, and one row lies beyond
// either pole, so that any shift is a run.
struct wide {
    int w, h;
    size_t line;
    float *px; // owned
};
bool wide_init(struct wide *m, int w, int h, struct err *e);
void wide_finish(struct wide *m);
void wide_take(struct wide *m, const struct image *im);
void wide_give(const struct wide *m, float scale, struct image *im); // not below zero

// out = blur of in, or out += it. `axis` in the plane of columns (right) and rows (down).
bool env_blur(const struct wide *in, const struct env_taps *taps, const double axis[2], bool add,
              struct wide *out, struct err *e);
