// truth.h - the table S_d that a perfect measurement of a sample would give (docs/optics.md 3).
//
//     S_d(u, v) = 1 / (4 pi^2 w^2) * integral D(u, v, w; lambda) P cmf dlambda,
// with the sample's own dependence on wavelength at every (u, v): exponent 2 for an amplitude,
// near 4 for a shallow phase. P is scaled so that the integral of P ybar is 1. The integrals are
// Gauss sums between the observer's 5 nm knots, finer than any lobe is wide.
#pragma once
#include "core/spectrum.h"
#include "core/table.h"
#include "sim/farfield.h"
#include "sim/view.h"

// At one point, everything summed anew. w: h.n of the geometry that is asked for (2 at the centre).
void truth_xyz(const struct sample *s, const struct spectrum *illuminant, double u, double v,
               double w, double xyz[3]);

// The whole table (nodes and range of `t`, from table_init) by struct farfield, with the w at which
// the view photographs each (u, v).
bool truth_table(const struct sample *s, const struct sim_view *v,
                 const struct spectrum *illuminant, struct table *t, struct err *e);
