// v4l2_node.h - a video node of the kernel that streams: format, rate, buffers, frames as they lie.
//
// One struct, filled step by step: open, format, rate, start; finish() undoes whatever was reached.
// Single-plane queues and multi-planar ones with one plane are the same to the caller.
#pragma once
#include "acquire/found.h"
#include "acquire/unpack.h"
#include <linux/videodev2.h>

enum { V4L2_BUFFERS = 4 };

struct v4l2_mapped {
    void *at; // NULL: none
    size_t bytes;
    int dma; // -1: mapped from the device itself
};

struct v4l2_node {
    const char *path; // not owned
    int fd;           // -1: not open
    uint32_t type;    // of the queue
    char model[64], bus[64];
    bool stamps_arrival; // frames are stamped when their first bytes come, whatever their flags say
    const struct pixel_format *pixels;
    int w, h;
    size_t stride;
    int64_t interval_ns; // from frame to frame; 0: not known
    struct v4l2_mapped mapped[V4L2_BUFFERS];
    int ready; // readable when there is a frame, an event, or an end to it all; the caller closes
               // it
};

struct v4l2_taken { // a frame between take and give back
    struct v4l2_buffer buffer;
    struct v4l2_plane plane;
};

bool v4l2_node_open(struct v4l2_node *n, const char *path, struct err *e);
bool v4l2_node_format(struct v4l2_node *n, const char *format, int w, int h, struct err *e);
bool v4l2_node_rate(struct v4l2_node *n, double fps, struct err *e); // 0: as it is
bool v4l2_node_start(struct v4l2_node *n, bool dmabuf, struct err *e);
void v4l2_node_finish(struct v4l2_node *n);

// The next finished frame; *any is false when there is none. False: the device is gone, or sends
// another kind of picture from now on.
bool v4l2_node_take(struct v4l2_node *n, struct v4l2_taken *t, bool *any, struct err *e);
bool v4l2_node_unpack(struct v4l2_node *n, const struct v4l2_taken *t,
                      uint16_t *out); // as unpack()
bool v4l2_node_give_back(struct v4l2_node *n, struct v4l2_taken *t, struct err *e);

void v4l2_node_find(found_fn *found, void *ctx);
