// sim_trig.c - "sim:lines=2" switches simulated lights, "sim:positions=5" turns a filter wheel.
#define _GNU_SOURCE
#include "sim/schedule.h"
#include "sim/sim.h"
#include "sim/world.h"
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <sys/timerfd.h>

struct sim_lines {
    struct trig base;
    char *world_name;
    int lines, positions;
    int64_t settle_ns;
    double pwm_hz, pwm_duty, drift;
    char *flaws_text;

    struct schedule flaws; // which switchings on are chopped and drift
    long switchings;
    struct world *world;
};

// The light that goes on now. Drift is a slow wave over the switchings, 40 to a period.
static struct world_light light_now(struct sim_lines *s, uint32_t mask, int64_t from_ns,
                                    int64_t to_ns)
{
    struct world_light l = {mask, from_ns, to_ns, .level = 1};
    s->switchings += mask != 0;
    if (schedule_hits(&s->flaws, 1, 0, s->switchings)) {
        l.level = 1 + s->drift * sin(2 * M_PI * (double)s->switchings / 40);
        l.pwm_hz = s->pwm_hz;
        l.pwm_duty = s->pwm_duty;
    }
    return l;
}

static void set_lines(struct sim_lines *s, uint32_t mask, int64_t from_ns)
{
    const struct world_light l = light_now(s, mask, from_ns, INT64_MAX);
    world_set_lines(s->world, &l);
}

static bool sim_open(struct trig *t, struct err *e)
{
    struct sim_lines *s = (struct sim_lines *)t;
    if (!s->lines == !s->positions)
        return err_set(e, ERR_DATA, "give either lines= or positions=");
    if (!schedule_parse(&s->flaws, s->flaws_text, e) || !(s->world = world_open(s->world_name, e)))
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
        set_lines(s, 0, t->changed_ns);
    else
        world_set_filter(s->world, 0, t->changed_ns);
    return true;
}

static bool sim_set(struct trig *t, uint32_t state, struct err *e)
{
    struct sim_lines *s = (struct sim_lines *)t;
    t->changed_ns = world_now_ns(s->world) + s->settle_ns;
    if (s->lines) {
        set_lines(s, state, t->changed_ns);
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
    const struct world_light l = light_now(s, mask, t->changed_ns, t->ends_ns);
    world_pulse(s->world, &l);
    return true;
}

static void sim_close(struct trig *t)
{
    struct sim_lines *s = (struct sim_lines *)t;
    if (s->world && s->lines)
        set_lines(s, 0, world_now_ns(s->world));
    world_close(s->world);
}

#define AT(field) offsetof(struct sim_lines, field)
static const struct devopt options[] = {
    {"lines", DEVOPT_INT, AT(lines), UNIT_NONE, 0, 32, "0", "light lines"},
    {"positions", DEVOPT_INT, AT(positions), UNIT_NONE, 0, LAB_POSITIONS - 1, "0",
     "filters in the wheel"},
    {"world", DEVOPT_TEXT, AT(world_name), .def = "", .help = "what the camera calls its world"},
    {"settle", DEVOPT_NS, AT(settle_ns), UNIT_S, 0, 10, "0", "time until a change takes effect"},
    {"drift", DEVOPT_NUM, AT(drift), UNIT_NONE, 0, 0.9, "0", "of the brightness, relative"},
    {"pwm", DEVOPT_NUM, AT(pwm_hz), UNIT_HZ, 0, 1e6, "0", "chops the light; 0: steady"},
    {"duty", DEVOPT_NUM, AT(pwm_duty), UNIT_NONE, 0.01, 1, "0.5", "of the chopped light"},
    {"flaws", DEVOPT_TEXT, AT(flaws_text), .def = "100%",
     .help = "which switchings on drift and are chopped, e.g. 3+5 or 10%"},
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
