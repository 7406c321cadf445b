// triggers.c - the lights and filters that this build can drive; nacre-lights needs no more.
#include "acquire/hardware.h"
#include "sim/sim.h"
#include "ui/drivers.h"
#include <stddef.h>

const struct trig_driver *const all_triggers[] = {
#ifdef HAVE_GPIOD
    &gpiod_trig,
#endif
#ifdef HAVE_LIBUSB
    &usb_trig,
#endif
    &prompt_trig,
    &sim_trig,
    &fault_trig,
    NULL,
};
