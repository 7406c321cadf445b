// triggers.c - the lights and filters that this build can drive; nacre-lights needs no more.
#include "sim/sim.h"
#include "ui/drivers.h"
#include <stddef.h>

const struct trig_driver *const all_triggers[] = {
    &sim_trig,
    &fault_trig,
    NULL,
};
