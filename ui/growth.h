// growth.h - the table of a bracket's first frames: coarse at once, then finer.
//
// A job for a worker: every growth_run() ends with a whole table in linear sRGB, better than the
// one before, until growth_is_done(). A new order starts anew.
#pragma once
#include "process/lut_preview.h"
#include "ui/session_frames.h"

struct growth_order {
    char folder[400]; // of the session
    int group;        // of its frames; -1: the only one
    int frames;       // the first so many of the bracket, 2 or more
    double h_per_px;
    int size; // nodes of the final table
};

struct growth {
    struct growth_order order; // set it, and `fresh`, while no job runs
    bool fresh;

    // After a job:
    bool ok;
    struct err e;
    struct table table;               // n 0: taken, or there is none
    int level;                        // 1 to LUT_PREVIEW_LEVELS
    double seconds;                   // of the last job
    double lambda_m, cx, cy, pitch_m; // pitch NAN: the pattern does not repeat
    struct hdr_noise noise;           // of a sample above black, counts squared

    // Between jobs:
    struct lut_pattern pattern;
    struct spectrum light;
    struct lut_preview preview;
};

void growth_run(void *growth);
bool growth_is_done(const struct growth *g); // nothing is left to do for this order
void growth_finish(struct growth *g);        // accepts a zeroed struct
