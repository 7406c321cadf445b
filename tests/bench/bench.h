// bench.h - run time against error: one file per stage (bench_<name>.c), listed in bench_list.c.
//
// A benchmark measures settings of one stage; every row has a time AND an error. Times are the
// median of at least 5 runs after a warm-up (fewer when one run takes over 5 s; the row says how
// many); comparisons are ratios within one run. Reference data absent: bench_note() it and use own
// cases.
#pragma once
#include "core/err.h"
#include <stdbool.h>
#include <stdint.h>

struct bench_report; // collects rows and notes; prints the table, JSON, CSV and the plot

struct bench {
    const char *name, *summary;
    bool (*run)(struct bench_report *r, struct err *e);
};

extern const struct bench *const bench_list[]; // ends with NULL

struct bench_time {
    double wall_s, cpu_s, peak_mb;
    int runs;
};

// Runs fn(ctx) once to warm up, then 5 times or more; false as soon as fn fails.
bool bench_measure(bool (*fn)(void *ctx, struct err *e), void *ctx, struct bench_time *t,
                   struct err *e);

// One row: "exact", "2048 nodes, tol 1e-3"; the error's kind ("relative L2 against truth.csv").
void bench_row(struct bench_report *r, const char *method, const char *setting, struct bench_time t,
               double error, const char *error_kind);
// What the rows from now on have to do: times and errors are compared within one task and one kind
// of error. NULL: nothing special. Ends with the stage.
void bench_task(struct bench_report *r, const char *task);
// The row just added is what a user gets without asking: it must lie on the Pareto front of the
// rows with its task and kind of error, else a note says what dominates it.
void bench_default(struct bench_report *r);
// The row just added is what a user gets without asking: it must lie on the Pareto front of the
// rows with its kind of error, else a note says what beats it.
void bench_default(struct bench_report *r);
// How a method's time grows with its size n: points of one method in a row make a curve of their
// own plot, beside the n^2 log n that starts where it starts.
void bench_growth(struct bench_report *r, const char *method, double n, double wall_s);
// The exponent of a method's growth so far, beside the expected one; a note when they are more than
// 0.3 apart.
void bench_exponent(struct bench_report *r, const char *method, double expected);
// The exponent of a method's growth so far, beside the expected one; a note when they are more than
// 0.3 apart.
void bench_exponent(struct bench_report *r, const char *method, double expected);
// A named figure that is not a row ("ratio floor/exact", 4.7, "times").
void bench_figure(struct bench_report *r, const char *what, double value, const char *unit);
void bench_note(struct bench_report *r, const char *fmt, ...) __attribute__((format(printf, 2, 3)));
bool bench_quick(
    const struct bench_report *r); // smaller sizes, fewer settings: under 10 s per stage
long bench_count(const struct bench_report *r);    // --count: 0 when not given
uint64_t bench_seed(const struct bench_report *r); // --seed

const char *bench_shared(const char *path); // path below the reference data, or NULL when absent
