// run.h - a capture as a pure state machine: an event goes in, actions come out.
//
// It touches no device, clock, file or thread, so every order of events can be tested. Whoever owns
// the devices (shooter.h) feeds events and does the actions in order. Frames are matched to their
// settings by the shot's id, or by time and sequence, never by counting. Keeping a frame takes its
// time in another thread; the next shot does not wait for it, but at most `RUN_KEEPING` do.
#pragma once
#include "acquire/plan.h"

enum { RUN_KEEPING = 3, RUN_ACTIONS = 8 };

enum run_event_kind {
    RUN_START,   // also after resuming a session: steps that are proven are skipped
    RUN_MOVED,   // the filter is where it was sent
    RUN_LIT,     // the light changed; t_ns says when
    RUN_TIME,    // the time that was asked for has come
    RUN_FRAME,   // the camera delivered `frame`
    RUN_KEPT,    // a frame was judged and is on disk
    RUN_METERED, // a metering frame was looked at
    RUN_FAILED,  // camera, trigger or disk; `err`
    RUN_PAUSE,   // finish the shot, light off, wait
    RUN_CONTINUE,
    RUN_ABORT, // light off, end; what is kept stays
};

struct run_event {
    enum run_event_kind kind;
    int64_t now_ns;                // CLOCK_BOOTTIME
    int64_t t_ns;                  // RUN_LIT
    const struct cam_frame *frame; // RUN_FRAME
    int64_t start_ns;              // RUN_FRAME: its start on CLOCK_BOOTTIME; 0: not known
    int step;                      // RUN_KEPT: the step's index
    int id, against;              // RUN_KEPT: ids of the frame, and of what it was measured against
    const char *verdict, *reason; // RUN_KEPT
    int64_t measured_ns;          // RUN_KEPT; 0: not
    double measured_sigma;        // RUN_KEPT; relative
    double saturated, bright;     // RUN_METERED: share; part of full scale above black
    const struct err *err;        // RUN_FAILED
};

enum run_action_kind {
    RUN_DO_FILTER, // state: send the filter there; then RUN_MOVED or RUN_FAILED
    RUN_DO_LIGHT,  // state: mask; then RUN_LIT
    RUN_DO_SHOOT,  // shot
    RUN_DO_TAKE,   // copy the frame of this event: it is the one
    RUN_DO_KEEP,   // judge and store it as `step`, attempt `n`; then RUN_KEPT
    RUN_DO_METER,  // look at it; then RUN_METERED
    RUN_DO_PLAN,   // store steps [step, step + n); `last`: the plan is now known to its end
    RUN_DO_REVOKE, // take back frame `id`, or all of group `n` when it is 0; `verdict`, `text`
    RUN_DO_NOTE,   // text into the ledger
    RUN_DO_END,    // ended: err.code is ERR_NONE when complete
};

struct run_action {
    enum run_action_kind kind;
    uint32_t state;
    struct cam_shot shot;
    int step, n, id;
    bool last;
    const char *verdict;
    char text[160];
    struct err err;
};

struct run_output {
    int n;
    struct run_action action[RUN_ACTIONS];
    int64_t timer_ns; // when to send RUN_TIME; 0: never
};

struct run;

// `plan`, `rig` and `caps` outlive the run. Steps of an earlier part of the session (resume) come
// with `done` telling which are proven; NULL and 0 for a new one.
struct run *run_new(const struct plan *plan, const struct rig *rig, const struct cam_caps *caps,
                    int64_t filter_settle_ns, const struct session_step *step, const bool *done,
                    int n_steps);
void run_free(struct run *r); // accepts NULL

void run_feed(struct run *r, const struct run_event *event, struct run_output *out);

const struct session_step *run_step(const struct run *r, int index); // -1: that of metering
bool run_ended(const struct run *r);
void run_progress(const struct run *r, int *done, int *planned); // planned: as far as known
const char *run_state_name(const struct run *r); // "moving the filter", "exposing", ...
