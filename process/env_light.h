// env_light.h - an environment as a sample faces it: on the grid of a kernel, transformed.
//
// Depends on the environment, the frame and the grid: keep it while only the camera moves, the
// table changes, or the sample turns about its normal (env_how.turn_rad).
#pragma once
#include "process/env_kernel.h"
#include "process/environment.h"

struct env_light {
    struct env_grid grid;
    struct frame frame;
    double t, b;   // middle of the window of o
    double t0, b0; // cosines (mirrored: -i_t, -i_b) of the first node
    int n;         // pre functions
    double used;   // share of the map's pixels that are lit, in front and within the table's reach
    double *spec[3][TERMS_MOST]; // [period][period/2 + 1] complex: channel, pre function
};

// For the window of o around (t, b) that is as wide as the kernel's span.
bool env_light_init(struct env_light *l, const struct env_kernel *k, const struct environment *env,
                    const struct frame *f, double t, double b, struct err *e);
void env_light_finish(struct env_light *l); // accepts a zeroed struct
