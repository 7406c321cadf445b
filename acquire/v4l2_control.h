// v4l2_control.h - controls of a V4L2 device: numbers with a range, some of them 64 bits wide.
#pragma once
#include "core/err.h"
#include <stdint.h>

struct v4l2_control_range {
    uint32_t id; // 0: the device has no such control
    char name[32];
    int64_t lo, hi, step, def;
    bool is_wide, read_only;
};

int v4l2_ioctl(int fd, unsigned long request, void *arg); // again when interrupted

// The first of `ids` (ends with 0) that the device has; out->id is 0 when it has none.
void v4l2_control_find(int fd, const uint32_t ids[], struct v4l2_control_range *out);
bool v4l2_control_get(int fd, const struct v4l2_control_range *c, int64_t *value, struct err *e);

// Rounds to the control's range and step; *value becomes what the device then says it has.
bool v4l2_control_set(int fd, const struct v4l2_control_range *c, int64_t *value, struct err *e);

// Switches every automatism off that would change frames by itself: exposure, frame rate, gain,
// white balance, focus, mains flicker, dynamic range. Controls that are not there are no error.
bool v4l2_control_manual(int fd, struct err *e);
