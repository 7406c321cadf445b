// toy_bench.h - a camera and lights of a few lines that misbehave on request, for tests of the run.
//
// The scene is a ramp; the camera counts 8 per microsecond at its bright end while the light is on.
#pragma once
#include "acquire/clock.h"
#include "acquire/devices.h"
#include <sys/timerfd.h>

struct toy {
    struct cam base;
    int late, lie, ignore, seq_gap, lose, damage, dark, gone, stale;
    int64_t round_ns;
    int64_t set_ns, before_ns; // exposures: last set, and the one before
    int64_t start_ns;
    int shots;
    uint64_t seq;
    struct cam_shot shot;
    unsigned noise;
};

static int toy_light; // mask

static bool toy_open(struct cam *cam, struct err *e)
{
    struct toy *t = (struct toy *)cam;
    cam->fd = timerfd_create(CLOCK_BOOTTIME, TFD_NONBLOCK | TFD_CLOEXEC);
    cam->caps = (struct cam_caps){.model = "toy",
                                  .w = 64,
                                  .h = 48,
                                  .bits = 12,
                                  .black = 64,
                                  .clock = CAM_CLOCK_BOOT,
                                  .exposure_min_ns = 1000,
                                  .exposure_max_ns = 1000000000,
                                  .gain_min = 1,
                                  .gain_max = 1};
    t->set_ns = 77000;
    t->noise = 1;
    return cam->fd >= 0 || err_errno(e, "timer");
}

static bool toy_shoot(struct cam *cam, const struct cam_shot *shot, struct err *e)
{
    struct toy *t = (struct toy *)cam;
    t->shots++;
    if (t->gone && t->shots >= t->gone)
        return err_set(e, ERR_DEVICE, "is gone");
    t->before_ns = t->set_ns;
    t->shot = *shot;
    if (!t->ignore)
        t->set_ns = t->round_ns ? (shot->exposure_ns + t->round_ns - 1) / t->round_ns * t->round_ns
                                : shot->exposure_ns;
    t->start_ns = clock_boot_ns();
    const int64_t applied = t->late ? t->before_ns : t->set_ns;
    const int64_t ns = t->lie && shot->exposure_ns > applied ? shot->exposure_ns : applied;
    const struct itimerspec when = {.it_value = {ns / 1000000000, ns % 1000000000}};
    return !timerfd_settime(cam->fd, 0, &when, NULL) || err_errno(e, "timer");
}

static bool toy_pump(struct cam *cam, struct err *e)
{
    struct toy *t = (struct toy *)cam;
    uint64_t n;
    uint16_t raw[48 * 64];
    (void)e;
    if (read(cam->fd, &n, sizeof n) != sizeof n)
        return true;
    t->seq++;
    if (t->lose && t->shots == t->lose) {
        t->lose = 0; // the frame is lost; a later one shows the gap
        return true;
    }
    const int64_t applied = t->late ? t->before_ns : t->set_ns;
    const bool lit = toy_light && !(t->dark && t->shots == t->dark);
    for (int k = 0; k < 48 * 64; k++) {
        t->noise = t->noise * 1664525 + 1013904223;
        const double signal = lit ? 8e-3 * (double)applied * (k % 64 + 1) / 64 : 0;
        const double v = 64 + signal + (double)(t->noise >> 24) / 64 - 2;
        raw[k] = (uint16_t)(v > 4095 ? 4095 : v);
    }
    struct cam_frame f = {.seq = t->seq,
                          .shot = t->shot.id,
                          .device_ns = t->start_ns,
                          .exposure_ns = t->lie ? t->shot.exposure_ns : applied,
                          .gain = 1,
                          .focus_per_m = NAN,
                          .temperature_k = NAN,
                          .w = 64,
                          .h = 48,
                          .raw = raw};
    f.damaged = t->damage && t->shots == t->damage;
    if (t->stale && t->shots == t->stale) { // one from before comes first
        struct cam_frame old = f;
        old.shot = t->shot.id - 1;
        cam_deliver(cam, &old);
        f.seq = ++t->seq;
    }
    cam_deliver(cam, &f);
    return true;
}

static void toy_close(struct cam *cam)
{
    (void)cam;
}

#define AT(field) offsetof(struct toy, field)
static const struct devopt toy_options[] = {
    {"late", DEVOPT_INT, AT(late), UNIT_NONE, 0, 1, "0", "settings are in force a frame late"},
    {"lie", DEVOPT_INT, AT(lie), UNIT_NONE, 0, 1, "0", "reports what was asked"},
    {"ignore", DEVOPT_INT, AT(ignore), UNIT_NONE, 0, 1, "0", "never changes its exposure"},
    {"round", DEVOPT_NS, AT(round_ns), UNIT_S, 0, 1, "0", "exposures are multiples of this"},
    {"lose", DEVOPT_INT, AT(lose), UNIT_NONE, 0, 1000, "0", "this shot gives no frame"},
    {"damage", DEVOPT_INT, AT(damage), UNIT_NONE, 0, 1000, "0", "this shot is marked damaged"},
    {"dark", DEVOPT_INT, AT(dark), UNIT_NONE, 0, 1000, "0", "no light in this shot"},
    {"stale", DEVOPT_INT, AT(stale), UNIT_NONE, 0, 1000, "0", "an old frame before this one"},
    {"gone", DEVOPT_INT, AT(gone), UNIT_NONE, 0, 1000, "0", "unplugged at this shot"},
    {0},
};
#undef AT

static const struct cam_driver toy_cam = {.name = "toy",
                                          .summary = "",
                                          .size = sizeof(struct toy),
                                          .options = toy_options,
                                          .open = toy_open,
                                          .shoot = toy_shoot,
                                          .pump = toy_pump,
                                          .close = toy_close};

static bool toy_trig_open(struct trig *t, struct err *e)
{
    (void)e;
    t->caps = (struct trig_caps){.model = "toy lights", .lines = 1};
    toy_light = 0;
    return true;
}
static bool toy_trig_set(struct trig *t, uint32_t state, struct err *e)
{
    (void)e;
    toy_light = (int)state;
    t->changed_ns = clock_boot_ns();
    return true;
}
static void toy_trig_close(struct trig *t)
{
    (void)t;
    toy_light = 0;
}
static const struct trig_driver toy_trig = {.name = "toy",
                                            .summary = "",
                                            .size = sizeof(struct trig),
                                            .open = toy_trig_open,
                                            .set = toy_trig_set,
                                            .close = toy_trig_close};
static const struct cam_driver *const toy_cams[] = {&toy_cam, NULL};
static const struct trig_driver *const toy_trigs[] = {&toy_trig, NULL};
static const struct drivers toy_drivers = {toy_cams, toy_trigs};
