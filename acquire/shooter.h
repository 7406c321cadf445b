// shooter.h - a capture under way: devices, run, writer and session, driven by a loop.
//
// Does what the run says and tells it what happened. It never blocks: pictures are measured and
// written by the writer's thread. One thread.
#pragma once
#include "acquire/devices.h"
#include "acquire/loop.h"
#include "acquire/plan.h"
#include "core/session.h"

struct shooter;

struct shooter_order {
    const char *rig, *plan, *session; // paths
    bool resume; // go on with a session; rig and plan must be those it was begun with
    const struct drivers *drivers;
    // All optional; called from the loop. `end` once, with ERR_NONE when the session is complete;
    // shooter_free() may be called from it.
    void (*kept)(void *ctx, const struct session_frame *frame, int done, int planned);
    void (*seen)(void *ctx, const struct cam_frame *frame, const struct cam_caps *caps);
    void (*end)(void *ctx, const struct err *how);
    void *ctx;
};

// Opens the devices, checks the plan, makes (or reopens) the session and starts. NULL on failure.
struct shooter *shooter_new(struct loop *l, const struct shooter_order *order, struct err *e);
void shooter_free(struct shooter *s); // light off, what was judged is kept; accepts NULL

void shooter_pause(struct shooter *s);
void shooter_continue(struct shooter *s);
void shooter_abort(struct shooter *s);
const char *shooter_state(const struct shooter *s);
void shooter_progress(const struct shooter *s, int *done, int *planned);

// Opens the devices and judges the plan; no light goes on, nothing is written.
bool shooter_check(const struct shooter_order *order, struct plan_report *report, struct err *e);
