// run_verdict.c - what a verdict means for the run: a step is proven, shot again, or given up.
//
// When two attempts agree with each other but not with a frame that nothing has confirmed, that
// frame was the wrong one: it is revoked. They must not agree only because both were made with the
// settings of before, so more and more frames are thrown away between attempts.
#define _GNU_SOURCE
#include "acquire/run_state.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static const double SAME_MEASURE = 0.06;  // two attempts that say the same
static const double MUCH_MORE = 4;        // against a frame that hardly has any light
static const double TELLING_SIGMA = 0.02; // an agreement that is vaguer confirms nothing
enum { MAX_REVOKES = 3, MAX_EXTRA_SETTLE = 8, FIRST_WAIT = 4, MAX_WAIT = 8 };

static void kept_good(struct run *r, struct item *t, const struct run_event *ev,
                      struct run_output *out)
{
    const int other = steps_of_frame(&r->steps, ev->against);
    steps_set(&r->steps, ev->step, STEP_GOOD);
    t->id = ev->id;
    t->wait = 0;
    t->agreed = other >= 0 && ev->measured_sigma < TELLING_SIGMA;
    if (t->agreed)
        r->steps.item[other].agreed++;
    // Wrong right after a change, then right with the same settings: they come into force late.
    if (t->was_wrong && !t->was_changed && ++r->late >= 2 && r->extra_settle < MAX_EXTRA_SETTLE) {
        r->extra_settle = r->extra_settle ? 2 * r->extra_settle : 1;
        r->late = 0;
        run_note(out, "the camera applies settings late: %d more frames thrown away after a change",
                 r->extra_settle);
    }
}

static void revoke(struct run *r, int step, const struct run_event *ev, struct run_output *out)
{
    struct item *t = &r->steps.item[step];
    struct run_action *a = run_act(out, RUN_DO_REVOKE);
    a->id = ev->against;
    a->verdict = "wrong-light";
    snprintf(a->text, sizeof a->text, "shots of step %d agree with each other, not with it",
             ev->step);
    steps_set(&r->steps, step, STEP_OPEN);
    t->attempts = 0;
    t->wait = FIRST_WAIT;
    t->revokes++;
}

static void revoke_group(struct run *r, int group, const char *why, struct run_output *out)
{
    bool any = false;
    for (int k = 0; k < r->steps.n; k++) {
        const struct item *t = &r->steps.item[k];
        if (t->step.group != group || t->state != STEP_GOOD)
            continue;
        steps_set(&r->steps, k, STEP_OPEN);
        any = true;
    }
    if (!any)
        return;
    struct run_action *a = run_act(out, RUN_DO_REVOKE);
    a->n = group;
    a->verdict = "same-filter";
    snprintf(a->text, sizeof a->text, "%s", why);
}

// Two groups show the same picture. What of the second one counted is not what it seemed; when
// sending the filter again has not helped, nothing tells which of the two filters is in place.
static void same_filter(struct run *r, const struct item *t, int other, bool last,
                        struct run_output *out)
{
    r->filter_at = -1; // send it again
    revoke_group(r, t->step.group, "the filter was not in place", out);
    if (last && other >= 0)
        revoke_group(r, r->steps.item[other].step.group,
                     "the next group shows the same: one filter is not in place", out);
}

static void kept_bad(struct run *r, struct item *t, const struct run_event *ev,
                     struct run_output *out)
{
    const int other = steps_of_frame(&r->steps, ev->against);
    const bool wrong =
        !strcmp(ev->verdict, "wrong-light") || !strcmp(ev->verdict, "wrong-exposure");
    steps_set(&r->steps, ev->step, STEP_OPEN);
    // A frame that came before its light was off again was exposed for less than it says.
    const bool maybe_late = wrong || !strcmp(ev->verdict, "light-missed");
    t->was_wrong = maybe_late && t->was_changed;
    if (maybe_late)
        t->wait = t->wait ? MAX_WAIT : FIRST_WAIT;
    r->steps.cursor = ev->step;
    r->careful = true;
    if (!strcmp(ev->verdict, "same-filter"))
        same_filter(r, t, other, t->attempts > r->plan->retries, out);
    const double so_far = MUCH_MORE * (double)t->step.exposure_ns;
    const bool again =
        ev->measured_ns && t->last_measured &&
        (fabs((double)ev->measured_ns / (double)t->last_measured - 1) < SAME_MEASURE ||
         ((double)ev->measured_ns > so_far && (double)t->last_measured > so_far));
    const bool differs = wrong || !strcmp(ev->verdict, "uneven");
    t->last_measured = differs ? ev->measured_ns : 0;
    const bool unconfirmed = differs && other >= 0 && !r->steps.item[other].agreed;
    const bool used_up = t->attempts > r->plan->retries;
    // What was confirmed within the tolerance may still be at its edge: it gets one more chance
    // too.
    const bool doubted = unconfirmed || (differs && other >= 0 && used_up);
    const int revokes = unconfirmed ? MAX_REVOKES : 1;
    if (doubted && again && r->steps.item[other].revokes < revokes) {
        revoke(r, other, ev, out);
        t->attempts = 0;
        t->last_measured = 0;
    } else if (used_up) {
        if (unconfirmed)
            revoke(r, other, ev, out); // one of the two is wrong, and nothing tells which
        run_give_up(r, &t->step, t->attempts, ev->verdict, ev->reason ? ev->reason : "", out);
    }
}

void run_judged(struct run *r, const struct run_event *ev, struct run_output *out)
{
    struct item *t = &r->steps.item[ev->step];
    r->keeping--;
    if (!strcmp(ev->verdict, "good"))
        kept_good(r, t, ev, out);
    else
        kept_bad(r, t, ev, out);
}
