// run_state.h - the inside of a run, shared by the files that make it up: run.c (the way of a
// shot), run_groups.c (what is to be shot) and run_verdict.c (what comes of a shot). Nobody else's.
#pragma once
#include "acquire/meter.h"
#include "acquire/run.h"
#include "acquire/steps.h"

enum run_state {
    IDLE,
    MOVING,
    RESTING,
    SETTLING,
    LEADING,
    EXPOSING,
    LAGGING,
    DARKENING,
    WAITING,
    PAUSED,
    ENDED
};

struct run {
    const struct plan *plan;
    const struct rig *rig;
    const struct cam_caps *caps;
    int64_t filter_settle_ns;
    struct steps steps;

    enum run_state state;
    struct meter meter;
    struct session_step meter_step; // as a step, for the way of a shot
    int current;                    // item being shot; -1: metering
    int filter_at;                  // -1: not known
    uint32_t lit;                   // mask asked for
    int64_t lit_ns, rest_until_ns;
    int64_t light_on_at_ns, light_off_at_ns; // negative lead and lag: inside the exposure; 0: no
    int64_t deadline_ns, timer_ns;
    struct cam_shot shot; // the last one
    int64_t shot_ns;
    bool have_shot, have_seq;
    uint64_t seq;
    int settle_left, extra_settle, late;
    bool careful; // wait for every verdict before the next shot
    bool changed; // this shot came right after a change of settings
    int keeping;
    bool metering, paused, failed;
    struct err end;
};

struct run_action *run_act(struct run_output *out, enum run_action_kind kind);
void run_note(struct run_output *out, const char *fmt, ...) __attribute__((format(printf, 2, 3)));
void run_light(struct run *r, uint32_t mask, struct run_output *out);
const struct session_step *run_target(const struct run *r);    // the step being shot, or metering's
const struct rig_light *run_target_light(const struct run *r); // NULL: without light
// The run ends as soon as what is under way has ended; the first reason counts.
void run_fail(struct run *r, const struct err *why, struct run_output *out);
// A step was shot so many times in vain.
void run_give_up(struct run *r, const struct session_step *t, int times, const char *what,
                 const char *reason, struct run_output *out);

// Plans every group whose exposures are known. True when the next one must be metered first.
bool run_plan_groups(struct run *r, struct run_output *out);
void run_metered(struct run *r, const struct run_event *ev, struct run_output *out);
void run_judged(struct run *r, const struct run_event *ev, struct run_output *out);
