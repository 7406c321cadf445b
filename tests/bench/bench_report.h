// bench_report.h - collected rows of all benchmarks, and how they are shown.
#pragma once
#include "tests/bench/bench.h"
#include "ui/cli.h"

struct bench_report *bench_report_new(bool quick);
void bench_report_free(struct bench_report *r); // accepts NULL

void bench_report_begin(struct bench_report *r,
                        const struct bench *b); // the rows that follow are its
void bench_report_end(struct bench_report *r);  // prints the stage's table on stderr

void bench_report_doc(const struct bench_report *r, struct doc *d);
// bench.json, bench.csv, and where gnuplot is installed one plot of time against error per stage
// and a page.
bool bench_report_write(const struct bench_report *r, const char *folder, struct err *e);
