// view_source.h - where frames come from: a session on disk, or nacred's camera and the session
// that it is shooting; and the table that grows with them.
#pragma once
#include "ui/growth.h"
#include "ui/live.h"
#include "ui/reel.h"
#include "ui/view_stats.h"
#include "ui/worker.h"

struct source {
    struct live *live; // NULL: no daemon was asked for; kept while other items are shown
    bool is_live;      // the item shown is the camera
    bool on;           // the item shown has frames

    struct reel reel;
    bool playing;
    double next_s; // of the replay
    int event;     // of live that was last looked at

    struct stats stats;
    bool has_stats;
    double exposure_s; // of the frame shown
    uint64_t seq;      // and its number
    double thinned;    // pixels of the camera per pixel shown

    struct worker *worker;
    struct growth growth;      // the worker's while it is busy
    struct growth_order order; // wanted; frames 0: nothing
    double lambda_m, cx, cy;   // found by growth: px of the camera; NAN: not yet
    double pitch_m;            // that it has found and set last,
    int pitch_frames;          // from so many of them
    struct hdr_noise noise;    // counts squared
    int level, frames;         // of the table shown
    double seconds;            // that it took
    char trouble[240];         // why there is no table
};

struct view;

bool source_open(struct source *s, const char *socket, struct err *e); // socket NULL: none
void source_close(struct source *s);

// The item is shown from here on: a session's folder, or "" for the camera.
bool source_show(struct view *v, const char *folder, struct err *e);
void source_hide(struct view *v);

void source_tick(struct view *v);
double source_patience(const struct source *s);
bool source_is_busy(struct source *s); // a table is growing

void source_step(struct view *v, int by); // to another frame
void source_go(struct view *v, int frame);
void source_play(struct view *v); // starts or stops the replay

// Pixel of the picture where h = 0, and h per pixel of it.
void source_center(const struct view *v, double *i, double *j, double *h_per_px);
// Standard deviation of a value of the picture by the bracket's own noise; NAN: not yet known.
double source_sigma(const struct source *s, double value);
void source_text(const struct view *v, void (*fact)(const char *name, const char *value));
