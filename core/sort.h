// sort.h - numbers in rising order, for medians and percentiles. NAN has no place: leave it out
// before.
#pragma once
#include <stddef.h>

void sort_floats(float *v, size_t n);
void sort_doubles(double *v, size_t n);

// `most` samples of v[n], evenly spaced, or all when they are fewer, sorted into probe: how many.
size_t sorted_probe(const float *v, size_t n, float *probe, size_t most);
