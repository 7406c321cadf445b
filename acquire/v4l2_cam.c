// v4l2_cam.c - "v4l2:/dev/video0": any camera with a video node of the kernel.
//
// The device streams from open to close, as many lose their settings otherwise. A shot gets the
// first frame whose exposure began after its settings were written; frames between shots go back
// unread. V4L2 does not say which settings a frame was made with: for `settle` frames after a
// change frames say nothing, and from then on what the device says that it holds.
#define _GNU_SOURCE
#include "acquire/hardware.h"
#include "acquire/v4l2_control.h"
#include "acquire/v4l2_node.h"
#include "core/mem.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static const double ABSOLUTE_NS = 1e5; // V4L2_CID_EXPOSURE_ABSOLUTE counts 100 us

struct v4l2 {
    struct cam base;
    char *path, *format, *memory;
    int w, h, bits, settle;
    double fps, black, unity, focus_unit_per_m;
    int64_t row_ns;

    struct v4l2_node node;
    uint16_t *raw;                                   // [h][w]
    struct v4l2_control_range exposure, gain, focus; // id 0: left alone
    double exposure_unit_ns;

    // What the device says that it holds; 0 or NAN: it does not say.
    int64_t exposure_ns;
    double gain_now, focus_per_m;
    int64_t changed_ns;   // CLOCK_MONOTONIC, as all times here
    uint64_t settled_seq; // first frame that has it for sure
    bool settling;        // no frame has begun since the change

    uint64_t seq; // the device's 32 bits, continued
    bool have_seq;
    uint64_t wanted; // shot that waits for its frame; 0: none
    int64_t shot_ns; // when its settings were written
};

static int64_t mono_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

// A sensor's own exposure control counts rows. 0: not known.
static double row_ns_of_sensor(const struct v4l2 *v)
{
    static const uint32_t blank_id[] = {V4L2_CID_HBLANK, 0}, rate_id[] = {V4L2_CID_PIXEL_RATE, 0};
    struct v4l2_control_range blank, rate;
    int64_t px = 0, hz = 0;
    struct err ignored;
    v4l2_control_find(v->node.fd, blank_id, &blank);
    v4l2_control_find(v->node.fd, rate_id, &rate);
    if (!blank.id || !rate.id || !v4l2_control_get(v->node.fd, &blank, &px, &ignored) ||
        !v4l2_control_get(v->node.fd, &rate, &hz, &ignored) || hz <= 0)
        return 0;
    return 1e9 * (double)(v->node.w + px) / (double)hz;
}

static bool find_controls(struct v4l2 *v, struct err *e)
{
    static const uint32_t exposures[] = {V4L2_CID_EXPOSURE_ABSOLUTE, V4L2_CID_EXPOSURE, 0},
                          gains[] = {V4L2_CID_ANALOGUE_GAIN, V4L2_CID_GAIN, 0},
                          focuses[] = {V4L2_CID_FOCUS_ABSOLUTE, 0};
    const double row = v->row_ns ? (double)v->row_ns : row_ns_of_sensor(v);
    v->base.caps.row_ns = llround(row);
    v4l2_control_find(v->node.fd, exposures, &v->exposure);
    v->exposure_unit_ns = v->exposure.id == V4L2_CID_EXPOSURE_ABSOLUTE ? ABSOLUTE_NS : row;
    if (v->exposure_unit_ns <= 0 || v->exposure.read_only)
        v->exposure.id = 0;
    if (v->unity > 0)
        v4l2_control_find(v->node.fd, gains, &v->gain);
    if (v->focus_unit_per_m != 0)
        v4l2_control_find(v->node.fd, focuses, &v->focus);
    if (v->unity > 0 && (!v->gain.id || v->gain.read_only))
        return err_set(e, ERR_DATA, "unity: %s has no gain to set", v->path);
    if (v->focus_unit_per_m != 0 && (!v->focus.id || v->focus.read_only))
        return err_set(e, ERR_DATA, "focus: %s has no focus to set", v->path);
    return true;
}

static void fill_exposures(struct v4l2 *v)
{
    struct cam_caps *c = &v->base.caps;
    const struct v4l2_control_range *x = &v->exposure;
    const int64_t interval = v->node.interval_ns;
    c->exposure_min_ns = c->exposure_max_ns = interval ? interval : 1000000000;
    if (!x->id) // fixed, at something that only the camera knows: frames do not say
        return;
    c->exposure_step_ns = llround(v->exposure_unit_ns * (double)x->step);
    c->exposure_min_ns = llround(v->exposure_unit_ns * (double)(x->lo > 0 ? x->lo : x->step));
    c->exposure_max_ns = llround(v->exposure_unit_ns * (double)x->hi);
    // At a fixed rate no exposure is longer than from frame to frame.
    if (interval && c->exposure_max_ns > interval)
        c->exposure_max_ns = interval;
    if (c->exposure_max_ns < c->exposure_min_ns)
        c->exposure_max_ns = c->exposure_min_ns;
}

static void fill_caps(struct v4l2 *v)
{
    struct cam_caps *c = &v->base.caps;
    const struct pixel_format *p = v->node.pixels;
    const struct v4l2_control_range *g = &v->gain, *f = &v->focus;
    snprintf(c->model, sizeof c->model, "%s", v->node.model);
    snprintf(c->serial, sizeof c->serial, "%s", v->node.bus);
    c->w = v->node.w;
    c->h = v->node.h;
    c->bits = v->bits && v->bits < p->bits ? v->bits : p->bits;
    c->black = v->black;
    c->pattern = p->pattern;
    c->for_looking = p->for_looking;
    c->clock = CAM_CLOCK_MONO;
    c->gain_min = g->id ? (double)(g->lo > 0 ? g->lo : g->step) / v->unity : 1;
    c->gain_max = g->id ? (double)g->hi / v->unity : 1;
    const double a = (double)f->lo * v->focus_unit_per_m, b = (double)f->hi * v->focus_unit_per_m;
    c->focus_min_per_m = f->id ? fmin(a, b) : 0;
    c->focus_max_per_m = f->id ? fmax(a, b) : 0;
    c->settle = v->exposure.id || g->id || f->id ? v->settle : 0;
    c->dead_ns = 4 * (v->node.interval_ns ? v->node.interval_ns : 1000000000);
    v->gain_now = g->id ? NAN : 1;
    v->focus_per_m = NAN;
    fill_exposures(v);
}

static bool v4l2_open(struct cam *cam, struct err *e)
{
    struct v4l2 *v = (struct v4l2 *)cam;
    struct v4l2_node *n = &v->node;
    const bool dmabuf = !strcmp(v->memory, "dmabuf");
    if (!dmabuf && strcmp(v->memory, "mmap"))
        return err_set(e, ERR_DATA, "memory=%s: must be mmap or dmabuf", v->memory);
    if (!v4l2_node_open(n, v->path, e) || !v4l2_node_format(n, v->format, v->w, v->h, e) ||
        !v4l2_node_rate(n, v->fps, e) || !v4l2_control_manual(n->fd, e) || !find_controls(v, e))
        return false;
    fill_caps(v);
    if (v->black >= (1 << cam->caps.bits))
        return err_set(e, ERR_DATA, "black=%g: counts have only %d bits", v->black, cam->caps.bits);
    v->raw = sample_alloc((size_t)n->w * (size_t)n->h, sizeof *v->raw, "frame", e);
    const bool ok = v->raw && v4l2_node_start(n, dmabuf, e);
    cam->fd = n->ready;
    return ok;
}

// --- shots ---

static bool set_exposure(struct v4l2 *v, int64_t ns, struct err *e)
{
    const struct cam_caps *c = &v->base.caps;
    ns = ns < c->exposure_min_ns ? c->exposure_min_ns : ns;
    ns = ns > c->exposure_max_ns ? c->exposure_max_ns : ns;
    int64_t value = llround((double)ns / v->exposure_unit_ns);
    if (!v4l2_control_set(v->node.fd, &v->exposure, &value, e))
        return false;
    v->exposure_ns = llround((double)value * v->exposure_unit_ns);
    return true;
}

static bool set_gain(struct v4l2 *v, double gain, struct err *e)
{
    int64_t value = llround(fmax(v->base.caps.gain_min, gain) * v->unity);
    if (!v4l2_control_set(v->node.fd, &v->gain, &value, e))
        return false;
    v->gain_now = (double)value / v->unity;
    return true;
}

static bool set_focus(struct v4l2 *v, double per_m, struct err *e)
{
    int64_t value = llround(per_m / v->focus_unit_per_m);
    if (!v4l2_control_set(v->node.fd, &v->focus, &value, e))
        return false;
    v->focus_per_m = (double)value * v->focus_unit_per_m;
    return true;
}

static bool v4l2_shoot(struct cam *cam, const struct cam_shot *shot, struct err *e)
{
    struct v4l2 *v = (struct v4l2 *)cam;
    const int64_t exposure_ns = v->exposure_ns;
    const double gain = v->gain_now, focus = v->focus_per_m;
    v->wanted = 0;
    if ((v->exposure.id && !set_exposure(v, shot->exposure_ns, e)) ||
        (v->gain.id && !set_gain(v, shot->gain, e)) ||
        (v->focus.id && !isnan(shot->focus_per_m) && !set_focus(v, shot->focus_per_m, e)))
        return false;
    v->wanted = shot->id;
    v->shot_ns = mono_ns();
    const bool same = v->exposure_ns == exposure_ns &&
                      memcmp(&v->gain_now, &gain, sizeof gain) == 0 &&
                      memcmp(&v->focus_per_m, &focus, sizeof focus) == 0;
    if (!same) {
        v->changed_ns = v->shot_ns;
        v->settling = true;
    }
    return true;
}

// When the exposure of the first row began, by the kernel's stamp of its start, of the end of the
// last row's, or of when the first row had been read out.
static int64_t start_of(const struct v4l2 *v, const struct v4l2_buffer *b)
{
    const struct cam_caps *c = &v->base.caps;
    const bool stamped =
        (b->flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    const int64_t t =
        stamped ? (int64_t)b->timestamp.tv_sec * 1000000000 + (int64_t)b->timestamp.tv_usec * 1000
                : mono_ns();
    const int64_t exposure_ns = v->exposure_ns ? v->exposure_ns : v->node.interval_ns;
    if (stamped && v->node.stamps_arrival)
        return t - exposure_ns;
    if (stamped && (b->flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE)
        return t;
    return t - exposure_ns - c->row_ns * (c->h - 1);
}

static void deliver(struct v4l2 *v, const struct v4l2_taken *t, int64_t start_ns)
{
    const struct cam_caps *c = &v->base.caps;
    const bool whole = v4l2_node_unpack(&v->node, t, v->raw);
    const uint16_t limit = (uint16_t)((1u << c->bits) - 1);
    const size_t n = c->bits < v->node.pixels->bits ? (size_t)c->w * (size_t)c->h : 0;
    for (size_t k = 0; k < n; k++)
        v->raw[k] = v->raw[k] < limit ? v->raw[k] : limit;
    const bool settled = !v->settling && v->seq >= v->settled_seq;
    const struct cam_frame frame = {
        .seq = v->seq,
        .device_ns = start_ns,
        .exposure_ns = settled ? v->exposure_ns : 0,
        .gain = settled ? v->gain_now : NAN,
        .focus_per_m = settled ? v->focus_per_m : NAN,
        .temperature_k = NAN,
        .damaged = !whole || t->buffer.flags & V4L2_BUF_FLAG_ERROR,
        .w = c->w,
        .h = c->h,
        .raw = v->raw,
    };
    cam_deliver(&v->base, &frame);
}

static void frame_came(struct v4l2 *v, const struct v4l2_taken *t)
{
    const struct v4l2_buffer *b = &t->buffer;
    v->seq = v->have_seq ? v->seq + (uint32_t)(b->sequence - (uint32_t)v->seq) : b->sequence;
    v->have_seq = true;
    if (b->flags & V4L2_BUF_FLAG_LAST)
        return;
    const int64_t start_ns = start_of(v, b);
    if (v->settling && start_ns >= v->changed_ns) {
        v->settling = false;
        v->settled_seq = v->seq + (uint64_t)v->base.caps.settle;
    }
    if (!v->wanted || start_ns < v->shot_ns)
        return;
    v->wanted = 0;
    deliver(v, t, start_ns);
}

static bool v4l2_pump(struct cam *cam, struct err *e)
{
    struct v4l2 *v = (struct v4l2 *)cam;
    bool any = true;
    for (int k = 0; k < V4L2_BUFFERS && any; k++) { // a fast camera must not keep the loop here
        struct v4l2_taken t;
        if (!v4l2_node_take(&v->node, &t, &any, e))
            return false;
        if (any)
            frame_came(v, &t);
        if (any && !v4l2_node_give_back(&v->node, &t, e))
            return false;
    }
    return true;
}

static void v4l2_close(struct cam *cam)
{
    struct v4l2 *v = (struct v4l2 *)cam;
    v4l2_node_finish(&v->node);
    free(v->raw);
}

#define AT(field) offsetof(struct v4l2, field)
static const struct devopt options[] = {
    {"device", DEVOPT_TEXT, AT(path), .def = "/dev/video0",
     .help = "video node; those of /dev/v4l/by-id keep their name"},
    {"format", DEVOPT_TEXT, AT(format), .def = "auto",
     .help = "fourcc (RG12) or name (SRGGB12_CSI2P); auto: raw with the most bits"},
    {"w", DEVOPT_INT, AT(w), UNIT_PX, 1, 65536, NULL, "width, instead of the device's"},
    {"h", DEVOPT_INT, AT(h), UNIT_PX, 1, 65536, NULL, "height, instead of the device's"},
    {"bits", DEVOPT_INT, AT(bits), UNIT_NONE, 8, 16, NULL,
     "a sample really has, if fewer than its format"},
    {"black", DEVOPT_NUM, AT(black), UNIT_NONE, 0, 65535, "0", "black level, counts"},
    {"fps", DEVOPT_NUM, AT(fps), UNIT_HZ, 0, 10000, "0",
     "frames per second; 1/fps is the longest exposure; 0: as it is"},
    {"row", DEVOPT_NS, AT(row_ns), UNIT_S, 0, 0.1, "0",
     "from row to row of a rolling shutter; 0: as the driver says"},
    {"settle", DEVOPT_INT, AT(settle), UNIT_NONE, 0, 30, "3",
     "frames after which new settings are in force"},
    {"unity", DEVOPT_NUM, AT(unity), UNIT_NONE, 0, 1e6, "0",
     "value of the gain control that is gain 1; 0: leave gain alone"},
    {"focus", DEVOPT_NUM, AT(focus_unit_per_m), UNIT_PER_M, -100, 100, "0",
     "dioptres a step of the focus control; 0: leave focus alone"},
    {"memory", DEVOPT_TEXT, AT(memory), .def = "mmap",
     .help = "mmap, or dmabuf: buffers are exported and read as such"},
    {0},
};

const struct cam_driver v4l2_cam = {
    .name = "v4l2",
    .summary = "cameras with a video node of the kernel: USB (UVC), sensors, grabbers",
    .size = sizeof(struct v4l2),
    .options = options,
    .open = v4l2_open,
    .shoot = v4l2_shoot,
    .pump = v4l2_pump,
    .close = v4l2_close,
    .find = v4l2_node_find,
};
