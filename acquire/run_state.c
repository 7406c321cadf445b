// run_state.c - what every part of a run does: ask for actions, light off, end.
#define _GNU_SOURCE
#include "acquire/run_state.h"
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

struct run_action *run_act(struct run_output *out, enum run_action_kind kind)
{
    if (out->n == RUN_ACTIONS)
        abort(); // a bug: no event leads to this many
    out->action[out->n] = (struct run_action){.kind = kind};
    return &out->action[out->n++];
}

void run_note(struct run_output *out, const char *fmt, ...)
{
    struct run_action *a = run_act(out, RUN_DO_NOTE);
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(a->text, sizeof a->text, fmt, ap);
    va_end(ap);
}

void run_light(struct run *r, uint32_t mask, struct run_output *out)
{
    run_act(out, RUN_DO_LIGHT)->state = mask;
    r->lit = mask;
}

const struct session_step *run_target(const struct run *r)
{
    return r->current < 0 ? &r->meter_step : &r->steps.item[r->current].step;
}

const struct rig_light *run_target_light(const struct run *r)
{
    const int k = rig_light_index(r->rig, run_target(r)->light);
    return k < 0 ? NULL : &r->rig->light[k];
}

void run_fail(struct run *r, const struct err *why, struct run_output *out)
{
    if (r->failed)
        return;
    r->failed = true;
    r->end = *why;
    if (r->lit)
        run_light(r, 0, out);
    r->state = WAITING;
}

void run_give_up(struct run *r, const struct session_step *t, int times, const char *what,
                 const char *reason, struct run_output *out)
{
    struct err e;
    char seconds[40];
    err_set(&e, ERR_PARTIAL, "step %d (%s%s%s, %s): %s %d times%s%s", t->index,
            *t->light ? t->light : "dark", *t->filter ? ", " : "", t->filter,
            quantity_text(1e-9 * (double)t->exposure_ns, UNIT_S, seconds, sizeof seconds), what,
            times, *reason ? ": " : "", reason);
    run_fail(r, &e, out);
}
