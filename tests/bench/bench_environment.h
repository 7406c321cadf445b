// bench_environment.h - parts of the benchmark `environment` with files of their own.
#pragma once
#include "core/table.h"
#include "process/environment.h"
#include "tests/bench/bench.h"

// Exact against direct in 100 frames, and sample and environment turned together.
bool bench_frames(struct bench_report *r, const struct table *t, const struct environment *env,
                  struct err *e);

// Separable rank 1 on one core: the passes of the processor beside the same shader on llvmpipe.
bool bench_one_core(struct bench_report *r, struct err *e);

// Leading singular triplets of the table, seen obliquely by 2048 x 2048 nodes: ours, numpy's
// randomised, the whole of LAPACK.
bool bench_leading(struct bench_report *r, const struct table *t, struct err *e);
