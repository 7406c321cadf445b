// fault_cam.c - "fault:drop=2,in=sim:w=8,h=4": a camera that wraps another one and spoils it.
//
// What goes wrong is decided per shot, by schedule (schedule.h) and seed, when the shot is asked
// for; the frame that belongs to it is then dropped, delayed or changed on its way. Behind one
// epoll descriptor are the other camera and a timer for late frames.
#define _GNU_SOURCE
#include "core/mem.h"
#include "sim/schedule.h"
#include "sim/sim.h"
#include <math.h>
#include <signal.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/timerfd.h>
#include <unistd.h>

enum fault {
    DROP,
    DUPLICATE,
    TWICE,
    LATE,
    TORN,
    DAMAGED,
    EXPOSURE,
    ROUNDS,
    LAG,
    IGNORES,
    BUSY,
    UNPLUG,
    STALL,
    DISK_FULL,
    FAULTS
};

enum { PENDING = 16 };

struct pending {
    uint64_t id;
    int64_t asked_ns;
    bool hit[FAULTS];
};

struct late {
    int64_t due_ns; // CLOCK_MONOTONIC
    struct cam_frame frame;
    uint16_t *raw;
};

struct fault_cam {
    struct cam base;
    char *text[FAULTS], *in, *state;
    int seed;
    double factor;
    int64_t delay_ns;

    struct schedule when[FAULTS];
    struct cam *inner;
    int timer;
    long shots; // asked for so far
    struct cam_shot last_shot;
    uint16_t *last; // [h][w] counts of the frame before
    bool has_last, gone, stalled, limited;
    struct rlimit limit; // before disk-full
    int n_pending, n_late;
    struct pending pending[PENDING];
    struct late late[PENDING];
};

#define AT(field) offsetof(struct fault_cam, field)
#define WHEN(option, kind, help_text)                                                              \
    {                                                                                              \
        option, DEVOPT_TEXT, AT(text[kind]), .def = "", .help = "shots: " help_text                \
    }
static const struct devopt options[] = {
    [DROP] = WHEN("drop", DROP, "the frame is lost"),
    [DUPLICATE] = WHEN("duplicate", DUPLICATE, "the counts of the frame before come again"),
    [TWICE] = WHEN("twice", TWICE, "the frame is delivered two times"),
    [LATE] = WHEN("late", LATE, "the frame comes after `delay`"),
    [TORN] = WHEN("torn", TORN, "the lower half is of the frame before"),
    [DAMAGED] = WHEN("damaged", DAMAGED, "the lower half is missing, and the camera says so"),
    [EXPOSURE] = WHEN("exposure", EXPOSURE, "exposes `factor` times as long and does not say so"),
    [ROUNDS] = WHEN("rounds", ROUNDS, "exposes `factor` times as long and says so"),
    [LAG] = WHEN("lag", LAG, "takes the settings of the shot before and says so"),
    [IGNORES] = WHEN("ignores", IGNORES, "takes the settings of the shot before, says otherwise"),
    [BUSY] = WHEN("busy", BUSY, "shoot() fails"),
    [UNPLUG] = WHEN("unplug", UNPLUG, "the camera is gone"),
    [STALL] = WHEN("stall", STALL, "no frame comes any more"),
    [DISK_FULL] = WHEN("disk-full", DISK_FULL, "from now on no file can grow"),
    {"seed", DEVOPT_INT, AT(seed), UNIT_NONE, 0, INT32_MAX, "1", "of chances"},
    {"factor", DEVOPT_NUM, AT(factor), UNIT_NONE, 0.01, 100, "2", "of wrong exposures"},
    {"delay", DEVOPT_NS, AT(delay_ns), UNIT_S, 0, 3600, "50ms", "of late frames"},
    {"state", DEVOPT_TEXT, AT(state), .def = "", .help = "file that counts shots over reopening"},
    {"in", DEVOPT_REST, AT(in), .def = "sim:", .help = "URI of the camera to spoil"},
    {0},
};

static int64_t monotonic_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

// The number of shots lives in a file when it must outlast the camera (unplug and return).
static void load_count(struct fault_cam *f)
{
    FILE *file = *f->state ? fopen(f->state, "r") : NULL;
    if (file && fscanf(file, "%ld", &f->shots) != 1)
        f->shots = 0;
    if (file)
        fclose(file);
}

static void save_count(const struct fault_cam *f)
{
    FILE *file = *f->state && !f->limited ? fopen(f->state, "w") : NULL;
    if (file) {
        fprintf(file, "%ld\n", f->shots);
        fclose(file);
    }
}

static struct pending take_pending(struct fault_cam *f, const struct cam_frame *frame)
{
    struct pending none = {.id = 0};
    int k = 0;
    while (k < f->n_pending && frame->shot && f->pending[k].id != frame->shot)
        k++;
    if (k == f->n_pending)
        return none;
    const struct pending found = f->pending[k];
    memmove(&f->pending[k], &f->pending[k + 1],
            (size_t)(f->n_pending - k - 1) * sizeof *f->pending);
    f->n_pending--;
    return found;
}

static void arm_timer(struct fault_cam *f)
{
    int64_t first = INT64_MAX;
    for (int k = 0; k < f->n_late; k++)
        first = f->late[k].due_ns < first ? f->late[k].due_ns : first;
    struct itimerspec when = {0};
    if (f->n_late)
        when.it_value = (struct timespec){first / 1000000000, first % 1000000000};
    timerfd_settime(f->timer, TFD_TIMER_ABSTIME, &when, NULL);
}

static void put_off(struct fault_cam *f, const struct cam_frame *frame, const uint16_t *raw)
{
    const size_t size = (size_t)frame->w * (size_t)frame->h * sizeof *raw;
    struct late l = {monotonic_ns() + f->delay_ns, *frame, NULL};
    struct err ignored;
    if (f->n_late == PENDING || !(l.raw = sample_alloc(1, size, "late frame", &ignored)))
        return; // then it is dropped
    memcpy(l.raw, raw, size);
    f->late[f->n_late++] = l;
    arm_timer(f);
}

// The other camera's frame passes here.
static void on_inner(void *ctx, const struct cam_frame *from)
{
    struct fault_cam *f = ctx;
    const struct pending p = take_pending(f, from);
    const size_t n = (size_t)from->w * (size_t)from->h, half = n / 2;
    struct cam_frame frame = *from;
    uint16_t *raw = malloc(n * sizeof *raw);
    if (!raw)
        return;
    memcpy(raw, from->raw, n * sizeof *raw);
    if (p.hit[DUPLICATE] && f->has_last)
        memcpy(raw, f->last, n * sizeof *raw);
    if (p.hit[TORN] && f->has_last)
        memcpy(raw + half, f->last + half, (n - half) * sizeof *raw);
    if (p.hit[DAMAGED]) {
        memset(raw + half, 0, (n - half) * sizeof *raw);
        frame.damaged = true;
    }
    if ((p.hit[EXPOSURE] || p.hit[IGNORES]) && frame.exposure_ns)
        frame.exposure_ns = p.asked_ns;
    memcpy(f->last, from->raw, n * sizeof *raw);
    f->has_last = true;
    frame.raw = raw;
    if (p.hit[LATE])
        put_off(f, &frame, raw);
    else if (!p.hit[DROP] && !f->stalled && !f->gone)
        cam_deliver(&f->base, &frame);
    if (p.hit[TWICE] && !p.hit[LATE] && !p.hit[DROP])
        cam_deliver(&f->base, &frame);
    free(raw);
}

static bool watch(int poller, int fd, struct err *e)
{
    struct epoll_event ev = {.events = EPOLLIN, .data = {.fd = fd}};
    return !epoll_ctl(poller, EPOLL_CTL_ADD, fd, &ev) || err_errno(e, "epoll");
}

static bool fault_open(struct cam *cam, struct err *e)
{
    struct fault_cam *f = (struct fault_cam *)cam;
    f->timer = -1;
    for (int k = 0; k < FAULTS; k++)
        if (!schedule_parse(&f->when[k], f->text[k], e))
            return err_in(e, "%s", options[k].name);
    load_count(f);
    f->inner = cam_open(cam->drivers, f->in, on_inner, f, e);
    if (!f->inner)
        return false;
    cam->caps = f->inner->caps;
    f->timer = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
    cam->fd = epoll_create1(EPOLL_CLOEXEC);
    f->last = sample_alloc((size_t)cam->caps.w * (size_t)cam->caps.h, sizeof *f->last, "frame", e);
    return f->last && ((f->timer >= 0 && cam->fd >= 0) || err_errno(e, "epoll")) &&
           watch(cam->fd, f->inner->fd, e) && watch(cam->fd, f->timer, e);
}

// No file of this process can grow any more, which is what a full disk does to it.
static void fill_disk(struct fault_cam *f)
{
    if (f->limited || getrlimit(RLIMIT_FSIZE, &f->limit))
        return;
    signal(SIGXFSZ, SIG_IGN);
    const struct rlimit none = {0, f->limit.rlim_max};
    f->limited = !setrlimit(RLIMIT_FSIZE, &none);
}

static bool fault_shoot(struct cam *cam, const struct cam_shot *asked, struct err *e)
{
    struct fault_cam *f = (struct fault_cam *)cam;
    struct pending p = {.id = asked->id, .asked_ns = asked->exposure_ns};
    struct cam_shot shot = *asked;
    if (f->gone)
        return err_set(e, ERR_DEVICE, "unplugged");
    f->shots++;
    save_count(f);
    for (uint32_t k = 0; k < FAULTS; k++)
        p.hit[k] = schedule_hits(&f->when[k], (uint64_t)f->seed, k, f->shots);
    if (p.hit[BUSY])
        return err_set(e, ERR_DEVICE, "busy");
    if (p.hit[UNPLUG]) {
        f->gone = true;
        const struct itimerspec soon = {.it_value = {0, 1}};
        timerfd_settime(f->timer, 0, &soon, NULL); // pump() has the news
        return true;
    }
    f->stalled |= p.hit[STALL];
    if (p.hit[DISK_FULL])
        fill_disk(f);
    if ((p.hit[LAG] || p.hit[IGNORES]) && f->last_shot.id)
        shot.exposure_ns = f->last_shot.exposure_ns, shot.gain = f->last_shot.gain;
    if (p.hit[EXPOSURE] || p.hit[ROUNDS])
        shot.exposure_ns = llround((double)shot.exposure_ns * f->factor);
    f->last_shot = *asked;
    if (f->n_pending == PENDING) // frames that never came
        memmove(f->pending, f->pending + 1, (size_t)--f->n_pending * sizeof *f->pending);
    f->pending[f->n_pending++] = p;
    return cam_shoot(f->inner, &shot, e);
}

static void deliver_late(struct fault_cam *f)
{
    uint64_t ignored;
    if (read(f->timer, &ignored, sizeof ignored) < 0)
        return;
    const int64_t now = monotonic_ns();
    for (int k = 0; k < f->n_late;) {
        if (f->late[k].due_ns > now) {
            k++;
            continue;
        }
        struct late l = f->late[k];
        f->late[k] = f->late[--f->n_late];
        l.frame.raw = l.raw;
        cam_deliver(&f->base, &l.frame);
        free(l.raw);
    }
    arm_timer(f);
}

static bool fault_pump(struct cam *cam, struct err *e)
{
    struct fault_cam *f = (struct fault_cam *)cam;
    if (f->gone)
        return err_set(e, ERR_DEVICE, "unplugged");
    deliver_late(f);
    return cam_pump(f->inner, e);
}

static void fault_close(struct cam *cam)
{
    struct fault_cam *f = (struct fault_cam *)cam;
    cam_close(f->inner);
    if (f->timer >= 0)
        close(f->timer);
    for (int k = 0; k < f->n_late; k++)
        free(f->late[k].raw);
    if (f->limited)
        setrlimit(RLIMIT_FSIZE, &f->limit);
    free(f->last);
}

const struct cam_driver fault_cam = {
    .name = "fault",
    .summary = "spoils another camera, by schedule",
    .size = sizeof(struct fault_cam),
    .options = options,
    .open = fault_open,
    .shoot = fault_shoot,
    .pump = fault_pump,
    .close = fault_close,
};
