// clock.h - the one clock that everything is stamped with: CLOCK_BOOTTIME, in ns; and how other
// clocks run against it.
#pragma once
#include <stdbool.h>
#include <stdint.h>

int64_t clock_boot_ns(void);         // goes on counting while the machine sleeps; never set back
int64_t clock_utc_ns(void);          // since 1970
int64_t clock_mono_to_boot_ns(void); // CLOCK_BOOTTIME minus CLOCK_MONOTONIC, now

// A device's own clock, from pairs of its end of exposure and the frame's arrival. Frames are never
// early, so the smallest difference in a window is nearest to the truth; two windows give the
// drift. The offset contains the device's least delay, which nothing here can tell from it.
struct clock_map {
    int n;
    int64_t device_ns[2], offset_ns[2]; // best pair of the first window, and of the last
    int64_t window_end_ns, window_device_ns, window_offset_ns;
};
void clock_map_add(struct clock_map *m, int64_t device_ns, int64_t arrived_ns);
bool clock_map_known(const struct clock_map *m); // 3 pairs or more
int64_t clock_map_boot_ns(const struct clock_map *m, int64_t device_ns);
double clock_map_drift(const struct clock_map *m); // seconds per second, 0 in the first window
