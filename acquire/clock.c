// clock.c - CLOCK_BOOTTIME as one integer.
#define _GNU_SOURCE
#include "acquire/clock.h"
#include <time.h>

int64_t clock_boot_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_BOOTTIME, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}
