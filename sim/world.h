// world.h - what simulated devices share: a clock, and when lights and filters changed.
//
// Camera and lights may live in different processes; they meet in a small file that is mapped by
// all who open the same name, and removed by the last. Time is CLOCK_BOOTTIME plus what exposures
// have skipped: a simulated camera need not wait for light that it has already counted.
// Any thread may call.
#pragma once
#include "core/err.h"
#include <stdint.h>

enum { WORLD_EVENTS = 128 };

struct world_light {
    uint32_t mask;
    int64_t from_ns, to_ns;  // to_ns INT64_MAX: still on
    double level;            // brightness, 1 as the rig states it
    double pwm_hz, pwm_duty; // chopped, with the same mean; 0: steady
};

// The last events, oldest first.
struct world_state {
    int64_t now_ns, skip_ns;
    int has_lights, has_filters; // whether such a trigger was ever opened
    int n_lights, n_filters;
    struct world_light light[WORLD_EVENTS];
    struct {
        int position;
        int64_t from_ns;
    } filter[WORLD_EVENTS];
};

struct world;

// "" opens one of the caller's own. ERR_FILE when the file cannot be made.
struct world *world_open(const char *name, struct err *e);
void world_close(struct world *w); // accepts NULL

int64_t world_now_ns(struct world *w);
void world_skip(struct world *w, int64_t ns); // the clock jumps forward

// All lines that are on go dark at l->from_ns, those of l->mask on.
void world_set_lines(struct world *w, const struct world_light *l);
void world_pulse(struct world *w, const struct world_light *l); // adds to what is on
void world_set_filter(struct world *w, int position, int64_t from_ns);

void world_read(struct world *w, struct world_state *s);
// Light of a line in [from, to) while the filter was at `position` (-1: any), as seconds at the
// rated brightness.
double world_lit_s(const struct world_state *s, int line, int position, int64_t from_ns,
                   int64_t to_ns);
