// devices.h - the camera, lights and filters of a rig, opened together.
#pragma once
#include "acquire/camera.h"
#include "acquire/trigger.h"
#include "core/rig.h"

struct drivers { // each ends with NULL
    const struct cam_driver *const *cameras;
    const struct trig_driver *const *triggers;
    bool keep_lights; // lines are held by the process nacre-lights, which has the same triggers
};

struct devices {
    struct cam *cam;
    struct trig *lights, *filters; // NULL: the rig has none
};

// Lights first, so that they are off before anything else happens.
bool devices_open(struct devices *d, const struct rig *rig, const struct drivers *drivers,
                  cam_on_frame *on_frame, void *ctx, struct err *e);
void devices_close(struct devices *d); // accepts a zeroed struct

bool devices_filter(struct devices *d, int position, struct err *e);
