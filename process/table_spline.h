// table_spline.h - a table between its nodes to sixth order: what a renderer's bilinear look-up is
// judged by.
//
// The quintic spline through the nodes, in node index. On a table of a lobe pattern with 3 nodes to
// a lobe's sigma it errs by 1e-5, where bilinear reading errs by 2e-2.
#pragma once
#include "core/table.h"

struct table_spline {
    const struct table *table; // not owned; outlives the spline
    double *coef;              // [count][3][n][n], owned
};

bool table_spline_init(struct table_spline *s, const struct table *t, struct err *e);
void table_spline_finish(struct table_spline *s); // accepts a zeroed struct

// As table_eval: black outside the range, the first `count` tables when 0 < count.
void table_spline_at(const struct table_spline *s, double u, double v, double w, int count,
                     double out[3]);
