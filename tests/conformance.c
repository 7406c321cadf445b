// conformance.c - one function of promises per kind of device.
#include "tests/test.h"

#include "acquire/clock.h"
#include "tests/conformance.h"
#include <poll.h>
#include <pthread.h>

static const int64_t MS = 1000000;

// PROMISE(condition, "what was promised, and %d", uri, args of the text).
#define PROMISE(what, text, ...)                                                                   \
    do {                                                                                           \
        if (!(what))                                                                               \
            fail_msg("%s: " text, __VA_ARGS__);                                                    \
    } while (0)

struct seen {
    const char *uri;
    const struct cam *cam;
    pthread_t thread;
    bool pumping;
    int n;
    struct cam_frame last;
    uint32_t sum; // reads every sample, for the sanitizers
};

static void on_frame(void *ctx, const struct cam_frame *f)
{
    struct seen *s = ctx;
    const char *uri = s->uri;
    PROMISE(s->pumping && pthread_equal(s->thread, pthread_self()),
            "frames come inside pump(), on its thread", uri);
    PROMISE(f->w == s->cam->caps.w && f->h == s->cam->caps.h, "frame is %d x %d", uri, f->w, f->h);
    PROMISE(!s->n || f->seq > s->last.seq, "seq %lu after %lu", uri, (unsigned long)f->seq,
            (unsigned long)s->last.seq);
    PROMISE(!s->n || !f->device_ns || f->device_ns > s->last.device_ns,
            "device time runs backwards", uri);
    const int limit = 1 << s->cam->caps.bits;
    for (int k = 0; k < f->w * f->h; k++) {
        PROMISE(f->raw[k] < limit, "count %d of %d bits", uri, f->raw[k], s->cam->caps.bits);
        s->sum += f->raw[k];
    }
    s->last = *f;
    s->last.raw = NULL;
    s->n++;
}

static bool pump(struct cam *cam, struct seen *s, struct err *e)
{
    const int64_t from = clock_boot_ns();
    const char *uri = s->uri;
    s->pumping = true;
    const bool ok = cam_pump(cam, e);
    s->pumping = false;
    PROMISE(clock_boot_ns() - from < 2000 * MS, "pump() must not block", uri);
    return ok;
}

// Pumps until the frame of `id` is there, or time is up.
static bool await(struct cam *cam, struct seen *s, uint64_t id, int64_t exposure_ns)
{
    const char *uri = s->uri;
    const int before = s->n;
    const int64_t until = clock_boot_ns() + exposure_ns + cam->caps.dead_ns + 2000 * MS;
    while (clock_boot_ns() < until) {
        struct pollfd p = {cam->fd, POLLIN, 0};
        struct err e = {0};
        if (poll(&p, 1, 100) == 1)
            PROMISE(pump(cam, s, &e), "pump: %s", uri, e.msg);
        if (s->n > before && (s->last.shot == id || !s->last.shot))
            return true;
    }
    return false;
}

static void shoot(struct cam *cam, struct seen *s, int64_t exposure_ns, double gain)
{
    static uint64_t id;
    const char *uri = s->uri;
    const struct cam_caps *c = &cam->caps;
    struct err e = {0};
    const struct cam_shot shot = {++id, exposure_ns, gain, NAN};
    const int64_t from = clock_boot_ns();
    const bool taken = cam_shoot(cam, &shot, &e);
    PROMISE(clock_boot_ns() - from < 1000 * MS, "shoot() returns at once", uri);
    if (!taken) { // allowed for what the device cannot hold
        PROMISE(e.code == ERR_DATA || e.code == ERR_DEVICE, "code %d", uri, (int)e.code);
        PROMISE(exposure_ns < c->exposure_min_ns || exposure_ns > c->exposure_max_ns,
                "refused an exposure in its range: %s", uri, e.msg);
        return;
    }
    PROMISE(await(cam, s, id, exposure_ns), "no frame of an exposure of %g s", uri,
            1e-9 * (double)exposure_ns);
    const int64_t got = s->last.exposure_ns;
    if (!got)
        return;
    PROMISE(got >= c->exposure_min_ns && got <= c->exposure_max_ns, "exposure %g s", uri,
            1e-9 * (double)got);
    if (exposure_ns >= c->exposure_min_ns && exposure_ns <= c->exposure_max_ns)
        PROMISE(llabs(got - exposure_ns) <= c->exposure_step_ns || c->settle > 0,
                "asked for %g s, got %g s", uri, 1e-9 * (double)exposure_ns, 1e-9 * (double)got);
}

static void check_caps(const struct cam *cam, const char *uri)
{
    const struct cam_caps *c = &cam->caps;
    PROMISE(cam->fd >= 0, "a descriptor to wait on", uri);
    PROMISE(c->w > 0 && c->h > 0, "size %d x %d", uri, c->w, c->h);
    PROMISE(c->bits >= 8 && c->bits <= 16, "%d bits", uri, c->bits);
    PROMISE(c->black >= 0 && c->black < (1 << c->bits), "black %g", uri, c->black);
    PROMISE(c->exposure_min_ns > 0 && c->exposure_min_ns <= c->exposure_max_ns, "exposures", uri);
    PROMISE(c->gain_min > 0 && c->gain_min <= c->gain_max, "gains", uri);
    PROMISE(c->dead_ns >= 0 && c->row_ns >= 0 && c->exposure_step_ns >= 0, "times", uri);
    PROMISE(c->model[0], "a model", uri);
}

static struct cam *open_cam(const struct cam_driver *const drivers[], struct seen *s)
{
    const char *uri = s->uri;
    struct err e = {0};
    struct cam *cam = cam_open(drivers, uri, on_frame, s, &e);
    PROMISE(cam, "%s", uri, e.msg);
    s->cam = cam;
    check_caps(cam, uri);
    return cam;
}

void conform_cam(const struct cam_driver *const drivers[], const char *uri)
{
    struct seen s = {.uri = uri, .thread = pthread_self()};
    struct err e = {0};
    struct cam *cam = open_cam(drivers, &s);
    const struct cam_caps c = cam->caps;
    const int64_t base = c.exposure_min_ns > MS ? c.exposure_min_ns : MS;
    const int64_t longer = base * 4 < c.exposure_max_ns ? base * 4 : c.exposure_max_ns;
    PROMISE(pump(cam, &s, &e), "pump() with nothing to do is no error: %s", uri, e.msg);
    for (int k = 0; k < 4; k++)
        shoot(cam, &s, k % 2 ? longer : base, c.gain_min);
    shoot(cam, &s, base, c.gain_max);
    if (c.exposure_min_ns > 1)
        shoot(cam, &s, 1, c.gain_min);
    if (c.exposure_max_ns < INT64_C(5000000000))
        shoot(cam, &s, 2 * c.exposure_max_ns, c.gain_min);
    const struct cam_shot open_end = {UINT64_C(1) << 40, base, c.gain_min, NAN};
    PROMISE(cam_shoot(cam, &open_end, &e), "%s", uri, e.msg);
    const int64_t from = clock_boot_ns();
    cam_close(cam); // with a frame under way
    PROMISE(clock_boot_ns() - from < base + c.dead_ns + 2000 * MS, "close() takes too long", uri);
    s = (struct seen){.uri = uri, .thread = pthread_self()};
    cam = open_cam(drivers, &s); // and it can be opened again
    shoot(cam, &s, base, c.gain_min);
    cam_close(cam);
}

static void move(struct trig *t, const char *uri, uint32_t state)
{
    struct err e = {0};
    const int64_t before = t->changed_ns, from = clock_boot_ns();
    PROMISE(trig_set(t, state, &e), "set(%u): %s", uri, state, e.msg);
    PROMISE(clock_boot_ns() - from < 1000 * MS, "set() returns at once", uri);
    if (t->fd >= 0) {
        struct pollfd p = {t->fd, POLLIN, 0};
        const int limit_ms = (int)(t->caps.settle_ns / MS) + 2000;
        PROMISE(poll(&p, 1, limit_ms) == 1, "a move must end", uri);
        PROMISE(trig_settled(t, &e), "the move failed: %s", uri, e.msg);
    }
    PROMISE(t->changed_ns >= before, "time of change runs backwards", uri);
}

void conform_trig(const struct trig_driver *const drivers[], const char *uri)
{
    struct err e = {0};
    for (int turn = 0; turn < 2; turn++) { // and once more after closing
        struct trig *t = trig_open(drivers, uri, &e);
        PROMISE(t, "%s", uri, e.msg);
        const struct trig_caps c = t->caps;
        PROMISE((c.lines > 0) != (c.positions > 0), "lines or positions", uri);
        PROMISE(c.lines <= 32 && c.settle_ns >= 0 && c.model[0], "caps", uri);
        if (c.lines) {
            for (int line = 0; line < c.lines; line++) {
                move(t, uri, 1u << line);
                move(t, uri, 0);
            }
            move(t, uri, (uint32_t)((UINT64_C(1) << c.lines) - 1));
            move(t, uri, 0);
            PROMISE(trig_pulse(t, 1, 100 * MS, &e), "pulse: %s", uri, e.msg);
            PROMISE(clock_boot_ns() < t->ends_ns, "pulse() returns before its end", uri);
            PROMISE(t->ends_ns - t->changed_ns == 100 * MS, "a pulse says when it ends", uri);
            usleep(130000);
        } else {
            for (int p = 0; p < c.positions; p++)
                move(t, uri, (uint32_t)p);
            move(t, uri, 0);
            PROMISE(!trig_pulse(t, 1, MS, &e) && e.code == ERR_DATA, "a selector has no pulse",
                    uri);
        }
        if (c.positions || c.lines < 32) {
            const uint32_t past = c.positions ? (uint32_t)c.positions : 1u << c.lines;
            PROMISE(!trig_set(t, past, &e) && e.code == ERR_DATA, "set(%u) is past its end", uri,
                    past);
        }
        trig_close(t);
    }
}
