// tables_between.h - what bilinear look-up between nodes errs, and how many nodes are enough.
//
// Measured at random points of the plane: X at the point against X between the four nodes around
// it, both from transforms, averaged over the range of w. Relative L2 errors per area of (u, v).
#pragma once
#include "process/tables_pass.h"

struct between {
    double all;        // of the whole plane; the mirror's lobe is most of it
    double away;       // outside the mirror's lobe: sharp orders there show what nodes are missing
    double light_away; // share of the light that goes there
};

bool tables_between(const struct tables_pass *p, int n, int power, struct between *out,
                    struct err *e);

// The least n over powers 1, 3, 5, 7 whose errors are within `error`; `away` counts when more than
// that share of the light goes there. No limit on n but `most`: beyond it the n that it would take
// is extrapolated and returned.
bool tables_size(const struct tables_pass *p, double error, int most, int *n, int *power,
                 struct err *e);
