// run_groups.c - which exposures a group gets: the plan's, or those that metering finds.
#include "acquire/run_state.h"
#include <stdlib.h>

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
    struct run_action *a = run_act(out, RUN_DO_PLAN);
    a->step = first;
    a->n = r->steps.n - first;
    a->last = !steps_unplanned(&r->steps);
}

// Plans every group whose exposures are known. True when the next one must be metered first.
bool run_plan_groups(struct run *r, struct run_output *out)
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

void run_metered(struct run *r, const struct run_event *ev, struct run_output *out)
{
    const struct plan_group *g = steps_unplanned(&r->steps);
    int64_t exposure_ns[PLAN_MAX_EXPOSURES];
    int n;
    r->metering = false;
    if (!r->failed && g &&
        meter_look(&r->meter, r->plan, r->caps, run_target_light(r), ev->saturated, ev->bright,
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
            run_fail(r, &e, out);
        }
    }
    r->meter_step.exposure_ns = r->meter.exposure_ns;
}
