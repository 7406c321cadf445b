// energy.h - how much light the model returns, at normal incidence and for F = 1.
#pragma once
#include "sim/sample.h"

struct energy {
    double reflectance; // mean of |r|^2 over the cell: what must come back
    double orders;      // sum of |c_mn|^2, w = 2, of all |m|, |n| <= reach
    double propagating; // of the orders that are directions, each at its own w
    double returned;    // of the same with the BRDF's G / w^2 = 1 / cos_o
};

// The orders of a map end at half its nodes; those of shapes never do, and reach says how many are
// summed. The excess of `returned` over `propagating` is a property of the BRDF of docs/optics.md,
// whose wide orders are too bright, not an error of the sums.
bool energy_of(const struct sample *s, double lambda_m, int reach, struct energy *out,
               struct err *e);
