// view_undo.h - going back to what was set before, and forth again.
#pragma once
#include "ui/view_params.h"

enum { UNDO_STEPS = 200 };

struct undo {
    struct params step[UNDO_STEPS]; // a ring; step[at % UNDO_STEPS] is what holds now
    long first, at, last;
};

void undo_start(struct undo *u, const struct params *p);
// A change is whole: a drag has ended, a key was pressed. Nothing when nothing changed.
void undo_note(struct undo *u, const struct params *p);
// False when there is no step that way. *what is the parameter that changes.
bool undo_back(struct undo *u, struct params *p, enum param *what);
bool undo_forth(struct undo *u, struct params *p, enum param *what);
