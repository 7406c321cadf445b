// run.c - the states of a capture and what leads from one to the next.
//
// One shot: filter, rest (the light's duty), frames to let new settings settle, light and its lead,
// exposure, lag, light off, keep. A bad frame puts its step back; the run stops when a step has
// used up its retries. When two attempts agree with each other but not with a frame that nothing
// has confirmed, that frame was the wrong one: it is revoked.
#define _GNU_SOURCE
#include "acquire/run.h"
#include "acquire/meter.h"
#include "acquire/steps.h"
#include "core/mem.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const int64_t MARGIN_NS = 2000000000; // patience beyond what devices promise
static const double SAME_MEASURE = 0.06;     // two attempts that say the same
enum { MAX_REVOKES = 3, MAX_EXTRA_SETTLE = 3 };

enum state {
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
static const char *const state_names[] = {
    "not started",
    "moving the filter",
    "resting the light",
    "letting settings settle",
    "switching the light on",
    "exposing",
    "holding the light",
    "switching the light off",
    "storing",
    "paused",
    "ended",
};

struct run {
    const struct plan *plan;
    const struct rig *rig;
    const struct cam_caps *caps;
    int64_t filter_settle_ns;
    struct steps steps;

    enum state state;
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

const struct session_step *run_step(const struct run *r, int index)
{
    return index < 0 ? &r->meter_step : index < r->steps.n ? &r->steps.item[index].step : NULL;
}
bool run_ended(const struct run *r)
{
    return r->state == ENDED;
}
const char *run_state_name(const struct run *r)
{
    return state_names[r->state];
}
void run_progress(const struct run *r, int *done, int *planned)
{
    steps_progress(&r->steps, done, planned);
}

struct run *run_new(const struct plan *plan, const struct rig *rig, const struct cam_caps *caps,
                    int64_t filter_settle_ns, const struct session_step *step, const bool *done,
                    int n_steps)
{
    struct run *r = xcalloc(1, sizeof *r);
    *r = (struct run){.plan = plan,
                      .rig = rig,
                      .caps = caps,
                      .filter_settle_ns = filter_settle_ns,
                      .filter_at = -1,
                      .current = -1};
    steps_init(&r->steps, plan, rig, caps, step, done, n_steps);
    return r;
}

void run_free(struct run *r)
{
    if (!r)
        return;
    steps_finish(&r->steps);
    free(r);
}

static struct run_action *act(struct run_output *out, enum run_action_kind kind)
{
    if (out->n == RUN_ACTIONS)
        abort(); // a bug: no event leads to this many
    out->action[out->n] = (struct run_action){.kind = kind};
    return &out->action[out->n++];
}

__attribute__((format(printf, 2, 3))) static void note(struct run_output *out, const char *fmt, ...)
{
    struct run_action *a = act(out, RUN_DO_NOTE);
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(a->text, sizeof a->text, fmt, ap);
    va_end(ap);
}

static void light(struct run *r, uint32_t mask, struct run_output *out)
{
    act(out, RUN_DO_LIGHT)->state = mask;
    r->lit = mask;
}

static const struct session_step *target(const struct run *r)
{
    return r->current < 0 ? &r->meter_step : &r->steps.item[r->current].step;
}

static const struct rig_light *target_light(const struct run *r)
{
    const int k = rig_light_index(r->rig, target(r)->light);
    return k < 0 ? NULL : &r->rig->light[k];
}

static void fail(struct run *r, const struct err *why, struct run_output *out)
{
    if (r->failed)
        return;
    r->failed = true;
    r->end = *why;
    if (r->lit)
        light(r, 0, out);
    r->state = WAITING;
}

static void end(struct run *r, struct run_output *out)
{
    int done, planned;
    run_progress(r, &done, &planned);
    if (r->failed && done) { // what is kept is worth something
        r->end.code = ERR_PARTIAL;
        err_in(&r->end, "%d of %d frames are kept", done, planned);
    }
    act(out, RUN_DO_END)->err = r->end;
    r->state = ENDED;
}

static void start_metering(struct run *r, const struct plan_group *g)
{
    struct session_step *step;
    plan_steps(r->plan, r->rig, g, &r->plan->meter_ns, 1, r->caps, 0, &step);
    r->meter = (struct meter){.exposure_ns = step[0].exposure_ns};
    r->meter_step = step[0];
    r->meter_step.kind = SESSION_METER;
    free(step);
}

// Tells that steps from `first` on are new.
static void planned(struct run *r, int first, struct run_output *out)
{
    struct run_action *a = act(out, RUN_DO_PLAN);
    a->step = first;
    a->n = r->steps.n - first;
    a->last = !steps_unplanned(&r->steps);
}

// Plans every group whose exposures are known. True when the next one must be metered first.
static bool plan_groups_to_come(struct run *r, struct run_output *out)
{
    const int first = r->steps.n;
    const struct plan_group *g;
    bool must_meter = false;
    while (!must_meter && (g = steps_unplanned(&r->steps))) {
        if (r->plan->n_exposures)
            steps_add(&r->steps, g, r->plan->exposure_ns, r->plan->n_exposures);
        else if (g->kind == SESSION_DARK)
            steps_add_darks(&r->steps, g);
        else {
            start_metering(r, g);
            must_meter = true;
        }
    }
    if (r->steps.n > first)
        planned(r, first, out);
    return must_meter;
}

static void shoot(struct run *r, int64_t now, struct run_output *out)
{
    const struct session_step *t = target(r);
    const struct rig_light *l = r->settle_left ? NULL : target_light(r);
    r->shot = (struct cam_shot){r->shot.id + 1, t->exposure_ns, t->gain, t->focus_per_m};
    r->have_shot = true;
    r->shot_ns = now;
    act(out, RUN_DO_SHOOT)->shot = r->shot;
    r->deadline_ns =
        now + t->exposure_ns + r->caps->row_ns * r->caps->h + r->caps->dead_ns + MARGIN_NS;
    r->light_on_at_ns = l && l->lead_s < 0 ? now - llround(l->lead_s * 1e9) : 0;
    r->light_off_at_ns = l && l->lag_s < 0 ? now + t->exposure_ns + llround(l->lag_s * 1e9) : 0;
    r->state = r->settle_left ? SETTLING : EXPOSING;
}

static void light_and_shoot(struct run *r, int64_t now, struct run_output *out)
{
    const struct rig_light *l = target_light(r);
    if (l && now < r->rest_until_ns) {
        r->timer_ns = r->rest_until_ns;
        r->state = RESTING;
    } else if (l && l->lead_s >= 0) {
        light(r, UINT32_C(1) << l->line, out);
        r->timer_ns = 0;
        r->state = LEADING;
    } else {
        shoot(r, now, out);
    }
}

static bool same_settings(const struct run *r, const struct session_step *t)
{
    const struct cam_shot *s = &r->shot;
    return r->have_shot && s->exposure_ns == t->exposure_ns && fabs(s->gain - t->gain) < 1e-9 &&
           (isnan(t->focus_per_m) || fabs(s->focus_per_m - t->focus_per_m) < 1e-9);
}

static void settle_and_shoot(struct run *r, int64_t now, struct run_output *out)
{
    if (r->settle_left)
        shoot(r, now, out);
    else
        light_and_shoot(r, now, out);
}

static void begin(struct run *r, int item, int64_t now, struct run_output *out)
{
    r->current = item;
    if (item >= 0)
        r->steps.cursor = item;
    const struct session_step *t = target(r);
    r->changed = !same_settings(r, t);
    r->settle_left = r->changed ? r->caps->settle + r->extra_settle : 0;
    const int filter = rig_filter_index(r->rig, t->filter);
    if (filter >= 0 && r->filter_at != r->rig->filter[filter].position) {
        act(out, RUN_DO_FILTER)->state = (uint32_t)r->rig->filter[filter].position;
        r->timer_ns = now + r->filter_settle_ns + MARGIN_NS;
        r->state = MOVING;
    } else {
        settle_and_shoot(r, now, out);
    }
}

static void advance(struct run *r, int64_t now, struct run_output *out)
{
    bool busy = false;
    r->timer_ns = 0;
    r->state = WAITING;
    if (r->failed) {
        if (!r->keeping)
            end(r, out);
        return;
    }
    if (r->paused) {
        r->state = PAUSED;
        return;
    }
    if (r->metering || r->keeping >= (r->careful ? 1 : RUN_KEEPING))
        return;
    int k = r->meter.exposure_ns ? -1 : steps_next(&r->steps, &busy);
    if (k < 0 && (busy || r->keeping))
        return;
    if (k < 0 && !r->meter.exposure_ns && !plan_groups_to_come(r, out) &&
        (k = steps_next(&r->steps, &busy)) < 0)
        end(r, out);
    else
        begin(r, k, now, out);
}

static void filter_moved(struct run *r, int64_t now, struct run_output *out)
{
    if (r->state != MOVING)
        return;
    r->filter_at = r->rig->filter[rig_filter_index(r->rig, target(r)->filter)].position;
    settle_and_shoot(r, now, out);
}

static void keep(struct run *r, int64_t now, struct run_output *out)
{
    if (r->current < 0) {
        struct run_action *a = act(out, RUN_DO_METER);
        a->step = -1;
        a->n = r->meter.shots + 1;
        r->metering = true;
    } else {
        struct item *t = &r->steps.item[r->current];
        t->state = STEP_KEEPING;
        t->attempts++;
        t->was_changed = r->changed && !r->caps->settle && !r->extra_settle;
        r->keeping++;
        struct run_action *a = act(out, RUN_DO_KEEP);
        a->step = r->current;
        a->n = t->attempts;
    }
    advance(r, now, out);
}

static void darken(struct run *r, struct run_output *out)
{
    light(r, 0, out);
    r->timer_ns = 0;
    r->state = DARKENING;
}

static void light_changed(struct run *r, const struct run_event *ev, struct run_output *out)
{
    const struct rig_light *l = target_light(r);
    if (r->lit) {
        r->lit_ns = ev->t_ns;
    } else if (l && r->lit_ns) {
        const double on_ns = (double)(ev->t_ns - r->lit_ns);
        r->rest_until_ns = ev->now_ns + llround(on_ns * (1 / l->max_duty - 1));
        r->lit_ns = 0;
    }
    if (r->state == DARKENING) {
        keep(r, ev->now_ns, out);
    } else if (r->state == LEADING) {
        const int64_t lead_ns = llround(l->lead_s * 1e9);
        if (lead_ns > 0)
            r->timer_ns = ev->now_ns + lead_ns;
        else
            shoot(r, ev->now_ns, out);
    }
}

static void give_up(struct run *r, const struct session_step *t, int times, const char *what,
                    const char *reason, struct run_output *out)
{
    struct err e;
    char seconds[40];
    err_set(&e, ERR_PARTIAL, "step %d (%s%s%s, %s): %s %d times%s%s", t->index,
            *t->light ? t->light : "dark", *t->filter ? ", " : "", t->filter,
            quantity_text(1e-9 * (double)t->exposure_ns, UNIT_S, seconds, sizeof seconds), what,
            times, *reason ? ": " : "", reason);
    fail(r, &e, out);
}

static void no_frame(struct run *r, int64_t now, struct run_output *out)
{
    const struct session_step *t = target(r);
    int *attempts = r->current < 0 ? &r->meter.shots : &r->steps.item[r->current].attempts;
    note(out, "no frame for shot %llu of step %d", (unsigned long long)r->shot.id,
         r->current < 0 ? -1 : t->index);
    if (r->lit)
        light(r, 0, out);
    r->have_shot = false; // what the device has in force is not known any more
    if (++*attempts > r->plan->retries)
        give_up(r, t, *attempts, "no frame came", "", out);
    advance(r, now, out);
}

static void time_came(struct run *r, int64_t now, struct run_output *out)
{
    if (r->state == MOVING) {
        struct err e;
        err_set(&e, ERR_DEVICE, "filter '%s' did not arrive in time", target(r)->filter);
        fail(r, &e, out);
        advance(r, now, out);
    } else if (r->state == RESTING && now >= r->rest_until_ns) {
        light_and_shoot(r, now, out);
    } else if (r->state == LEADING && r->timer_ns && now >= r->timer_ns) {
        shoot(r, now, out);
    } else if (r->state == LAGGING && now >= r->timer_ns) {
        darken(r, out);
    } else if (r->state == EXPOSING || r->state == SETTLING) {
        if (now >= r->deadline_ns) {
            no_frame(r, now, out);
            return;
        }
        const struct rig_light *l = target_light(r);
        if (r->light_on_at_ns && now >= r->light_on_at_ns) {
            light(r, UINT32_C(1) << l->line, out);
            r->light_on_at_ns = 0;
        } else if (r->light_off_at_ns && now >= r->light_off_at_ns) {
            light(r, 0, out);
            r->light_off_at_ns = 0;
        }
    }
}

// Whether a frame belongs to the shot that is under way.
static bool belongs(struct run *r, const struct run_event *ev, struct run_output *out)
{
    const struct cam_frame *f = ev->frame;
    const char *why = NULL;
    if (r->have_seq && f->seq <= r->seq)
        why = "a sequence number of before";
    else if (r->state != EXPOSING && r->state != SETTLING)
        why = "no shot is under way";
    else if (f->shot && f->shot != r->shot.id)
        why = "made for another shot";
    else if (!f->shot && ev->start_ns && ev->start_ns < r->shot_ns)
        why = "exposed before its shot";
    if (!why && f->shot && r->have_seq && f->seq > r->seq + 1)
        note(out, "frames lost: sequence %llu follows %llu", (unsigned long long)f->seq,
             (unsigned long long)r->seq);
    if (!r->have_seq || f->seq > r->seq)
        r->seq = f->seq;
    r->have_seq = true;
    if (why)
        note(out, "frame %llu thrown away: %s", (unsigned long long)f->seq, why);
    return !why;
}

static void frame_came(struct run *r, const struct run_event *ev, struct run_output *out)
{
    if (!belongs(r, ev, out))
        return;
    if (r->state == SETTLING) {
        r->settle_left--;
        settle_and_shoot(r, ev->now_ns, out);
        return;
    }
    const struct rig_light *l = target_light(r);
    act(out, RUN_DO_TAKE);
    if (!r->lit) {
        keep(r, ev->now_ns, out);
    } else if (l && l->lag_s > 0) {
        r->timer_ns = ev->now_ns + llround(l->lag_s * 1e9);
        r->state = LAGGING;
    } else {
        darken(r, out);
    }
}

static void kept_good(struct run *r, struct item *t, const struct run_event *ev,
                      struct run_output *out)
{
    const int other = steps_of_frame(&r->steps, ev->against);
    t->state = STEP_GOOD;
    t->id = ev->id;
    t->agreed = other >= 0;
    if (other >= 0)
        r->steps.item[other].agreed++;
    // Wrong right after a change, then right with the same settings: they come into force late.
    if (t->was_wrong && !t->was_changed && ++r->late >= 2 && r->extra_settle < MAX_EXTRA_SETTLE) {
        r->extra_settle++;
        r->late = 0;
        note(out, "the camera applies settings late: %d more frames thrown away after a change",
             r->extra_settle);
    }
}

static void revoke(struct run *r, int step, const struct run_event *ev, struct run_output *out)
{
    struct item *t = &r->steps.item[step];
    struct run_action *a = act(out, RUN_DO_REVOKE);
    a->id = ev->against;
    snprintf(a->text, sizeof a->text, "shots of step %d agree with each other, not with it",
             ev->step);
    t->state = STEP_OPEN;
    t->attempts = 0;
    t->revokes++;
}

static void kept_bad(struct run *r, struct item *t, const struct run_event *ev,
                     struct run_output *out)
{
    const int other = steps_of_frame(&r->steps, ev->against);
    const bool wrong =
        !strcmp(ev->verdict, "wrong-light") || !strcmp(ev->verdict, "wrong-exposure");
    t->state = STEP_OPEN;
    t->was_wrong = wrong && t->was_changed;
    r->steps.cursor = ev->step;
    r->careful = true;
    if (!strcmp(ev->verdict, "same-filter"))
        r->filter_at = -1; // send it again
    const bool again = ev->measured_ns && t->last_measured &&
                       fabs((double)ev->measured_ns / (double)t->last_measured - 1) < SAME_MEASURE;
    t->last_measured = wrong ? ev->measured_ns : 0;
    const bool unconfirmed = wrong && other >= 0 && !r->steps.item[other].agreed;
    if (unconfirmed && again && r->steps.item[other].revokes < MAX_REVOKES) {
        revoke(r, other, ev, out);
        t->attempts = 0;
        t->last_measured = 0;
    } else if (t->attempts > r->plan->retries) {
        if (unconfirmed)
            revoke(r, other, ev, out); // one of the two is wrong, and nothing tells which
        give_up(r, &t->step, t->attempts, ev->verdict, ev->reason ? ev->reason : "", out);
    }
}

static void kept(struct run *r, const struct run_event *ev, struct run_output *out)
{
    struct item *t = &r->steps.item[ev->step];
    r->keeping--;
    if (!strcmp(ev->verdict, "good"))
        kept_good(r, t, ev, out);
    else
        kept_bad(r, t, ev, out);
    if (r->state == WAITING)
        advance(r, ev->now_ns, out);
}

static void metered(struct run *r, const struct run_event *ev, struct run_output *out)
{
    const struct plan_group *g = steps_unplanned(&r->steps);
    int64_t exposure_ns[PLAN_MAX_EXPOSURES];
    int n;
    r->metering = false;
    if (!r->failed && g &&
        meter_look(&r->meter, r->plan, r->caps, target_light(r), ev->saturated, ev->bright,
                   exposure_ns, &n) == METER_DONE) {
        const int first = r->steps.n;
        struct err e;
        if (n) {
            steps_add(&r->steps, g, exposure_ns, n);
            planned(r, first, out);
        } else {
            err_set(&e, ERR_DATA,
                    "metering through '%s' found no exposure that camera and light "
                    "allow",
                    r->meter_step.filter);
            fail(r, &e, out);
        }
    }
    r->meter_step.exposure_ns = r->meter.exposure_ns;
    advance(r, ev->now_ns, out);
}

static int64_t next_timer(const struct run *r)
{
    if (r->state != EXPOSING && r->state != SETTLING)
        return r->state == MOVING || r->state == RESTING || r->state == LEADING ||
                       r->state == LAGGING
                   ? r->timer_ns
                   : 0;
    int64_t t = r->deadline_ns;
    if (r->light_on_at_ns && r->light_on_at_ns < t)
        t = r->light_on_at_ns;
    if (r->light_off_at_ns && r->light_off_at_ns < t)
        t = r->light_off_at_ns;
    return t;
}

void run_feed(struct run *r, const struct run_event *ev, struct run_output *out)
{
    struct err stopped;
    out->n = 0;
    switch (r->state == ENDED ? RUN_PAUSE : ev->kind) {
    case RUN_START: advance(r, ev->now_ns, out); break;
    case RUN_MOVED: filter_moved(r, ev->now_ns, out); break;
    case RUN_LIT: light_changed(r, ev, out); break;
    case RUN_TIME: time_came(r, ev->now_ns, out); break;
    case RUN_FRAME: frame_came(r, ev, out); break;
    case RUN_KEPT: kept(r, ev, out); break;
    case RUN_METERED: metered(r, ev, out); break;
    case RUN_FAILED:
        fail(r, ev->err, out);
        advance(r, ev->now_ns, out);
        break;
    case RUN_PAUSE:
        if (r->state != ENDED)
            r->paused = true;
        if (r->state == WAITING)
            advance(r, ev->now_ns, out);
        break;
    case RUN_CONTINUE:
        r->paused = false;
        if (r->state == PAUSED)
            advance(r, ev->now_ns, out);
        break;
    case RUN_ABORT:
        err_set(&stopped, ERR_PARTIAL, "stopped");
        fail(r, &stopped, out);
        advance(r, ev->now_ns, out);
        break;
    }
    out->timer_ns = next_timer(r);
}
