// drivers.c - one list for every program; a driver is in it when its library was there at build.
#include "ui/drivers.h"
#include "acquire/hardware.h"
#include "sim/sim.h"
#include <stddef.h>

static const struct cam_driver *const cameras[] = {
#ifdef HAVE_LIBCAMERA
    &libcamera_cam,
#endif
    &v4l2_cam,
    &sim_cam,
    &replay_cam,
    &fault_cam,
    NULL,
};

const struct drivers all_drivers = {cameras, all_triggers, true};
