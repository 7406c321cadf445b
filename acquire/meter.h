// meter.h - how an automatic bracket finds its exposures: from one metering shot to the next.
#pragma once
#include "acquire/plan.h"

struct meter {
    int64_t exposure_ns; // of the next shot; 0: nothing is being metered
    int shots;
};

enum meter_result { METER_AGAIN, METER_DONE };

// Looks at a shot whose brightest pixels lie at `bright` of full scale above black and of which
// `saturated` is the share at white. METER_AGAIN: m->exposure_ns is the next one to try.
// METER_DONE: the bracket's exposures are in out[n]; n is 0 when camera and light allow none. They
// lie on a grid of steps from the plan's first guess, so that brackets share their dark frames.
enum meter_result meter_look(struct meter *m, const struct plan *p, const struct cam_caps *caps,
                             const struct rig_light *light, double saturated, double bright,
                             int64_t out[PLAN_MAX_EXPOSURES], int *n);
