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

// The last events, oldest first.
struct world_state {
    int64_t now_ns, skip_ns;
    int has_lights, has_filters; // whether such a trigger was ever opened
    int n_lights, n_filters;
    struct {
        uint32_t mask;
        int64_t from_ns, to_ns; // to_ns INT64_MAX: still on
    } light[WORLD_EVENTS];
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

// From `from_ns` on the lines of `mask` are lit and all others dark.
void world_set_lines(struct world *w, uint32_t mask, int64_t from_ns);
void world_pulse(struct world *w, uint32_t mask, int64_t from_ns, int64_t to_ns); // adds to it
void world_set_filter(struct world *w, int position, int64_t from_ns);

void world_read(struct world *w, struct world_state *s);
// For how long of [from, to) the line was lit while the filter was at `position` (-1: any), ns.
int64_t world_lit_ns(const struct world_state *s, int line, int position, int64_t from_ns,
                     int64_t to_ns);
