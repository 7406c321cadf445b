// drivers.h - the cameras, lights and filters that this build can drive.
#pragma once
#include "acquire/devices.h"

extern const struct trig_driver *const all_triggers[]; // ends with NULL
extern const struct drivers all_drivers;
