// clock.h - the one clock that everything is stamped with: CLOCK_BOOTTIME, in ns.
#pragma once
#include <stdint.h>

int64_t clock_boot_ns(void); // goes on counting while the machine sleeps; never set back
