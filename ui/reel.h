// reel.h - the frames of a session in the order they were taken, to step through and to replay.
#pragma once
#include "core/image.h"
#include "core/session.h"

struct reel {
    char folder[400];
    struct session_frame *frame; // [n], owned
    int n, planned;
    struct session_report report;
    int at; // frame shown, 0..n-1; -1: none
};

// Reads the ledger again; stays where it is, on the last frame when it was on the last one.
bool reel_read(struct reel *r, const char *folder, struct err *e);
void reel_finish(struct reel *r); // accepts a zeroed struct

// The frame's counts as 0 (black) to 1 (white). *step is 2 in a mosaic.
bool reel_picture(const struct reel *r, int k, struct image *im, int *step, struct err *e);

// Good frames of the bracket that frame k belongs to, up to it.
int reel_bracket(const struct reel *r, int k, int *group);
