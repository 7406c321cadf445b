// devopt.h - the options of a driver as a table: "w=640,h=480,noise=2" fills the driver's struct.
//
// The same table is what `nacre doctor --devices` lists: name, unit, range, default, help.
#pragma once
#include "core/err.h"
#include "core/units.h"
#include <stddef.h>

enum devopt_kind {
    DEVOPT_NUM,  // double, SI, in `unit`
    DEVOPT_INT,  // int
    DEVOPT_NS,   // int64_t nanoseconds, typed as a time ("2ms")
    DEVOPT_TEXT, // char *, allocated; the driver frees it in close()
    DEVOPT_REST, // as DEVOPT_TEXT, but takes all that follows, commas too ("in=sim:w=8,h=4")
};

struct devopt {
    const char *name; // NULL ends the table
    enum devopt_kind kind;
    size_t at; // offsetof in the driver's struct
    enum unit unit;
    double lo, hi; // inclusive, SI (seconds for DEVOPT_NS); not used for texts
    const char *def;
    const char *help;
};

// Fills `into` with the defaults, then with what `args` says. `args` may be empty, and a first part
// without "=" is the value of the first option ("v4l2:/dev/video0"). ERR_DATA names the option and
// its range: "w=0: must be 1 to 16384". Texts are allocated even then: devopt_finish() frees them.
bool devopt_parse(const struct devopt *table, const char *args, void *into, struct err *e);
void devopt_finish(const struct devopt *table, void *into);
