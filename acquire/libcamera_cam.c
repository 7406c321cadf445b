// libcamera_cam.c - "libcamera:0": cameras behind libcamera.
//
// All buffers are under way all the time, in requests that carry settings. A shot gets the first
// frame of a request that was made for it; what it was made with is what its metadata say.
#define _GNU_SOURCE
#include "acquire/hardware.h"
#include "acquire/libcamera_bridge.h"
#include "core/mem.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

struct lc {
    struct cam base;
    char *name, *format;
    int w, h, settle;
    double black, fps;
    int64_t row_ns;

    struct lc_bridge *bridge;
    struct lc_stream stream;
    uint16_t *raw; // [h][w]
    struct lc_ask ask;
    uint64_t wanted; // shot that waits for its frame; 0: none
};

static void fill_caps(struct lc *l)
{
    struct cam_caps *c = &l->base.caps;
    const struct lc_stream *s = &l->stream;
    const int64_t interval = llround(1e9 / (l->fps > 0 ? l->fps : 30));
    snprintf(c->model, sizeof c->model, "%s", s->model);
    snprintf(c->serial, sizeof c->serial, "%s", s->id);
    c->w = s->w;
    c->h = s->h;
    c->bits = s->pixels->bits;
    c->black = l->black;
    c->pattern = s->pixels->pattern;
    c->for_looking = s->pixels->for_looking;
    c->clock = CAM_CLOCK_MONO; // libcamera hands on the kernel's stamps
    c->row_ns = l->row_ns;
    c->exposure_min_ns = c->exposure_max_ns = interval; // fixed, unless:
    if (s->exposure_max_us) {
        c->exposure_step_ns = 1000; // and the sensor's rows, which only the metadata tell
        c->exposure_min_ns = 1000 * (s->exposure_min_us > 0 ? s->exposure_min_us : 1);
        c->exposure_max_ns = 1000 * s->exposure_max_us;
        c->settle = l->settle;
    }
    c->gain_min = s->gain_max > 0 ? fmax(s->gain_min, 1e-3) : 1;
    c->gain_max = s->gain_max > 0 ? s->gain_max : 1;
    c->focus_min_per_m = s->focus_min_per_m;
    c->focus_max_per_m = s->focus_max_per_m;
    c->dead_ns = 2000000000 + 8 * interval; // requests of before come first
}

static bool open_cam(struct cam *cam, struct err *e)
{
    struct lc *l = (struct lc *)cam;
    if (!lc_open(&l->bridge, l->name, l->format, l->w, l->h, &cam->fd, &l->stream, e))
        return false;
    fill_caps(l);
    if (l->black >= (1 << cam->caps.bits))
        return err_set(e, ERR_DATA, "black=%g: counts have only %d bits", l->black, cam->caps.bits);
    l->ask = (struct lc_ask){.exposure_us = cam->caps.exposure_min_ns / 1000,
                             .interval_us = l->fps > 0 ? llround(1e6 / l->fps) : 0,
                             .gain = cam->caps.gain_min,
                             .focus_per_m = NAN};
    l->raw = sample_alloc((size_t)l->stream.w * (size_t)l->stream.h, sizeof *l->raw, "frame", e);
    for (int k = 0; l->raw && k < l->stream.requests; k++)
        if (!lc_request(l->bridge, &l->ask, e))
            return false;
    return l->raw;
}

static bool shoot(struct cam *cam, const struct cam_shot *shot, struct err *e)
{
    struct lc *l = (struct lc *)cam;
    const struct cam_caps *c = &cam->caps;
    int64_t ns = shot->exposure_ns < c->exposure_min_ns ? c->exposure_min_ns : shot->exposure_ns;
    ns = ns > c->exposure_max_ns ? c->exposure_max_ns : ns;
    (void)e;
    l->ask.shot = l->wanted = shot->id; // for requests from now on
    l->ask.exposure_us = ns / 1000;
    l->ask.gain = fmin(fmax(shot->gain, c->gain_min), c->gain_max);
    l->ask.focus_per_m = shot->focus_per_m;
    return true;
}

static void deliver(struct lc *l, const struct lc_frame *f)
{
    const struct lc_stream *s = &l->stream;
    const bool whole = unpack(s->pixels, f->data, f->bytes, s->stride, s->w, s->h, l->raw);
    const struct cam_frame frame = {
        .seq = f->seq,
        .shot = l->wanted,
        .device_ns = f->start_ns,
        .exposure_ns = 1000 * f->exposure_us,
        .gain = f->gain,
        .focus_per_m = f->focus_per_m,
        .temperature_k = f->temperature_k,
        .damaged = f->damaged || !whole,
        .w = s->w,
        .h = s->h,
        .raw = l->raw,
    };
    l->wanted = 0;
    cam_deliver(&l->base, &frame);
}

static bool pump(struct cam *cam, struct err *e)
{
    struct lc *l = (struct lc *)cam;
    struct lc_frame f;
    bool any;
    while (lc_next(l->bridge, &f, &any, e)) {
        if (!any)
            return true;
        if (l->wanted && f.shot == l->wanted)
            deliver(l, &f);
        if (!lc_request(l->bridge, &l->ask, e))
            return false;
    }
    return false;
}

static void close_cam(struct cam *cam)
{
    struct lc *l = (struct lc *)cam;
    lc_close(l->bridge);
    free(l->raw);
}

#define AT(field) offsetof(struct lc, field)
static const struct devopt options[] = {
    {"camera", DEVOPT_TEXT, AT(name), .def = "0", .help = "number, or libcamera's id"},
    {"format", DEVOPT_TEXT, AT(format), .def = "auto",
     .help = "name (SRGGB12_CSI2P); auto: raw with the most bits"},
    {"w", DEVOPT_INT, AT(w), UNIT_PX, 1, 65536, NULL, "width, instead of the camera's"},
    {"h", DEVOPT_INT, AT(h), UNIT_PX, 1, 65536, NULL, "height, instead of the camera's"},
    {"black", DEVOPT_NUM, AT(black), UNIT_NONE, 0, 65535, "0", "black level, counts"},
    {"fps", DEVOPT_NUM, AT(fps), UNIT_HZ, 0, 10000, "0", "frames per second; 0: as it is"},
    {"row", DEVOPT_NS, AT(row_ns), UNIT_S, 0, 0.1, "0", "from row to row of a rolling shutter"},
    {"settle", DEVOPT_INT, AT(settle), UNIT_NONE, 0, 30, "3",
     "frames after which new settings are in force"},
    {0},
};

const struct cam_driver libcamera_cam = {
    .name = "libcamera",
    .summary = "cameras behind libcamera: raw stream, settings by request",
    .size = sizeof(struct lc),
    .options = options,
    .open = open_cam,
    .shoot = shoot,
    .pump = pump,
    .close = close_cam,
    .find = lc_find,
};
