// clock.c - clocks of the kernel, and of devices by their fastest frames.
#define _GNU_SOURCE
#include "acquire/clock.h"
#include <math.h>
#include <time.h>

static const int64_t WINDOW_NS = 10000000000;

static int64_t now_ns(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

int64_t clock_boot_ns(void)
{
    return now_ns(CLOCK_BOOTTIME);
}
int64_t clock_utc_ns(void)
{
    return now_ns(CLOCK_REALTIME);
}

int64_t clock_mono_to_boot_ns(void)
{
    const int64_t before = now_ns(CLOCK_MONOTONIC), boot = now_ns(CLOCK_BOOTTIME);
    return boot - (before + now_ns(CLOCK_MONOTONIC)) / 2;
}

void clock_map_add(struct clock_map *m, int64_t device_ns, int64_t arrived_ns)
{
    const int64_t offset = arrived_ns - device_ns;
    if (!m->n || device_ns >= m->window_end_ns) { // a new window
        m->window_end_ns = device_ns + WINDOW_NS;
        m->window_offset_ns = offset;
        m->window_device_ns = device_ns;
    } else if (offset < m->window_offset_ns) {
        m->window_offset_ns = offset;
        m->window_device_ns = device_ns;
    }
    const bool is_first = !m->n || m->window_end_ns - WINDOW_NS <= m->device_ns[0];
    m->device_ns[1] = m->window_device_ns;
    m->offset_ns[1] = m->window_offset_ns;
    if (is_first) {
        m->device_ns[0] = m->window_device_ns;
        m->offset_ns[0] = m->window_offset_ns;
    }
    m->n++;
}

bool clock_map_known(const struct clock_map *m)
{
    return m->n >= 3;
}

double clock_map_drift(const struct clock_map *m)
{
    const int64_t apart = m->device_ns[1] - m->device_ns[0];
    return apart > 0 ? (double)(m->offset_ns[1] - m->offset_ns[0]) / (double)apart : 0;
}

int64_t clock_map_boot_ns(const struct clock_map *m, int64_t device_ns)
{
    const double since = (double)(device_ns - m->device_ns[1]);
    return device_ns + m->offset_ns[1] + llround(since * clock_map_drift(m));
}
