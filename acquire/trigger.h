// trigger.h - lines that switch lights, and wheels or slides that hold filters.
//
// Two kinds behind one table. Lines: the state is a mask, bit k is line k, off at open and at
// close. A selector (caps.positions > 0): the state is the position, 0 to positions - 1; there is
// no pulse. Where set() takes time (a wheel, a person) fd is not -1: it is an eventfd that becomes
// readable when the move has ended; trig_settled() then says how. Line drivers have fd -1: done on
// return. One thread owns a trigger. Lines are usually held by the process nacre-lights, not by
// nacred, so a simulated light must be visible to a simulated camera in another process.
#pragma once
#include "acquire/devopt.h"
#include "acquire/found.h"
#include <stdint.h>

struct trig_caps { // filled by open
    char model[64];
    int lines;         // 1 to 32; 0: a selector
    int positions;     // of a selector; 0: lines
    int64_t settle_ns; // longest time from set() to its effect, for time limits and estimates
};

struct trig;

struct trig_driver {
    const char *name, *summary;   // "gpiod"; one line for doctor --devices
    size_t size;                  // sizeof the driver's struct, whose first member is struct trig
    const struct devopt *options; // parsed into the driver's struct before open; may be NULL
    bool (*open)(struct trig *t, struct err *e); // all lines off; on failure close() is called
    bool (*set)(struct trig *t, uint32_t state, struct err *e);
    bool (*pulse)(struct trig *t, uint32_t mask, int64_t duration_ns,
                  struct err *e);             // returns at
                                              // once; the driver or the device switches off again
    void (*close)(struct trig *t);            // lines off; once; also after a failed open; not fd
    void (*find)(found_fn *found, void *ctx); // what there is to open; NULL: nothing to look for
};

struct trig {
    const struct trig_driver *drv;
    const struct trig_driver *const *drivers; // for drivers that wrap another one
    int fd;                                   // -1, or an eventfd: a move has ended
    struct trig_caps caps;
    int64_t changed_ns; // CLOCK_BOOTTIME at which the last set() or pulse() took effect
    int64_t ends_ns;    // CLOCK_BOOTTIME at which the last pulse() ends
    struct err moved;   // how the last move ended; the driver's thread fills it before fd
};

struct trig *trig_open(const struct trig_driver *const drivers[], const char *uri, struct err *e);
bool trig_set(struct trig *t, uint32_t state, struct err *e);
bool trig_pulse(struct trig *t, uint32_t mask, int64_t duration_ns, struct err *e);
bool trig_settled(struct trig *t, struct err *e); // after fd was readable: false when it failed
void trig_close(struct trig *t);                  // accepts NULL
