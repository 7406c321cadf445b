// sort.h - numbers in rising order, for medians and percentiles. NAN has no place: leave it out
// before.
#pragma once
#include <stddef.h>

void sort_floats(float *v, size_t n);
void sort_doubles(double *v, size_t n);
