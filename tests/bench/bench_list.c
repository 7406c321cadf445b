// bench_list.c - the benchmarks, in the order of the data's way.
#include "tests/bench/bench.h"
#include <stddef.h>

extern const struct bench bench_deconvolve;
extern const struct bench bench_tables;

const struct bench *const bench_list[] = {
    &bench_deconvolve,
    &bench_tables,
    NULL,
};
