// found.h - what a driver sees on this machine, told one by one, for people who write a rig.
#pragma once

struct found {
    const char *uri;     // opens it: "v4l2:/dev/video0"
    const char *what;    // its model and what it can do, one line
    const char *problem; // NULL: none; else why it cannot be used now, and the remedy
};

typedef void found_fn(void *ctx, const struct found *found);
