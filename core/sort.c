// sort.c - qsort with the two orders that the program needs.
#include "core/sort.h"
#include <stdlib.h>

static int order_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static int order_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void sort_floats(float *v, size_t n)
{
    qsort(v, n, sizeof *v, order_floats);
}

void sort_doubles(double *v, size_t n)
{
    qsort(v, n, sizeof *v, order_doubles);
}

size_t sorted_probe(const float *v, size_t n, float *probe, size_t most)
{
    const size_t count = n < most ? n : most;
    for (size_t k = 0; k < count; k++)
        probe[k] = v[(size_t)((double)k / (double)count * (double)n)];
    sort_floats(probe, count);
    return count;
}
