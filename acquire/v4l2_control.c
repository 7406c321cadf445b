// v4l2_control.c - finding, reading and setting controls.
#define _GNU_SOURCE
#include "acquire/v4l2_control.h"
#include <errno.h>
#include <linux/videodev2.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>

int v4l2_ioctl(int fd, unsigned long request, void *arg)
{
    int rc;
    do
        rc = ioctl(fd, request, arg);
    while (rc < 0 && errno == EINTR);
    return rc;
}

void v4l2_control_find(int fd, const uint32_t ids[], struct v4l2_control_range *out)
{
    *out = (struct v4l2_control_range){0};
    for (; *ids && !out->id; ids++) {
        struct v4l2_query_ext_ctrl q = {.id = *ids};
        if (v4l2_ioctl(fd, VIDIOC_QUERY_EXT_CTRL, &q) || q.flags & V4L2_CTRL_FLAG_DISABLED)
            continue;
        *out = (struct v4l2_control_range){.id = q.id,
                                           .lo = q.minimum,
                                           .hi = q.maximum,
                                           .step = q.step ? (int64_t)q.step : 1,
                                           .def = q.default_value,
                                           .is_wide = q.type == V4L2_CTRL_TYPE_INTEGER64,
                                           .read_only = q.flags & V4L2_CTRL_FLAG_READ_ONLY};
        snprintf(out->name, sizeof out->name, "%s", q.name);
    }
}

static bool transfer(int fd, const struct v4l2_control_range *c, bool write, int64_t *value,
                     struct err *e)
{
    struct v4l2_ext_control one = {.id = c->id};
    struct v4l2_ext_controls all = {.which = V4L2_CTRL_WHICH_CUR_VAL, .count = 1, .controls = &one};
    if (c->is_wide)
        one.value64 = *value;
    else
        one.value = (int32_t)*value;
    if (v4l2_ioctl(fd, write ? VIDIOC_S_EXT_CTRLS : VIDIOC_G_EXT_CTRLS, &all)) {
        const bool lost = errno == ENODEV || errno == EPROTO || errno == EIO || errno == ESHUTDOWN;
        return err_set(e, ERR_DEVICE, "control '%s': %s%s", c->name, strerror(errno),
                       lost ? " (unplugged?)" : "");
    }
    *value = c->is_wide ? one.value64 : one.value;
    return true;
}

bool v4l2_control_get(int fd, const struct v4l2_control_range *c, int64_t *value, struct err *e)
{
    return transfer(fd, c, false, value, e);
}

bool v4l2_control_set(int fd, const struct v4l2_control_range *c, int64_t *value, struct err *e)
{
    int64_t v = *value < c->lo ? c->lo : *value > c->hi ? c->hi : *value;
    v = c->lo + (v - c->lo + c->step / 2) / c->step * c->step;
    v = v > c->hi ? v - c->step : v;
    return transfer(fd, c, true, &v, e) && transfer(fd, c, false, value, e);
}

bool v4l2_control_manual(int fd, struct err *e)
{
    static const struct {
        uint32_t id;
        int64_t off;
    } automatic[] = {
        {V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL},
        {V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0}, // a frame rate that follows the exposure
        {V4L2_CID_AUTOGAIN, 0},
        {V4L2_CID_AUTO_WHITE_BALANCE, 0},
        {V4L2_CID_AUTOBRIGHTNESS, 0},
        {V4L2_CID_HUE_AUTO, 0},
        {V4L2_CID_FOCUS_AUTO, 0},
        {V4L2_CID_BACKLIGHT_COMPENSATION, 0},
        {V4L2_CID_WIDE_DYNAMIC_RANGE, 0},
        {V4L2_CID_POWER_LINE_FREQUENCY, V4L2_CID_POWER_LINE_FREQUENCY_DISABLED},
    };
    for (size_t k = 0; k < sizeof automatic / sizeof *automatic; k++) {
        const uint32_t ids[] = {automatic[k].id, 0};
        struct v4l2_control_range c;
        int64_t value = automatic[k].off;
        v4l2_control_find(fd, ids, &c);
        if (!c.id || c.read_only || value < c.lo || value > c.hi)
            continue;
        const bool matters = k < 3; // nothing can be measured while these change by themselves
        if (!v4l2_control_set(fd, &c, &value, e) && matters)
            return false;
        if (matters && value != automatic[k].off)
            return err_set(e, ERR_DEVICE, "control '%s' cannot be switched off", c.name);
    }
    return true;
}
