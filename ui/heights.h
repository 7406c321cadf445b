// heights.h - a height field as the commands take it: file, units, holes.
#pragma once
#include "core/hfield.h"
#include "ui/cli.h"

struct heights_opts {
    const char *pixel; // "0.254um" or "0.128um,0.315um"; NULL: what the file says
    double z_scale_m;  // NAN: not given
    bool fill;         // fill nodes that were not measured, else they are refused
    bool holes;        // unless they may stay
};

// ERR_DATA with path and place of the first hole unless `fill`.
bool heights_read(struct hfield *hf, const char *path, const struct heights_opts *o, struct err *e);
