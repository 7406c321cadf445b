// run.c - the states of a capture and what leads from one to the next.
//
// One shot: filter, rest (the light's duty), frames to let new settings settle, light and its lead,
// exposure, lag, light off, keep. A bad frame puts its step back; the run stops when a step has
// used up its retries. When two attempts agree with each other but not with a frame that nothing
// has confirmed, that frame was the wrong one: it is revoked.
#define _GNU_SOURCE
#include "acquire/run.h"
#include "core/mem.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const int64_t MARGIN_NS = 2000000000; // patience beyond what devices promise
static const double METER_TARGET = 0.6;      // of full scale, the brightest pixels
static const double SAME_MEASURE = 0.06;     // two attempts that say the same
enum { MAX_REVOKES = 3, MAX_METER_SHOTS = 12, MAX_EXTRA_SETTLE = 3 };

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

struct item {
    struct session_step step;
    enum { TODO, KEEPING, GOOD } state;
    int attempts, revokes, agreed;
    int id;                // of the good frame
    int64_t last_measured; // of the last attempt that the pixels disagreed with
    bool was_changed;      // the last attempt came right after a change of settings
    bool was_wrong;
};

struct run {
    const struct plan *plan;
    const struct rig *rig;
    const struct cam_caps *caps;
    int64_t filter_settle_ns;

    struct plan_group *group;
    int n_groups, n_items;
    struct item *item; // [n_items], owned
    int cursor;        // the step shot last, or the next one

    enum state state;
    struct session_step meter; // what is metered; exposure_ns 0: nothing
    int meter_shots;
    int current;   // item being shot; -1: metering
    int filter_at; // -1: not known
    uint32_t lit;  // mask asked for
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
    return index >= 0 && index < r->n_items ? &r->item[index].step : NULL;
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
    *done = 0;
    *planned = r->n_items;
    for (int k = 0; k < r->n_items; k++)
        *done += r->item[k].state == GOOD;
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
    r->n_groups = plan_groups(plan, rig, &r->group);
    r->item = xcalloc((size_t)n_steps + 1, sizeof *r->item);
    for (; r->n_items < n_steps; r->n_items++)
        r->item[r->n_items] =
            (struct item){.step = step[r->n_items], .state = done[r->n_items] ? GOOD : TODO};
    return r;
}

void run_free(struct run *r)
{
    if (!r)
        return;
    free(r->group);
    free(r->item);
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
    return r->current < 0 ? &r->meter : &r->item[r->current].step;
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

// --- what to shoot next ---

static int next_in_group(const struct run *r, int group, bool *busy)
{
    int first = -1, after = -1;
    *busy = false;
    for (int k = 0; k < r->n_items; k++) {
        const struct item *t = &r->item[k];
        if (t->step.group != group)
            continue;
        *busy |= t->state == KEEPING;
        if (t->state != TODO)
            continue;
        if (first < 0)
            first = k;
        if (after < 0 && k >= r->cursor)
            after = k;
    }
    return after >= 0 ? after : first;
}

// The next open step, -1 when there is none; *busy: verdicts that may reopen steps are due first.
static int next_item(const struct run *r, bool *busy)
{
    *busy = false;
    if (r->cursor < r->n_items) {
        const int k = next_in_group(r, r->item[r->cursor].step.group, busy);
        if (k >= 0 || *busy)
            return k;
    }
    for (int k = 0; k < r->n_items; k++)
        if (r->item[k].state == TODO)
            return k;
    return -1;
}

static const struct plan_group *unplanned(const struct run *r)
{
    for (int g = 0; g < r->n_groups; g++) {
        bool has = false;
        for (int k = 0; k < r->n_items && !has; k++)
            has = r->item[k].step.group == g;
        if (!has)
            return &r->group[g];
    }
    return NULL;
}

static void add_group(struct run *r, const struct plan_group *g, const int64_t *exposure_ns, int n,
                      struct run_output *out)
{
    struct session_step *step;
    const int first = r->n_items;
    const int count = plan_steps(r->plan, r->rig, g, exposure_ns, n, r->caps, first, &step);
    r->item = xrealloc(r->item, (size_t)(first + count) + 1, sizeof *r->item);
    for (int k = 0; k < count; k++)
        r->item[r->n_items++] = (struct item){.step = step[k]};
    free(step);
    struct run_action *last = out->n ? &out->action[out->n - 1] : NULL;
    if (!last || last->kind != RUN_DO_PLAN) {
        last = act(out, RUN_DO_PLAN);
        last->step = first;
    }
    last->n += count;
    last->last = !unplanned(r);
}

static int by_time(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

// Dark frames are of every exposure that was planned.
static void add_darks(struct run *r, const struct plan_group *g, struct run_output *out)
{
    int64_t *ns = xcalloc((size_t)r->n_items + 1, sizeof *ns);
    int n = 0;
    for (int k = 0; k < r->n_items; k++)
        ns[k] = r->item[k].step.exposure_ns;
    qsort(ns, (size_t)r->n_items, sizeof *ns, by_time);
    for (int k = 0; k < r->n_items; k++)
        if (!n || ns[k] != ns[n - 1])
            ns[n++] = ns[k];
    add_group(r, g, ns, n, out);
    free(ns);
}

static void start_metering(struct run *r, const struct plan_group *g)
{
    struct session_step *step;
    plan_steps(r->plan, r->rig, g, &r->plan->meter_ns, 1, r->caps, 0, &step);
    r->meter = step[0];
    r->meter.kind = SESSION_METER;
    r->meter_shots = 0;
    free(step);
}

// Plans every group whose exposures are known. True when the next one must be metered first.
static bool plan_groups_to_come(struct run *r, struct run_output *out)
{
    for (const struct plan_group *g; (g = unplanned(r));) {
        if (r->plan->n_exposures)
            add_group(r, g, r->plan->exposure_ns, r->plan->n_exposures, out);
        else if (g->kind == SESSION_DARK)
            add_darks(r, g, out);
        else {
            start_metering(r, g);
            return true;
        }
    }
    return false;
}

// --- one shot ---

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
        r->cursor = item;
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
    const int k = r->meter.exposure_ns ? -1 : next_item(r, &busy);
    if (k >= 0) {
        begin(r, k, now, out);
        return;
    }
    if (busy || r->keeping)
        return;
    if (r->meter.exposure_ns || plan_groups_to_come(r, out))
        begin(r, -1, now, out);
    else if ((busy = next_item(r, &busy) >= 0))
        begin(r, next_item(r, &busy), now, out);
    else
        end(r, out);
}

// --- events ---

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
        act(out, RUN_DO_METER);
        r->metering = true;
    } else {
        struct item *t = &r->item[r->current];
        t->state = KEEPING;
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
    int *attempts = r->current < 0 ? &r->meter_shots : &r->item[r->current].attempts;
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

static int item_of_frame(const struct run *r, int id)
{
    for (int k = 0; id && k < r->n_items; k++)
        if (r->item[k].state == GOOD && r->item[k].id == id)
            return k;
    return -1;
}

static void kept_good(struct run *r, struct item *t, const struct run_event *ev,
                      struct run_output *out)
{
    const int other = item_of_frame(r, ev->against);
    t->state = GOOD;
    t->id = ev->id;
    t->agreed = other >= 0;
    if (other >= 0)
        r->item[other].agreed++;
    // Wrong right after a change, then right with the same settings: they come into force late.
    if (t->was_wrong && !t->was_changed && ++r->late >= 2 && r->extra_settle < MAX_EXTRA_SETTLE) {
        r->extra_settle++;
        r->late = 0;
        note(out, "the camera applies settings late: %d more frames thrown away after a change",
             r->extra_settle);
    }
}

static void kept_bad(struct run *r, struct item *t, const struct run_event *ev,
                     struct run_output *out)
{
    const int other = item_of_frame(r, ev->against);
    const bool wrong =
        !strcmp(ev->verdict, "wrong-light") || !strcmp(ev->verdict, "wrong-exposure");
    t->state = TODO;
    t->was_wrong = wrong && t->was_changed;
    r->cursor = ev->step;
    r->careful = true;
    if (!strcmp(ev->verdict, "same-filter"))
        r->filter_at = -1; // send it again
    const bool again = ev->measured_ns && t->last_measured &&
                       fabs((double)ev->measured_ns / (double)t->last_measured - 1) < SAME_MEASURE;
    t->last_measured = wrong ? ev->measured_ns : 0;
    if (wrong && again && other >= 0 && !r->item[other].agreed &&
        r->item[other].revokes < MAX_REVOKES) {
        struct run_action *a = act(out, RUN_DO_REVOKE);
        a->id = ev->against;
        snprintf(a->text, sizeof a->text, "two shots of step %d agree with each other, not with it",
                 ev->step);
        r->item[other].state = TODO;
        r->item[other].attempts = 0;
        r->item[other].revokes++;
        t->attempts = 0;
        t->last_measured = 0;
    } else if (t->attempts > r->plan->retries) {
        give_up(r, &t->step, t->attempts, ev->verdict, ev->reason ? ev->reason : "", out);
    }
}

static void kept(struct run *r, const struct run_event *ev, struct run_output *out)
{
    struct item *t = &r->item[ev->step];
    r->keeping--;
    if (!strcmp(ev->verdict, "good"))
        kept_good(r, t, ev, out);
    else
        kept_bad(r, t, ev, out);
    if (r->state == WAITING)
        advance(r, ev->now_ns, out);
}

// Automatic bracket: the brightest pixels decide the shortest exposure, which lies on a grid of
// steps from the first guess, so that brackets share their dark frames.
static void metered(struct run *r, const struct run_event *ev, struct run_output *out)
{
    const int64_t ns = r->meter.exposure_ns;
    const struct plan_group *g = unplanned(r);
    r->metering = false;
    if (r->failed || !g) {
        advance(r, ev->now_ns, out);
        return;
    }
    const bool too_bright = ev->saturated > 1e-4 || ev->bright > 0.95;
    const bool too_dark = !too_bright && ev->bright < 0.05;
    int64_t better = ns;
    if (too_bright)
        better = plan_round(r->caps, ns / 8);
    else if (too_dark)
        better = plan_round(r->caps, ns * 8);
    const int light_index = rig_light_index(r->rig, r->meter.light);
    const struct rig_light *l = light_index < 0 ? NULL : &r->rig->light[light_index];
    const bool too_long = l && plan_on_ns(r->caps, l, better) > llround(l->max_on_s * 1e9);
    if (better != ns && !too_long && ++r->meter_shots < MAX_METER_SHOTS) {
        r->meter.exposure_ns = better;
        advance(r, ev->now_ns, out);
        return;
    }
    const double first_ns = (double)ns * (too_bright ? 0.5 : METER_TARGET / fmax(ev->bright, 0.01));
    const double stops = log2(first_ns / (double)r->plan->meter_ns) / r->plan->step_stops;
    const double on_grid =
        (double)r->plan->meter_ns * exp2(floor(stops + 1e-6) * r->plan->step_stops);
    int64_t exposure_ns[PLAN_MAX_EXPOSURES];
    const int n = plan_bracket(r->plan, r->caps, l, llround(fmax(on_grid, 1000)), exposure_ns);
    r->meter.exposure_ns = 0;
    if (n) {
        add_group(r, g, exposure_ns, n, out);
    } else {
        struct err e;
        err_set(&e, ERR_DATA, "metering through '%s' found no exposure that camera and light allow",
                r->meter.filter);
        fail(r, &e, out);
    }
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
