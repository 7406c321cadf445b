// factor_lines.h - the main directions of a pattern, and the pattern along them.
#pragma once
#include "process/factor.h"

// A table seen along two unit axes: node (i, j) of `t`, a plain table with power 1, holds
// S(axis[0] a + axis[1] b). Its range covers all of the original.
struct aligned {
    double axis[2][2];
    double half_width; // of the lobe at h = 0
    struct table t;
};

// Axes at these angles to the u axis; a range of 0 is the least that covers the table.
bool aligned_init(struct aligned *al, const struct table *rgb, const double angle_rad[2],
                  double range, struct err *e);
void aligned_finish(struct aligned *al);

// Back to the nodes of a table like `rgb`, which `out` is made as.
bool aligned_back(const struct aligned *al, const struct table *rgb, struct table *out,
                  struct err *e);

// What a pattern is: how much of its power, less a floor, lies off the lines and on each (the
// mirror lobe not counted) decides.
enum factor_kind aligned_kind(const struct aligned *al);

// Fills in n, range, power, axes, filters and error of a sum or a line (f->kind) along the angles.
// A filter holds power per length of its line, integrated over the line's width.
bool factor_lines(struct factors *f, const struct table *rgb, const double angle_rad[2],
                  struct err *e);
