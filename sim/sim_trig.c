// sim_trig.c - "sim:lines=2" switches simulated lights, "sim:positions=5" turns a filter wheel.
#define _GNU_SOURCE
#include "core/mem.h"
#include "sim/sim.h"
#include "sim/world.h"
#include <stddef.h>
#include <stdio.h>
#include <sys/timerfd.h>

struct sim_lines {
    struct trig base;
    char *world_name;
    int lines, positions;
    int64_t settle_ns;
    struct world *world;
};

static bool sim_open(struct trig *t, struct err *e)
{
    struct sim_lines *s = (struct sim_lines *)t;
    if (!s->lines == !s->positions)
        return err_set(e, ERR_DATA, "give either lines= or positions=");
    s->world = world_open(s->world_name, e);
    if (!s->world)
        return false;
    if (s->settle_ns && s->positions) {
        t->fd = timerfd_create(CLOCK_BOOTTIME, TFD_NONBLOCK | TFD_CLOEXEC);
        if (t->fd < 0)
            return err_errno(e, "timer");
    }
    snprintf(t->caps.model, sizeof t->caps.model, "simulated %s", s->lines ? "lights" : "wheel");
    t->caps.lines = s->lines;
    t->caps.positions = s->positions;
    t->caps.settle_ns = s->settle_ns;
    t->changed_ns = world_now_ns(s->world);
    if (s->lines)
        world_set_lines(s->world, 0, t->changed_ns);
    else
        world_set_filter(s->world, 0, t->changed_ns);
    return true;
}

static bool sim_set(struct trig *t, uint32_t state, struct err *e)
{
    struct sim_lines *s = (struct sim_lines *)t;
    t->changed_ns = world_now_ns(s->world) + s->settle_ns;
    if (s->lines) {
        world_set_lines(s->world, state, t->changed_ns);
        return true;
    }
    world_set_filter(s->world, (int)state, t->changed_ns);
    if (t->fd < 0)
        return true;
    const struct itimerspec when = {
        .it_value = {s->settle_ns / 1000000000, s->settle_ns % 1000000000}};
    return !timerfd_settime(t->fd, 0, &when, NULL) || err_errno(e, "timer");
}

static bool sim_pulse(struct trig *t, uint32_t mask, int64_t duration_ns, struct err *e)
{
    struct sim_lines *s = (struct sim_lines *)t;
    (void)e;
    t->changed_ns = world_now_ns(s->world) + s->settle_ns;
    t->ends_ns = t->changed_ns + duration_ns;
    world_pulse(s->world, mask, t->changed_ns, t->ends_ns);
    return true;
}

static void sim_close(struct trig *t)
{
    struct sim_lines *s = (struct sim_lines *)t;
    if (s->world && s->lines)
        world_set_lines(s->world, 0, world_now_ns(s->world));
    world_close(s->world);
}

#define AT(field) offsetof(struct sim_lines, field)
static const struct devopt options[] = {
    {"lines", DEVOPT_INT, AT(lines), UNIT_NONE, 0, 32, "0", "light lines"},
    {"positions", DEVOPT_INT, AT(positions), UNIT_NONE, 0, LAB_POSITIONS - 1, "0",
     "filters in the wheel"},
    {"world", DEVOPT_TEXT, AT(world_name), .def = "", .help = "what the camera calls its world"},
    {"settle", DEVOPT_NS, AT(settle_ns), UNIT_S, 0, 10, "0", "time until a change takes effect"},
    {0},
};

const struct trig_driver sim_trig = {
    .name = "sim",
    .summary = "simulated lights and filter wheel",
    .size = sizeof(struct sim_lines),
    .options = options,
    .open = sim_open,
    .set = sim_set,
    .pulse = sim_pulse,
    .close = sim_close,
};
