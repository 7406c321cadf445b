// drivers.h - the cameras, lights and filters that this build can drive.
#pragma once
#include "acquire/devices.h"

extern const struct drivers all_drivers;
