// lut_filters.h - one sample photographed through several filters: what lies between them.
//
// From one photograph a table has to guess how the orders change with the wavelength: as
// (lm/l)^exponent, which a deep relief does not. Several measure it. At the same h/l their patterns
// (lm/l)^e Lm are interpolated over 1/l, in which the orders of a relief are smooth: cubic Hermite
// pieces with the slopes of parabolas through three neighbours, straight on beyond the first and
// the last. The sum over photographs of weight times pattern is that interpolation, so the table is
// the sum of one table per photograph, whose light is multiplied by its weight.
#pragma once
#include "core/table.h"

enum { LUT_FILTERS = 16 };

struct lut_filters {
    int n;
    double lambda_m[LUT_FILTERS]; // rising
};

// ERR_DATA unless the wavelengths rise by 5 nm or more.
bool lut_filters_check(const struct lut_filters *f, struct err *e);
// Of the photograph k at a wavelength: 1 at its own, 0 at the others'.
double lut_filters_weight(const struct lut_filters *f, int k, double lambda_m);

// Adds a photograph's table: values, and variances; what one did not see is not covered.
void lut_filters_add(struct table *sum, const struct table *part);
