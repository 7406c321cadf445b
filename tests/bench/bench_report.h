// bench_report.h - collected rows of all benchmarks, and how they are shown.
#pragma once
#include "tests/bench/bench.h"
#include "ui/cli.h"

struct bench_row {
    const struct bench *bench;
    char *method, *setting, *error_kind, *task; // task: "" for none
    struct bench_time t;
    double error;
    bool is_default, on_front; // of the rows with this kind of error nothing is as fast and as good
};

struct bench_line { // a note, or a figure when unit is set
    const struct bench *bench;
    char *text, *unit;
    double value;
};

struct bench_point { // of a method's growth
    const struct bench *bench;
    char *method;
    double n, wall_s;
};

struct bench_report {
    bool quick;
    long count; // 0: not given
    uint64_t seed;
    const struct bench *now;
    char *task; // of the rows to come; NULL: none
    struct bench_row *row;
    struct bench_line *line;
    struct bench_point *point;
    int n_rows, n_lines, n_points;
};

struct bench_report *bench_report_new(bool quick, long count, uint64_t seed);
void bench_report_free(struct bench_report *r); // accepts NULL

void bench_report_begin(struct bench_report *r,
                        const struct bench *b); // the rows that follow are its
void bench_report_end(struct bench_report *r);  // prints the stage's table on stderr

// Marks what lies on the front, of the stage that ends; notes defaults that do not.
void bench_find_front(struct bench_report *r);
// Do their times and errors compare?
bool bench_comparable(const struct bench_row *a, const struct bench_row *b);

void bench_report_doc(const struct bench_report *r, struct doc *d);
// bench.csv, bench.json, a page, and where gnuplot is installed its plots: time against error for
// each stage and kind of error that several rows have.
bool bench_report_write(const struct bench_report *r, const char *folder, struct err *e);
