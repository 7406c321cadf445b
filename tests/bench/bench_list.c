// bench_list.c - the benchmarks, in the order of the data's way.
#include "tests/bench/bench.h"
#include <stddef.h>

const struct bench *const bench_list[] = {
    NULL,
};
