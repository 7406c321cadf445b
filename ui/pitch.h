// pitch.h - the period of a sample, guessed from what it diffracts: a start for predicted orders.
#pragma once
#include "core/table.h"
#include "process/lut_pattern.h"

// By the first order along u or v; NAN where none stands out.
double pitch_of_table(const struct table *t);

// By how far a photograph in one wavelength repeats along u or v; NAN where it does not.
double pitch_of_pattern(const struct lut_pattern *p, double lambda_m);
