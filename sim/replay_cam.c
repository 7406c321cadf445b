// replay_cam.c - "replay:SESSION": a recorded session as a camera, count for count.
//
// A shot gets the first frame, in the order of the plan, that was asked for with the same exposure,
// gain and focus; so the plan that made the session makes it again. Metering comes first in its
// group, as it did then.
#define _GNU_SOURCE
#include "core/mem.h"
#include "core/session.h"
#include "sim/sim.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>

struct replay {
    struct cam base;
    char *folder;
    struct session *session;
    struct session_frame *frame; // [n] in the order of the plan, owned
    bool *served;                // [n], owned
    int n, next;                 // next: to be delivered by pump; -1: none
    struct cam_shot shot;
    uint64_t seq;
};

static int by_plan(const void *a, const void *b)
{
    const struct session_frame *f = a, *g = b;
    return f->step.group != g->step.group   ? f->step.group - g->step.group
           : f->step.index != g->step.index ? f->step.index - g->step.index
                                            : f->id - g->id;
}

// Of meterings [0, n) of one or more groups, only the last round of each: a capture that was killed
// in between has begun again with the first guess.
static int last_rounds(struct session_frame *m, int n)
{
    int kept = 0, start = 0; // of the group that is being kept
    for (int k = 0; k < n; k++) {
        if (!kept || m[k].step.group != m[start].step.group)
            start = kept;
        else if (m[k].step.exposure_ns == m[start].step.exposure_ns)
            kept = start;
        m[kept++] = m[k];
    }
    return kept;
}

static bool read_frames(struct replay *r, struct err *e)
{
    struct session_frame *metering = NULL;
    int n = 0;
    if (!session_open(&r->session, r->folder, SESSION_READ, e) ||
        !session_frames(r->session, true, &r->frame, &r->n, e) ||
        !session_meterings(r->session, &metering, &n, e))
        return false;
    if (!r->n) {
        free(metering);
        return err_set(e, ERR_DATA, "%s: has no good frame", r->folder);
    }
    if (n)
        qsort(metering, (size_t)n, sizeof *metering, by_plan);
    n = last_rounds(metering, n);
    r->frame = xrealloc(r->frame, (size_t)(r->n + n), sizeof *r->frame);
    for (int k = 0; k < n; k++)
        r->frame[r->n++] = metering[k];
    free(metering);
    qsort(r->frame, (size_t)r->n, sizeof *r->frame, by_plan);
    return true;
}

static int64_t common_divisor(int64_t a, int64_t b)
{
    while (b) {
        const int64_t rest = a % b;
        a = b;
        b = rest;
    }
    return a;
}

static bool replay_open(struct cam *cam, struct err *e)
{
    struct replay *r = (struct replay *)cam;
    r->next = -1;
    if (!r->folder || !*r->folder)
        return err_set(e, ERR_DATA, "give a session: replay:FOLDER");
    if (!read_frames(r, e))
        return false;
    r->served = xcalloc((size_t)r->n, sizeof *r->served);
    struct dng first;
    char *path = session_path(r->session, r->frame[0].path);
    const bool read = dng_read(&first, path, e);
    free(path);
    if (!read)
        return false;
    struct cam_caps *c = &cam->caps;
    *c = (struct cam_caps){.w = first.w,
                           .h = first.h,
                           .black = first.black,
                           .pattern = (enum cam_pattern)first.pattern,
                           .clock = CAM_CLOCK_BOOT,
                           .exposure_min_ns = INT64_MAX,
                           .gain_min = INFINITY,
                           .dead_ns = 1000000000};
    snprintf(c->model, sizeof c->model, "%s", first.camera);
    while ((1 << c->bits) - 1 < first.white)
        c->bits++;
    dng_finish(&first);
    for (int k = 0; k < r->n; k++) {
        const struct session_step *s = &r->frame[k].step;
        c->exposure_min_ns =
            s->exposure_ns < c->exposure_min_ns ? s->exposure_ns : c->exposure_min_ns;
        c->exposure_max_ns =
            s->exposure_ns > c->exposure_max_ns ? s->exposure_ns : c->exposure_max_ns;
        // What was rounded to the camera's step then is rounded to the same now.
        c->exposure_step_ns = common_divisor(c->exposure_step_ns, s->exposure_ns);
        c->gain_min = fmin(c->gain_min, s->gain);
        c->gain_max = fmax(c->gain_max, s->gain);
        if (!isnan(s->focus_per_m)) {
            c->focus_min_per_m = fmin(c->focus_min_per_m, s->focus_per_m);
            c->focus_max_per_m = fmax(c->focus_max_per_m, s->focus_per_m);
        }
    }
    c->exposure_min_ns -= c->exposure_step_ns / 2; // what is asked may be rounded either way
    c->exposure_max_ns += c->exposure_step_ns / 2;
    cam->fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    return cam->fd >= 0 || err_errno(e, "eventfd");
}

static bool fits(const struct session_step *s, const struct cam_shot *shot)
{
    return s->exposure_ns == shot->exposure_ns && fabs(s->gain - shot->gain) < 1e-9 &&
           (isnan(s->focus_per_m) || isnan(shot->focus_per_m) ||
            fabs(s->focus_per_m - shot->focus_per_m) < 1e-9);
}

static bool replay_shoot(struct cam *cam, const struct cam_shot *shot, struct err *e)
{
    struct replay *r = (struct replay *)cam;
    for (int k = 0; k < r->n; k++) {
        if (r->served[k] || !fits(&r->frame[k].step, shot))
            continue;
        r->served[k] = true;
        r->next = k;
        r->shot = *shot;
        return !eventfd_write(cam->fd, 1) || err_errno(e, "eventfd");
    }
    char text[40];
    return err_set(e, ERR_DEVICE, "%s: no frame of %s is left", r->folder,
                   quantity_text(1e-9 * (double)shot->exposure_ns, UNIT_S, text, sizeof text));
}

static bool replay_pump(struct cam *cam, struct err *e)
{
    struct replay *r = (struct replay *)cam;
    eventfd_t ignored;
    if (eventfd_read(cam->fd, &ignored) || r->next < 0)
        return true;
    const struct session_frame *f = &r->frame[r->next];
    struct dng d;
    char *path = session_path(r->session, f->path);
    const bool read = dng_read(&d, path, e);
    free(path);
    r->next = -1;
    if (!read)
        return false;
    // The light of now was never on for the recorded exposure: its start is not known on this
    // clock.
    const struct cam_frame frame = {.seq = ++r->seq,
                                    .shot = r->shot.id,
                                    .device_ns = 0,
                                    .exposure_ns = f->reported_ns,
                                    .gain = f->gain,
                                    .focus_per_m = f->focus_per_m,
                                    .temperature_k = f->temperature_k,
                                    .utc_ns = f->utc_ns,
                                    .w = d.w,
                                    .h = d.h,
                                    .raw = d.raw};
    cam_deliver(cam, &frame);
    dng_finish(&d);
    return true;
}

static void replay_close(struct cam *cam)
{
    struct replay *r = (struct replay *)cam;
    session_close(r->session);
    free(r->frame);
    free(r->served);
}

static const struct devopt options[] = {
    {"session", DEVOPT_TEXT, offsetof(struct replay, folder), .def = "",
     .help = "the folder to replay"},
    {0},
};

const struct cam_driver replay_cam = {
    .name = "replay",
    .summary = "the frames of a recorded session, count for count",
    .size = sizeof(struct replay),
    .options = options,
    .open = replay_open,
    .shoot = replay_shoot,
    .pump = replay_pump,
    .close = replay_close,
};
