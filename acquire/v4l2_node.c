// v4l2_node.c - the streaming half of V4L2, by mmap or by exported dmabufs.
#define _GNU_SOURCE
#include "acquire/v4l2_node.h"
#include "acquire/v4l2_control.h"
#include "core/mem.h"
#include <errno.h>
#include <fcntl.h>
#include <glob.h>
#include <linux/dma-buf.h>
#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/mman.h>
#include <unistd.h>

static bool fault(const struct v4l2_node *n, const char *what, struct err *e)
{
    const char *why = errno == ENODEV  ? "it is gone (unplugged?)"
                      : errno == EBUSY ? "another program uses it"
                                       : strerror(errno);
    return err_set(e, ERR_DEVICE, "%s: %s: %s", n->path, what, why);
}

static bool is_planar(const struct v4l2_node *n)
{
    return n->type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE;
}

// --- opening ---

static bool capture_type(const struct v4l2_capability *c, uint32_t *type)
{
    const uint32_t caps = c->capabilities & V4L2_CAP_DEVICE_CAPS ? c->device_caps : c->capabilities;
    *type = caps & V4L2_CAP_VIDEO_CAPTURE          ? V4L2_BUF_TYPE_VIDEO_CAPTURE
            : caps & V4L2_CAP_VIDEO_CAPTURE_MPLANE ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE
                                                   : 0;
    return *type && caps & V4L2_CAP_STREAMING;
}

bool v4l2_node_open(struct v4l2_node *n, const char *path, struct err *e)
{
    struct v4l2_capability c = {0};
    *n = (struct v4l2_node){.path = path, .ready = -1};
    for (int k = 0; k < V4L2_BUFFERS; k++)
        n->mapped[k].dma = -1;
    n->fd = open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (n->fd < 0)
        return fault(n, "open", e);
    if (v4l2_ioctl(n->fd, VIDIOC_QUERYCAP, &c) || !capture_type(&c, &n->type))
        return err_set(e, ERR_DEVICE, "%s: is no camera that streams", path);
    snprintf(n->model, sizeof n->model, "%s", (const char *)c.card);
    snprintf(n->bus, sizeof n->bus, "%s", (const char *)c.bus_info);
    n->stamps_arrival = !strcmp((const char *)c.driver, "uvcvideo"); // Linux 6.1, uvc_video.c
    return true;
}

// Pixel format number `index` of the device; 0 past the last.
static uint32_t offered(const struct v4l2_node *n, uint32_t index)
{
    struct v4l2_fmtdesc d = {.index = index, .type = n->type};
    return v4l2_ioctl(n->fd, VIDIOC_ENUM_FMT, &d) ? 0 : d.pixelformat;
}

static const struct pixel_format *best_format(const struct v4l2_node *n)
{
    const struct pixel_format *f;
    for (int rank = 0; (f = pixel_format_at(rank)); rank++)
        for (uint32_t k = 0, code; (code = offered(n, k)); k++)
            if (code == f->fourcc)
                return f;
    return NULL;
}

static bool choose_format(struct v4l2_node *n, const char *name, struct err *e)
{
    const bool is_auto = !strcmp(name, "auto");
    n->pixels = is_auto ? best_format(n) : pixel_format_named(name);
    if (n->pixels)
        return true;
    return is_auto ? err_set(e, ERR_DEVICE, "%s: has no pixel format that nacre reads", n->path)
                   : err_set(e, ERR_DATA, "format=%s: not known; one is RG12, or SRGGB12", name);
}

bool v4l2_node_format(struct v4l2_node *n, const char *name, int w, int h, struct err *e)
{
    struct v4l2_format f = {.type = n->type};
    struct v4l2_pix_format *one = &f.fmt.pix;
    struct v4l2_pix_format_mplane *many = &f.fmt.pix_mp;
    char text[5];
    if (!choose_format(n, name, e))
        return false;
    if (v4l2_ioctl(n->fd, VIDIOC_G_FMT, &f))
        return fault(n, "format", e);
    // Width, height and fourcc are at the same place in both structs; the rest is not.
    const uint32_t want_w = w ? (uint32_t)w : one->width, want_h = h ? (uint32_t)h : one->height;
    if (is_planar(n))
        *many = (struct v4l2_pix_format_mplane){.width = want_w,
                                                .height = want_h,
                                                .pixelformat = n->pixels->fourcc,
                                                .field = V4L2_FIELD_NONE,
                                                .num_planes = 1};
    else
        *one = (struct v4l2_pix_format){.width = want_w,
                                        .height = want_h,
                                        .pixelformat = n->pixels->fourcc,
                                        .field = V4L2_FIELD_NONE};
    if (v4l2_ioctl(n->fd, VIDIOC_S_FMT, &f))
        return fault(n, "format", e);
    const uint32_t field = is_planar(n) ? many->field : one->field;
    n->stride = is_planar(n) ? many->plane_fmt[0].bytesperline : one->bytesperline;
    n->w = (int)one->width;
    n->h = (int)one->height;
    if (one->pixelformat != n->pixels->fourcc)
        return err_set(e, ERR_DATA, "format=%s: %s does not have it",
                       pixel_fourcc_text(n->pixels->fourcc, text), n->path);
    if ((w && w != n->w) || (h && h != n->h))
        return err_set(e, ERR_DATA, "w=%d,h=%d: the nearest that %s has is %d x %d", w ? w : n->w,
                       h ? h : n->h, n->path, n->w, n->h);
    if (field != V4L2_FIELD_NONE || (is_planar(n) && many->num_planes != 1))
        return err_set(e, ERR_DEVICE, "%s: interlaced or split pictures are of no use", n->path);
    if (!pixel_width_ok(n->pixels, n->w) || n->h < 1)
        return err_set(e, ERR_DEVICE, "%s: %d x %d does not fit %s", n->path, n->w, n->h,
                       n->pixels->name);
    const size_t row = pixel_row_bytes(n->pixels, n->w);
    n->stride = n->stride < row ? row : n->stride;
    return true;
}

bool v4l2_node_rate(struct v4l2_node *n, double fps, struct err *e)
{
    struct v4l2_streamparm p = {.type = n->type};
    struct v4l2_captureparm *c = &p.parm.capture;
    const bool has = !v4l2_ioctl(n->fd, VIDIOC_G_PARM, &p) && c->capability & V4L2_CAP_TIMEPERFRAME;
    if (fps > 0 && !has)
        return err_set(e, ERR_DATA, "fps=%g: %s has no frame rate to set", fps, n->path);
    if (fps > 0) {
        c->timeperframe = (struct v4l2_fract){1000, (uint32_t)lround(1000 * fps)};
        if (v4l2_ioctl(n->fd, VIDIOC_S_PARM, &p))
            return fault(n, "frame rate", e);
    }
    if (!has || !c->timeperframe.numerator || !c->timeperframe.denominator)
        return true;
    const double interval_s = c->timeperframe.numerator / (double)c->timeperframe.denominator;
    n->interval_ns = llround(1e9 * interval_s);
    return fps <= 0 || fabs(interval_s * fps - 1) < 0.01 ||
           err_set(e, ERR_DATA, "fps=%g: the nearest that %s has is %g", fps, n->path,
                   1 / interval_s);
}

// --- streaming ---

static void describe(const struct v4l2_node *n, uint32_t index, struct v4l2_taken *t)
{
    *t = (struct v4l2_taken){
        .buffer = {.type = n->type, .memory = V4L2_MEMORY_MMAP, .index = index}};
    if (is_planar(n)) {
        t->buffer.m.planes = &t->plane;
        t->buffer.length = 1;
    }
}

static bool map_buffer(struct v4l2_node *n, uint32_t index, bool dmabuf, struct err *e)
{
    struct v4l2_mapped *m = &n->mapped[index];
    struct v4l2_taken t;
    describe(n, index, &t);
    if (v4l2_ioctl(n->fd, VIDIOC_QUERYBUF, &t.buffer))
        return fault(n, "buffer", e);
    off_t offset = is_planar(n) ? t.plane.m.mem_offset : t.buffer.m.offset;
    if (dmabuf) {
        struct v4l2_exportbuffer x = {.type = n->type, .index = index, .flags = O_RDWR | O_CLOEXEC};
        if (v4l2_ioctl(n->fd, VIDIOC_EXPBUF, &x))
            return fault(n, "memory=dmabuf", e);
        m->dma = x.fd;
        offset = 0;
    }
    const size_t bytes = is_planar(n) ? t.plane.length : t.buffer.length;
    void *at = mmap(NULL, bytes, PROT_READ, MAP_SHARED, m->dma < 0 ? n->fd : m->dma, offset);
    if (at == MAP_FAILED)
        return fault(n, "mmap", e);
    m->at = at;
    m->bytes = bytes;
    return v4l2_ioctl(n->fd, VIDIOC_QBUF, &t.buffer) == 0 || fault(n, "queue", e);
}

bool v4l2_node_start(struct v4l2_node *n, bool dmabuf, struct err *e)
{
    struct v4l2_requestbuffers r = {
        .count = V4L2_BUFFERS, .type = n->type, .memory = V4L2_MEMORY_MMAP};
    if (v4l2_ioctl(n->fd, VIDIOC_REQBUFS, &r))
        return fault(n, "buffers", e);
    for (uint32_t k = 0; k < r.count && k < V4L2_BUFFERS; k++)
        if (!map_buffer(n, k, dmabuf, e))
            return false;
    struct v4l2_event_subscription change = {.type = V4L2_EVENT_SOURCE_CHANGE};
    (void)v4l2_ioctl(n->fd, VIDIOC_SUBSCRIBE_EVENT, &change); // few devices have it
    if (v4l2_ioctl(n->fd, VIDIOC_STREAMON, &n->type))
        return fault(n, "streaming", e);
    // Frames are input, events are urgent input: one descriptor that is readable for both.
    struct epoll_event ev = {.events = EPOLLIN | EPOLLPRI};
    n->ready = epoll_create1(EPOLL_CLOEXEC);
    return (n->ready >= 0 && !epoll_ctl(n->ready, EPOLL_CTL_ADD, n->fd, &ev)) ||
           fault(n, "epoll", e);
}

void v4l2_node_finish(struct v4l2_node *n)
{
    if (!n->path) // never opened
        return;
    if (n->fd >= 0)
        (void)v4l2_ioctl(n->fd, VIDIOC_STREAMOFF, &n->type);
    for (int k = 0; k < V4L2_BUFFERS; k++) {
        if (n->mapped[k].at)
            munmap(n->mapped[k].at, n->mapped[k].bytes);
        if (n->mapped[k].dma >= 0)
            close(n->mapped[k].dma);
    }
    if (n->fd >= 0)
        close(n->fd);
}

// --- frames ---

static bool look_at_events(struct v4l2_node *n, struct err *e)
{
    struct pollfd p = {n->fd, POLLIN | POLLPRI, 0};
    struct v4l2_event ev = {0};
    if (poll(&p, 1, 0) == 1 && p.revents & (POLLERR | POLLHUP | POLLNVAL))
        return err_set(e, ERR_DEVICE, "%s: streaming has stopped (unplugged?)", n->path);
    while (p.revents & POLLPRI && !v4l2_ioctl(n->fd, VIDIOC_DQEVENT, &ev))
        if (ev.type == V4L2_EVENT_SOURCE_CHANGE)
            return err_set(e, ERR_DEVICE, "%s: its source has changed size or timing", n->path);
    return true;
}

bool v4l2_node_take(struct v4l2_node *n, struct v4l2_taken *t, bool *any, struct err *e)
{
    describe(n, 0, t);
    *any = !v4l2_ioctl(n->fd, VIDIOC_DQBUF, &t->buffer);
    if (*any || errno == EAGAIN)
        return look_at_events(n, e);
    return fault(n, "streaming", e);
}

static void sync_dma(const struct v4l2_mapped *m, uint64_t end)
{
    struct dma_buf_sync s = {DMA_BUF_SYNC_READ | end};
    if (m->dma >= 0)
        (void)v4l2_ioctl(m->dma, DMA_BUF_IOCTL_SYNC, &s);
}

bool v4l2_node_unpack(struct v4l2_node *n, const struct v4l2_taken *t, uint16_t *out)
{
    const struct v4l2_mapped *m = &n->mapped[t->buffer.index];
    const size_t skip = is_planar(n) ? t->plane.data_offset : 0,
                 used = is_planar(n) ? t->plane.bytesused : t->buffer.bytesused,
                 bytes = used > m->bytes ? m->bytes : used;
    sync_dma(m, DMA_BUF_SYNC_START);
    const bool whole = bytes > skip && unpack(n->pixels, (const char *)m->at + skip, bytes - skip,
                                              n->stride, n->w, n->h, out);
    sync_dma(m, DMA_BUF_SYNC_END);
    return whole;
}

bool v4l2_node_give_back(struct v4l2_node *n, struct v4l2_taken *t, struct err *e)
{
    struct v4l2_taken again;
    describe(n, t->buffer.index, &again);
    return !v4l2_ioctl(n->fd, VIDIOC_QBUF, &again.buffer) || fault(n, "queue", e);
}

// --- what there is ---

static void look(const char *path, found_fn *found, void *ctx)
{
    struct v4l2_node n;
    struct err e = {0};
    char *uri = xasprintf("v4l2:%s", path);
    if (v4l2_node_open(&n, path, &e)) {
        const struct pixel_format *f = best_format(&n);
        char *what = xasprintf("%s (%s), best format %s%s", n.model, n.bus, f ? f->name : "none",
                               f && f->for_looking ? ", not for measurement" : "");
        found(ctx, &(struct found){uri, what, f ? NULL : "no pixel format that nacre reads"});
        free(what);
    } else if (n.fd < 0) {
        found(ctx, &(struct found){uri, "video device",
                                   errno == EACCES ? "join the group 'video' and log in again"
                                                   : strerror(errno)});
    }
    v4l2_node_finish(&n);
    free(uri);
}

void v4l2_node_find(found_fn *found, void *ctx)
{
    glob_t g;
    if (glob("/dev/video*", 0, NULL, &g))
        return;
    for (size_t k = 0; k < g.gl_pathc; k++)
        look(g.gl_pathv[k], found, ctx);
    globfree(&g);
}
