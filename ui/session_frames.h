// session_frames.h - one bracket of a session, and its dark frames.
#pragma once
#include "ui/frames.h"

struct session_choice {
    const char *light, *filter; // NULL: any
    int group;                  // -1: any
    int first;                  // only so many of them, in the order they were taken; 0: all
};

bool is_session(const char *path); // a folder with a ledger in it

// The good frames of the one group that the choice leaves. ERR_DATA: none, or several (they are
// listed). *dark is filled from the session's dark frames of the same gain when there are two or
// more, else zeroed.
bool session_frames_read(struct frames *f, struct dark *dark, const char *folder,
                         const struct session_choice *choice, struct err *e);

// Only the dark frames, as a dark; ERR_DATA when there are fewer than two.
bool session_dark_read(struct dark *dark, const char *folder, struct err *e);
