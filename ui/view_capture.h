// view_capture.h - beginning, holding and ending a capture of nacred from the window.
#pragma once

enum { CAPTURE_PLANS = 16 };

struct capture_order {
    const char *rig, *folder;       // of the rig's file; where sessions are made
    char *plan[CAPTURE_PLANS];      // [n], owned: the one that was asked for, then those that ship
    char names[CAPTURE_PLANS * 64]; // theirs, each ended by 0, for a menu
    int n, at;
};

struct live;

// Files are looked at when a capture is begun.
void capture_order_init(struct capture_order *o, const char *rig, const char *plan,
                        const char *folder);
void capture_order_finish(struct capture_order *o); // accepts a zeroed struct

// Asks nacred to shoot the chosen plan into a new session, named after the time. The window's
// connection owns it: when the window ends, the light goes off and what is kept stays.
void capture_begin(struct capture_order *o, struct live *l);
void capture_hold(struct live *l); // pauses, or goes on
