// lut_preview.h - a table that improves while a bracket is being shot: coarse first, then finer.
//
// The window calls lut_preview_frame() whenever the merge has a new frame in it, and
// lut_preview_next() while there is time; every call gives a whole table, each with twice the nodes
// a side of the one before, the last one as requested. One thread at a time.
#pragma once
#include "process/lut.h"

struct lut_preview {
    struct lut_request request; // of the final table; what it points to is the caller's
    int level;                  // next: 0 the coarsest
};

enum { LUT_PREVIEW_LEVELS = 4 };

void lut_preview_frame(struct lut_preview *p, const struct lut_pattern *pattern); // starts anew
bool lut_preview_done(const struct lut_preview *p);

// The next better table; false on failure. Not to be called when done.
bool lut_preview_next(struct lut_preview *p, struct table *t, struct err *e);
