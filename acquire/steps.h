// steps.h - the steps of a run: which are open, which are proven, which one is next.
#pragma once
#include "acquire/plan.h"

enum step_state { STEP_OPEN, STEP_KEEPING, STEP_GOOD };

struct item {
    struct session_step step;
    enum step_state state; // change it by steps_set()
    int attempts, revokes;
    int id;                // of the good frame
    int agreed;            // frames that the good one was found to agree with
    int64_t last_measured; // of the last attempt that the pixels disagreed with
    bool was_changed;      // the last attempt came right after a change of settings
    bool was_wrong;        // and its exposure was not the one asked for
    int wait;              // frames to throw away before the next attempt: it is in doubt
};

struct steps {
    const struct plan *plan;
    const struct rig *rig;
    const struct cam_caps *caps;
    struct plan_group *group; // [n_groups], owned
    int n_groups, n, n_good;
    struct item *item; // [n], owned
    int cursor;        // the step shot last, or the next one
};

// With the steps of an earlier part of the session; `done` tells which are proven.
void steps_init(struct steps *s, const struct plan *plan, const struct rig *rig,
                const struct cam_caps *caps, const struct session_step *step, const bool *done,
                int n);
void steps_finish(struct steps *s); // accepts a zeroed struct

void steps_set(struct steps *s, int index, enum step_state state);

// The next open step: first of the cursor's group, from the cursor on and round; then any other.
// -1: none; *busy then tells that verdicts which may reopen steps of this group are due first.
int steps_next(const struct steps *s, bool *busy);

// The first group that has no steps yet, or NULL.
const struct plan_group *steps_unplanned(const struct steps *s);
// Plans a group with these exposures; a dark group takes those of all steps there are.
void steps_add(struct steps *s, const struct plan_group *g, const int64_t *exposure_ns, int n);
void steps_add_darks(struct steps *s, const struct plan_group *g);

int steps_of_frame(const struct steps *s, int id); // the step that frame `id` proves; -1: none
void steps_progress(const struct steps *s, int *done, int *planned);
