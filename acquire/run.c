// run.c - the states of a capture and what leads from one to the next.
//
// One shot: filter, rest (the light's duty), frames to let new settings settle, light and its lead,
// exposure, lag, light off, keep.
#define _GNU_SOURCE
#include "acquire/run_state.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

static const int64_t MARGIN_NS = 2000000000; // patience beyond what devices promise
static const int64_t LATE_NS = 500000000;    // a frame that comes so much later is not trusted

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

static void end(struct run *r, struct run_output *out)
{
    int done, planned;
    run_progress(r, &done, &planned);
    if (r->failed && done) { // what is kept is worth something
        r->end.code = ERR_PARTIAL;
        err_in(&r->end, "%d of %d frames are kept", done, planned);
    }
    run_act(out, RUN_DO_END)->err = r->end;
    r->state = ENDED;
}

static void shoot(struct run *r, int64_t now, struct run_output *out)
{
    const struct session_step *t = run_target(r);
    const struct rig_light *l = r->settle_left ? NULL : run_target_light(r);
    r->shot = (struct cam_shot){r->shot.id + 1, t->exposure_ns, t->gain, t->focus_per_m};
    r->have_shot = true;
    r->shot_ns = now;
    run_act(out, RUN_DO_SHOOT)->shot = r->shot;
    r->deadline_ns =
        now + t->exposure_ns + r->caps->row_ns * r->caps->h + r->caps->dead_ns + MARGIN_NS;
    r->light_on_at_ns = l && l->lead_s < 0 ? now - llround(l->lead_s * 1e9) : 0;
    r->light_off_at_ns = l && l->lag_s < 0 ? now + t->exposure_ns + llround(l->lag_s * 1e9) : 0;
    r->state = r->settle_left ? SETTLING : EXPOSING;
}

static void light_and_shoot(struct run *r, int64_t now, struct run_output *out)
{
    const struct rig_light *l = run_target_light(r);
    if (l && now < r->rest_until_ns) {
        r->timer_ns = r->rest_until_ns;
        r->state = RESTING;
    } else if (l && l->lead_s >= 0) {
        run_light(r, UINT32_C(1) << l->line, out);
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
    const struct session_step *t = run_target(r);
    r->changed = !same_settings(r, t);
    r->settle_left = (r->changed ? r->caps->settle + r->extra_settle : 0) +
                     (item >= 0 ? r->steps.item[item].wait : 0);
    const int filter = rig_filter_index(r->rig, t->filter);
    if (filter >= 0 && r->filter_at != r->rig->filter[filter].position) {
        run_act(out, RUN_DO_FILTER)->state = (uint32_t)r->rig->filter[filter].position;
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
    if (k < 0 && !r->meter.exposure_ns && !run_plan_groups(r, out) &&
        (k = steps_next(&r->steps, &busy)) < 0)
        end(r, out);
    else
        begin(r, k, now, out);
}

static void filter_moved(struct run *r, int64_t now, struct run_output *out)
{
    if (r->state != MOVING)
        return;
    r->filter_at = r->rig->filter[rig_filter_index(r->rig, run_target(r)->filter)].position;
    settle_and_shoot(r, now, out);
}

static void keep(struct run *r, int64_t now, struct run_output *out)
{
    if (r->current < 0) {
        struct run_action *a = run_act(out, RUN_DO_METER);
        a->step = -1;
        a->n = r->meter.shots + 1;
        r->metering = true;
    } else {
        struct item *t = &r->steps.item[r->current];
        steps_set(&r->steps, r->current, STEP_KEEPING);
        t->attempts++;
        t->was_changed = r->changed && !t->wait;
        r->keeping++;
        struct run_action *a = run_act(out, RUN_DO_KEEP);
        a->step = r->current;
        a->n = t->attempts;
    }
    advance(r, now, out);
}

static void darken(struct run *r, struct run_output *out)
{
    run_light(r, 0, out);
    r->timer_ns = 0;
    r->state = DARKENING;
}

static void light_changed(struct run *r, const struct run_event *ev, struct run_output *out)
{
    const struct rig_light *l = run_target_light(r);
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

// The shot gave no frame that could be used.
static void no_frame(struct run *r, const char *what, int64_t now, struct run_output *out)
{
    const struct session_step *t = run_target(r);
    int *attempts = r->current < 0 ? &r->meter.shots : &r->steps.item[r->current].attempts;
    run_note(out, "%s for shot %llu of step %d", what, (unsigned long long)r->shot.id,
             r->current < 0 ? -1 : t->index);
    if (r->lit)
        run_light(r, 0, out);
    r->have_shot = false; // what the device has in force is not known any more
    if (++*attempts > r->plan->retries)
        run_give_up(r, t, *attempts, "no frame came", "", out);
    advance(r, now, out);
}

static void time_came(struct run *r, int64_t now, struct run_output *out)
{
    if (r->state == MOVING) {
        struct err e;
        err_set(&e, ERR_DEVICE, "filter '%s' did not arrive in time", run_target(r)->filter);
        run_fail(r, &e, out);
        advance(r, now, out);
    } else if (r->state == RESTING && now >= r->rest_until_ns) {
        light_and_shoot(r, now, out);
    } else if (r->state == LEADING && r->timer_ns && now >= r->timer_ns) {
        shoot(r, now, out);
    } else if (r->state == LAGGING && now >= r->timer_ns) {
        darken(r, out);
    } else if (r->state == EXPOSING || r->state == SETTLING) {
        if (now >= r->deadline_ns) {
            no_frame(r, "no frame", now, out);
            return;
        }
        const struct rig_light *l = run_target_light(r);
        if (r->light_on_at_ns && now >= r->light_on_at_ns) {
            run_light(r, UINT32_C(1) << l->line, out);
            r->light_on_at_ns = 0;
        } else if (r->light_off_at_ns && now >= r->light_off_at_ns) {
            run_light(r, 0, out);
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
        run_note(out, "frames lost: sequence %llu follows %llu", (unsigned long long)f->seq,
                 (unsigned long long)r->seq);
    if (!r->have_seq || f->seq > r->seq)
        r->seq = f->seq;
    r->have_seq = true;
    if (why)
        run_note(out, "frame %llu thrown away: %s", (unsigned long long)f->seq, why);
    return !why;
}

static void frame_came(struct run *r, const struct run_event *ev, struct run_output *out)
{
    if (!belongs(r, ev, out))
        return;
    if (ev->now_ns > r->deadline_ns - MARGIN_NS + LATE_NS) {
        no_frame(r, "too late a frame", ev->now_ns, out);
        return;
    }
    if (r->state == SETTLING) {
        r->settle_left--;
        settle_and_shoot(r, ev->now_ns, out);
        return;
    }
    const struct rig_light *l = run_target_light(r);
    run_act(out, RUN_DO_TAKE);
    if (!r->lit) {
        keep(r, ev->now_ns, out);
    } else if (l && l->lag_s > 0) {
        r->timer_ns = ev->now_ns + llround(l->lag_s * 1e9);
        r->state = LAGGING;
    } else {
        darken(r, out);
    }
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
    case RUN_KEPT:
        run_judged(r, ev, out);
        if (r->state == WAITING)
            advance(r, ev->now_ns, out);
        break;
    case RUN_METERED:
        run_metered(r, ev, out);
        advance(r, ev->now_ns, out);
        break;
    case RUN_FAILED:
        run_fail(r, ev->err, out);
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
        run_fail(r, &stopped, out);
        advance(r, ev->now_ns, out);
        break;
    }
    out->timer_ns = next_timer(r);
}
