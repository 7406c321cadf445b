// tables_taylor.h - tables in powers of w (D14): kept to compare with, and for old renderers.
//
// With S cut after order N, |S|^2 has 2 N + 1 tables (T17's three for N = 1). The remainder of
// exp(i y) is |y|^(N+1) / (N+1)!, sharp (S13 carries a factor exp(y) that real exponentials need);
// y is largest at w_max, lambda_min and half the height range. Before it converges the terms reach
// exp(y), and their alternating sum in float32 loses what they exceed 1 by: T17 fig. 13.
#pragma once
#include "process/tables_pass.h"

double taylor_remainder(double y, int order); // INFINITY beyond the range of double
int taylor_order(double y,
                 double remainder); // y, remainder > 0: the least order with a remainder that small

// An even count is cut inside the order count / 2. Adds to meta: "nacre.taylor_order",
// "nacre.taylor_y", "nacre.taylor_remainder", "nacre.taylor_order_needed" (for the tolerance, 1e-3
// when there is none), "nacre.taylor_bound" (what the remainder allows the relative L2 error to be)
// and "nacre.taylor_rounding" (what float32 tables add to it). ERR_DATA: more than TABLES_MAX.
bool taylor_make(struct table *t, const struct tables_pass *p, struct err *e);
