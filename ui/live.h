// live.h - nacred from the window's side: its newest frame, its captures; it may come and go.
//
// Nothing here blocks. live_turn() does what is due: connects, asks, listens, looks at the shared
// picture. A daemon that is gone is looked for again, every second.
#pragma once
#include "core/image.h"
#include "core/session.h"

struct live;

struct live_status {
    bool connected;
    char why[200]; // not connected
    int64_t pid;
    int64_t capture; // 0: none is running
    char session[400], state[32];
    int done, planned;
    char last[240]; // what the last event said
    int event;      // counts them
};

struct live_frame {
    struct image im; // one channel, 0 black to 1 white; owned
    int pattern;     // enum cam_pattern
    int64_t exposure_ns;
    uint64_t seq;
};

// `socket` NULL or "auto": where clients look. ERR_FILE when that cannot be told.
bool live_open(struct live **l, const char *socket, struct err *e);
void live_close(struct live *l); // accepts NULL

bool live_turn(struct live *l);             // true: status or picture has changed
double live_patience(const struct live *l); // seconds until live_turn() is due
const struct live_status *live_status(const struct live *l);
// The newest frame when it is another than the last one taken; the caller's from then on.
bool live_take(struct live *l, struct live_frame *f);

void live_order(struct live *l, const char *method); // "capture.pause" ... of the capture
// Asks for a capture, which is this connection's: it is stopped when that closes. What comes of it
// stands in the status.
void live_start(struct live *l, const char *rig, const char *plan, const char *session);
