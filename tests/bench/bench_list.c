// bench_list.c - the benchmarks, in the order of the data's way.
#include "tests/bench/bench.h"
#include <stddef.h>

extern const struct bench bench_acquire;
extern const struct bench bench_bokeh;
extern const struct bench bench_deconvolve;
extern const struct bench bench_calib;
extern const struct bench bench_hdr;
extern const struct bench bench_lut;
extern const struct bench bench_tables;
extern const struct bench bench_sim;
extern const struct bench bench_render;
extern const struct bench bench_kernels;
extern const struct bench bench_stability;
extern const struct bench bench_end_to_end;

extern const struct bench bench_environment;
const struct bench *const bench_list[] = {
    &bench_sim,         &bench_acquire, &bench_calib,      &bench_hdr,
    &bench_lut,         &bench_bokeh,   &bench_deconvolve, &bench_tables,
    &bench_environment, &bench_render,  &bench_end_to_end, &bench_kernels,
    &bench_stability,   NULL,
};
