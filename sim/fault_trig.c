// fault_trig.c - "fault:miss=3,in=sim:lines=1": lights or a wheel that do not do what they were
// told.
//
// Counted are the calls that should change something: lights going on, every move of a wheel.
#define _GNU_SOURCE
#include "sim/schedule.h"
#include "sim/sim.h"
#include <stddef.h>
#include <unistd.h>

enum fault { MISS, EARLY, STUCK, FAIL, FAULTS };

struct fault_trig {
    struct trig base;
    char *text[FAULTS], *in;
    int seed;
    int64_t early_ns;

    struct schedule when[FAULTS];
    struct trig *inner;
    long calls;
    uint32_t position; // where a wheel really is
};

#define AT(field) offsetof(struct fault_trig, field)
#define WHEN(option, kind, help_text)                                                              \
    {                                                                                              \
        option, DEVOPT_TEXT, AT(text[kind]), .def = "", .help = "calls: " help_text                \
    }
static const struct devopt options[] = {
    [MISS] = WHEN("miss", MISS, "the light stays off"),
    [EARLY] = WHEN("early", EARLY, "the light comes at once and is off again after `flash`"),
    [STUCK] = WHEN("stuck", STUCK, "the wheel does not move"),
    [FAIL] = WHEN("fail", FAIL, "the call fails"),
    {"seed", DEVOPT_INT, AT(seed), UNIT_NONE, 0, INT32_MAX, "1", "of chances"},
    {"flash", DEVOPT_NS, AT(early_ns), UNIT_S, 0, 10, "200us", "length of an early flash"},
    {"in", DEVOPT_REST, AT(in), .def = "sim:lines=1", .help = "URI of the trigger to spoil"},
    {0},
};

static bool fault_open(struct trig *t, struct err *e)
{
    struct fault_trig *f = (struct fault_trig *)t;
    for (int k = 0; k < FAULTS; k++)
        if (!schedule_parse(&f->when[k], f->text[k], e))
            return err_in(e, "%s", options[k].name);
    f->inner = trig_open(t->drivers, f->in, e);
    if (!f->inner)
        return false;
    t->caps = f->inner->caps;
    if (f->inner->fd >= 0 && (t->fd = dup(f->inner->fd)) < 0) // trig_close() closes both
        return err_errno(e, "dup");
    return true;
}

static bool hit(struct fault_trig *f, enum fault kind)
{
    return schedule_hits(&f->when[kind], (uint64_t)f->seed, 16 + kind, f->calls);
}

// What the other trigger says holds for this one; of what did not happen it says that it did.
static bool pass_on(struct fault_trig *f, bool ok)
{
    f->base.changed_ns = f->inner->changed_ns;
    f->base.ends_ns = f->inner->ends_ns;
    f->base.moved = f->inner->moved;
    return ok;
}

static bool pretend(struct fault_trig *f, uint32_t state, struct err *e)
{
    return pass_on(f, trig_set(f->inner, state, e));
}

static bool fault_set(struct trig *t, uint32_t state, struct err *e)
{
    struct fault_trig *f = (struct fault_trig *)t;
    const bool counts = state || f->base.caps.positions;
    f->calls += counts;
    if (counts && hit(f, FAIL))
        return err_set(e, ERR_DEVICE, "does not answer");
    if (counts && f->base.caps.lines && hit(f, MISS))
        return pretend(f, 0, e);
    if (counts && f->base.caps.lines && hit(f, EARLY)) // a flash that is over too soon
        return pass_on(f, trig_pulse(f->inner, state, f->early_ns, e));
    if (f->base.caps.positions && hit(f, STUCK))
        return pretend(f, f->position, e);
    f->position = state;
    return pass_on(f, trig_set(f->inner, state, e));
}

static bool fault_pulse(struct trig *t, uint32_t mask, int64_t duration_ns, struct err *e)
{
    struct fault_trig *f = (struct fault_trig *)t;
    f->calls++;
    if (hit(f, FAIL))
        return err_set(e, ERR_DEVICE, "does not answer");
    if (hit(f, MISS)) {
        const bool ok = pretend(f, 0, e);
        t->ends_ns = t->changed_ns + duration_ns;
        return ok;
    }
    if (!hit(f, EARLY))
        return pass_on(f, trig_pulse(f->inner, mask, duration_ns, e));
    const bool ok = pass_on(f, trig_pulse(f->inner, mask, f->early_ns, e));
    t->ends_ns = t->changed_ns + duration_ns;
    return ok;
}

static void fault_close(struct trig *t)
{
    trig_close(((struct fault_trig *)t)->inner);
}

const struct trig_driver fault_trig = {
    .name = "fault",
    .summary = "spoils other lights or filters, by schedule",
    .size = sizeof(struct fault_trig),
    .options = options,
    .open = fault_open,
    .set = fault_set,
    .pulse = fault_pulse,
    .close = fault_close,
};
