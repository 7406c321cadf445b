// shooter.c - between the run and the world.
//
// Actions of the run wait in a list until the callback that fed it has returned: a driver that
// delivers a frame is never asked for the next one from inside its own pump.
#define _GNU_SOURCE
#include "acquire/shooter.h"
#include "acquire/clock.h"
#include "acquire/lights.h"
#include "acquire/run.h"
#include "acquire/writer.h"
#include "core/mem.h"
#include "core/sha256.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>

enum { MAX_TODO = 64, SPARE_JOBS = 12 };
static const int64_t BEAT_NS = 100000000;

struct shooter {
    struct shooter_order order; // paths are not used after shooter_new
    struct loop *loop;
    struct rig rig;
    struct plan plan;
    struct devices dev;
    struct session *session;
    struct writer *writer;
    struct run *run;
    struct loop_source *on_cam, *on_filter, *on_lights, *on_writer, *timer, *beat;

    struct run_action todo[MAX_TODO];
    int n_todo;
    struct session_frame taken; // the frame of this shot, until the light is off
    uint16_t *taken_raw;
    bool taken_damaged;
    int64_t light_on_ns, light_off_ns;
    struct clock_map clock;
    int notes_left_out;
    bool ending;
    struct err how;
};

// --- opening ---

static double free_bytes(const char *session)
{
    char *folder = xstrdup(session), *slash = strrchr(folder, '/');
    struct statvfs v;
    if (slash && slash != folder)
        *slash = 0;
    const bool known = !statvfs(session, &v) || !statvfs(slash ? folder : ".", &v);
    free(folder);
    return known ? (double)v.f_bavail * (double)v.f_frsize : INFINITY;
}

static void no_frame(void *ctx, const struct cam_frame *frame)
{
    (void)ctx;
    (void)frame;
}

static bool open_files(struct shooter *s, struct err *e)
{
    return rig_open(&s->rig, s->order.rig, e) && plan_open(&s->plan, s->order.plan, e);
}

static bool check(const struct shooter *s, struct plan_report *report, struct err *e)
{
    const struct devices *d = &s->dev;
    return plan_check(&s->plan, &s->rig, &d->cam->caps, d->lights ? &d->lights->caps : NULL,
                      d->filters ? &d->filters->caps : NULL, free_bytes(s->order.session), report,
                      e);
}

bool shooter_check(const struct shooter_order *order, struct plan_report *report, struct err *e)
{
    struct shooter s = {.order = *order};
    const bool ok = open_files(&s, e) &&
                    devices_open(&s.dev, &s.rig, order->drivers, no_frame, NULL, e) &&
                    check(&s, report, e);
    devices_close(&s.dev);
    plan_finish(&s.plan);
    rig_finish(&s.rig);
    return ok;
}

static bool same_file(struct shooter *s, const char *name, const char *given, struct err *e)
{
    char hex[SHA256_TEXT], *key = xasprintf("sha256.%s", name);
    char *sum = session_get(s->session, key);
    const bool ok = sha256_file(given, hex, e) &&
                    ((sum && !strcmp(sum, hex)) ||
                     err_set(e, ERR_DATA, "%s: is not the %s that %s was begun with", given, name,
                             s->order.session));
    free(key);
    free(sum);
    return ok;
}

static bool open_session(struct shooter *s, struct err *e)
{
    if (!s->order.resume)
        return session_create(&s->session, s->order.session, &s->rig, s->order.plan, e);
    return session_open(&s->session, s->order.session, SESSION_WRITE, e) &&
           same_file(s, "rig.yaml", s->order.rig, e) &&
           same_file(s, "plan.yaml", s->order.plan, e) && session_recheck(s->session, e);
}

// The run, with the steps that are proven already.
static bool make_run(struct shooter *s, struct err *e)
{
    struct session_step *step = NULL;
    struct session_frame *frame = NULL;
    int n_steps = 0, n_frames = 0;
    if (!session_steps(s->session, &step, &n_steps, e) ||
        !session_frames(s->session, true, &frame, &n_frames, e)) {
        free(step);
        return false;
    }
    bool *done = xcalloc((size_t)n_steps + 1, sizeof *done);
    for (int k = 0; k < n_frames; k++)
        if (frame[k].step.index >= 0 && frame[k].step.index < n_steps)
            done[frame[k].step.index] = true;
    s->run = run_new(&s->plan, &s->rig, &s->dev.cam->caps,
                     s->dev.filters ? s->dev.filters->caps.settle_ns : 0, step, done, n_steps);
    free(done);
    free(step);
    free(frame);
    return true;
}

// --- events to the run, actions from it ---

static void take(struct shooter *s, const struct cam_frame *f, int64_t start_ns);

static void feed(struct shooter *s, struct run_event ev)
{
    struct run_output out;
    ev.now_ns = clock_boot_ns();
    run_feed(s->run, &ev, &out);
    for (int k = 0; k < out.n; k++) {
        if (out.action[k].kind == RUN_DO_TAKE)
            take(s, ev.frame, ev.start_ns); // its pixels are gone when this event is over
        else if (s->n_todo < MAX_TODO)
            s->todo[s->n_todo++] = out.action[k];
        else
            abort(); // a bug: the run waits for answers
    }
    loop_arm(s->timer, out.timer_ns);
}

static void failed(struct shooter *s, const struct err *why)
{
    feed(s, (struct run_event){.kind = RUN_FAILED, .err = why});
}

static void take(struct shooter *s, const struct cam_frame *f, int64_t start_ns)
{
    const struct cam_caps *c = &s->dev.cam->caps;
    const size_t n = (size_t)f->w * (size_t)f->h;
    struct err e;
    free(s->taken_raw);
    s->taken_raw = sample_alloc(n, sizeof *s->taken_raw, "frame", &e);
    if (!s->taken_raw) {
        failed(s, &e);
        return;
    }
    memcpy(s->taken_raw, f->raw, n * sizeof *f->raw);
    s->taken_damaged = f->damaged;
    s->taken = (struct session_frame){
        .seq = f->seq,
        .shot = f->shot,
        .device_ns = f->device_ns,
        .start_ns = start_ns,
        .arrived_ns = clock_boot_ns(),
        .utc_ns = f->utc_ns ? f->utc_ns : clock_utc_ns(),
        .reported_ns = f->exposure_ns,
        .gain = f->gain,
        .focus_per_m = f->focus_per_m,
        .temperature_k = f->temperature_k,
        .w = f->w,
        .h = f->h,
        .black = isnan(s->rig.camera.black) ? c->black : s->rig.camera.black,
        .white = (1 << c->bits) - 1,
    };
}

static void note(struct shooter *s, const char *what, const char *text)
{
    if (writer_waiting(s->writer) > WRITER_QUEUE - SPARE_JOBS) { // a flood of stale frames
        s->notes_left_out++;
        return;
    }
    struct writer_job job = {.kind = WRITER_NOTE, .boot_ns = clock_boot_ns()};
    snprintf(job.what, sizeof job.what, "%s", what);
    snprintf(job.text, sizeof job.text, "%.*s", (int)sizeof job.text - 1, text);
    writer_put(s->writer, &job);
}

static void do_light(struct shooter *s, uint32_t mask)
{
    struct err e;
    if (s->dev.lights && !trig_set(s->dev.lights, mask, &e)) {
        failed(s, &e);
        return;
    }
    const int64_t t = s->dev.lights ? s->dev.lights->changed_ns : clock_boot_ns();
    if (mask) {
        s->light_on_ns = t;
        s->light_off_ns = 0;
    } else {
        s->light_off_ns = t;
    }
    feed(s, (struct run_event){.kind = RUN_LIT, .t_ns = t});
}

static void do_filter(struct shooter *s, int position)
{
    struct err e;
    if (!devices_filter(&s->dev, position, &e))
        failed(s, &e);
    else if (s->dev.filters->fd < 0)
        feed(s, (struct run_event){.kind = RUN_MOVED});
}

static void do_keep(struct shooter *s, const struct run_action *a, enum writer_kind kind)
{
    struct writer_job job = {
        .kind = kind, .frame = s->taken, .damaged = s->taken_damaged, .raw = s->taken_raw};
    s->taken_raw = NULL;
    job.frame.step = *run_step(s->run, a->step);
    job.frame.attempt = a->n;
    if (isnan(job.frame.gain))
        job.frame.gain = job.frame.step.gain;
    if (*job.frame.step.light) {
        job.frame.light_on_ns = s->light_on_ns;
        job.frame.light_off_ns = s->light_off_ns;
    }
    writer_put(s->writer, &job);
}

static void do_plan(struct shooter *s, const struct run_action *a)
{
    struct writer_job job = {.kind = WRITER_PLAN, .n = a->n, .last = a->last};
    job.step = xcalloc((size_t)a->n + 1, sizeof *job.step);
    for (int k = 0; k < a->n; k++)
        job.step[k] = *run_step(s->run, a->step + k);
    writer_put(s->writer, &job);
}

static void do_end(struct shooter *s, const struct err *how)
{
    char text[160];
    s->ending = true;
    s->how = *how;
    if (s->dev.cam->caps.clock == CAM_CLOCK_DEVICE && clock_map_known(&s->clock)) {
        snprintf(text, sizeof text, "device clock: offset %.9f s, drift %.3f ppm",
                 1e-9 * (double)s->clock.offset_ns[1], 1e6 * clock_map_drift(&s->clock));
        note(s, "clock", text);
    }
    if (s->notes_left_out) {
        snprintf(text, sizeof text, "%d more", s->notes_left_out);
        note(s, "note", text);
    }
    note(s, "ended", how->code ? how->msg : "complete");
}

static void act(struct shooter *s, const struct run_action *a)
{
    struct err e;
    switch (a->kind) {
    case RUN_DO_FILTER: do_filter(s, (int)a->state); break;
    case RUN_DO_LIGHT: do_light(s, a->state); break;
    case RUN_DO_SHOOT:
        if (!cam_shoot(s->dev.cam, &a->shot, &e))
            failed(s, &e);
        break;
    case RUN_DO_TAKE: break; // done in feed()
    case RUN_DO_KEEP: do_keep(s, a, WRITER_KEEP); break;
    case RUN_DO_METER: do_keep(s, a, WRITER_METER); break;
    case RUN_DO_PLAN: do_plan(s, a); break;
    case RUN_DO_REVOKE: {
        struct writer_job job = {.kind = WRITER_REVOKE, .id = a->id, .n = a->n};
        snprintf(job.what, sizeof job.what, "%s", a->verdict);
        snprintf(job.text, sizeof job.text, "%s", a->text);
        writer_put(s->writer, &job);
        break;
    }
    case RUN_DO_NOTE: note(s, "run", a->text); break;
    case RUN_DO_END: do_end(s, &a->err); break;
    }
}

static void flush(struct shooter *s)
{
    while (s->n_todo) {
        const struct run_action a = s->todo[0];
        memmove(s->todo, s->todo + 1, (size_t)--s->n_todo * sizeof *s->todo);
        act(s, &a);
    }
}

// --- callbacks of the loop ---

static void frame_came(void *ctx, const struct cam_frame *f)
{
    struct shooter *s = ctx;
    const struct cam_caps *c = &s->dev.cam->caps;
    int64_t start_ns = f->device_ns;
    if (c->clock == CAM_CLOCK_MONO) {
        start_ns += clock_mono_to_boot_ns();
    } else if (c->clock == CAM_CLOCK_DEVICE) {
        const int64_t exposure_ns = f->exposure_ns + c->row_ns * (f->h - 1);
        clock_map_add(&s->clock, f->device_ns + exposure_ns, clock_boot_ns());
        start_ns = clock_map_known(&s->clock) ? clock_map_boot_ns(&s->clock, f->device_ns) : 0;
    }
    if (s->order.seen)
        s->order.seen(s->order.ctx, f, c);
    feed(s, (struct run_event){.kind = RUN_FRAME, .frame = f, .start_ns = start_ns});
}

static void cam_ready(void *ctx)
{
    struct shooter *s = ctx;
    struct err e;
    if (!cam_pump(s->dev.cam, &e)) {
        loop_drop(s->on_cam); // it would be readable for ever
        s->on_cam = NULL;
        failed(s, &e);
    }
    flush(s);
}

static void filter_ready(void *ctx)
{
    struct shooter *s = ctx;
    struct err e;
    if (trig_settled(s->dev.filters, &e))
        feed(s, (struct run_event){.kind = RUN_MOVED});
    else
        failed(s, &e);
    flush(s);
}

// nacre-lights said something unasked: a line went off by itself, or it was started again. The
// frame under way will show it, by the time the light went off.
static void lights_ready(void *ctx)
{
    struct shooter *s = ctx;
    char news[LIGHTS_MESSAGE];
    struct err e;
    const bool alive = lights_pump(s->dev.lights, news, sizeof news, &e);
    if (*news)
        note(s, "lights", news);
    if (!alive) {
        loop_drop(s->on_lights);
        s->on_lights = NULL;
        failed(s, &e);
    }
    flush(s);
}

static void beat(void *ctx)
{
    struct shooter *s = ctx;
    lights_beat(s->dev.lights);
    loop_arm(s->beat, clock_boot_ns() + BEAT_NS);
}

static void time_came(void *ctx)
{
    struct shooter *s = ctx;
    feed(s, (struct run_event){.kind = RUN_TIME});
    flush(s);
}

static void kept(struct shooter *s, const struct writer_result *res)
{
    const struct session_frame *f = &res->frame;
    const bool stored = res->err.code == ERR_NONE;
    if (!stored)
        failed(s, &res->err);
    feed(s, (struct run_event){.kind = RUN_KEPT,
                               .step = f->step.index,
                               .id = f->id,
                               .against = res->against,
                               .verdict = stored ? f->verdict : "not-stored",
                               .reason = f->reason,
                               .measured_ns = f->measured_ns,
                               .measured_sigma = f->measured_sigma});
    int done, planned;
    run_progress(s->run, &done, &planned);
    if (stored && s->order.kept)
        s->order.kept(s->order.ctx, f, done, planned);
}

static void writer_ready(void *ctx)
{
    struct shooter *s = ctx;
    struct writer_result res;
    while (writer_get(s->writer, &res)) {
        const double full = s->taken.white - s->taken.black;
        if (res.kind == WRITER_KEEP)
            kept(s, &res);
        else if (res.err.code)
            failed(s, &res.err);
        else if (res.kind == WRITER_METER)
            feed(s, (struct run_event){.kind = RUN_METERED,
                                       .saturated = res.level.saturated,
                                       .bright = res.level.bright / full});
        flush(s);
    }
    if (s->ending && !writer_waiting(s->writer)) {
        s->ending = false;
        const struct err how = s->how;
        loop_drop(s->on_cam);
        loop_drop(s->on_filter);
        loop_drop(s->on_lights);
        if (s->beat)
            loop_arm(s->beat, 0);
        s->on_cam = s->on_filter = s->on_lights = NULL;
        devices_close(&s->dev);
        if (s->order.end)
            s->order.end(s->order.ctx, &how); // may free s
    }
}

// --- life ---

struct shooter *shooter_new(struct loop *l, const struct shooter_order *order, struct err *e)
{
    struct plan_report report;
    struct shooter *s = xcalloc(1, sizeof *s);
    s->order = *order;
    s->loop = l;
    const bool ok = open_files(s, e) &&
                    devices_open(&s->dev, &s->rig, order->drivers, frame_came, s, e) &&
                    check(s, &report, e) && open_session(s, e) &&
                    (s->writer = writer_new(s->session, &s->dev.cam->caps, e)) && make_run(s, e);
    if (!ok) {
        shooter_free(s);
        return NULL;
    }
    if (s->dev.cam->fd >= 0)
        s->on_cam = loop_watch(l, s->dev.cam->fd, cam_ready, s);
    if (s->dev.filters && s->dev.filters->fd >= 0)
        s->on_filter = loop_watch(l, s->dev.filters->fd, filter_ready, s);
    s->on_writer = loop_watch(l, writer_fd(s->writer), writer_ready, s);
    s->timer = loop_timer(l, time_came, s);
    if (lights_is_kept(s->dev.lights)) {
        s->on_lights = loop_watch(l, s->dev.lights->fd, lights_ready, s);
        s->beat = loop_timer(l, beat, s);
        beat(s);
    }
    note(s, order->resume ? "resumed" : "started", s->dev.cam->caps.model);
    feed(s, (struct run_event){.kind = RUN_START});
    flush(s);
    return s;
}

void shooter_free(struct shooter *s)
{
    if (!s)
        return;
    loop_drop(s->on_cam);
    loop_drop(s->on_filter);
    loop_drop(s->on_lights);
    loop_drop(s->on_writer);
    loop_drop(s->timer);
    loop_drop(s->beat);
    devices_close(&s->dev);
    writer_free(s->writer);
    session_close(s->session);
    run_free(s->run);
    free(s->taken_raw);
    plan_finish(&s->plan);
    rig_finish(&s->rig);
    free(s);
}

void shooter_pause(struct shooter *s)
{
    feed(s, (struct run_event){.kind = RUN_PAUSE});
    flush(s);
}
void shooter_continue(struct shooter *s)
{
    feed(s, (struct run_event){.kind = RUN_CONTINUE});
    flush(s);
}
void shooter_abort(struct shooter *s)
{
    feed(s, (struct run_event){.kind = RUN_ABORT});
    flush(s);
}
const char *shooter_state(const struct shooter *s)
{
    return run_state_name(s->run);
}
void shooter_progress(const struct shooter *s, int *done, int *planned)
{
    run_progress(s->run, done, planned);
}
