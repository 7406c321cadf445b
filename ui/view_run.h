// view_run.h - plays a script to the view, one step a frame.
#pragma once
#include "ui/view.h"
#include "ui/view_script.h"

struct run {
    struct script script;
    int next;
    double until_s; // of a wait; 0: none
};

// Does the next step when the window is ready for it; false and *e: the script cannot go on.
bool run_step(struct run *r, struct view *v, struct err *e);
bool run_is_over(const struct run *r);
// Seconds until run_step() is due; 0: now; INFINITY: when something else has happened.
double run_patience(const struct run *r, struct view *v);
