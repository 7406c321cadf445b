// log.h - talk for a person, on stderr: notes, warnings and progress bars.
//
// Data never goes here. On a terminal a bar redraws in place; elsewhere it prints nothing until the
// end. Any thread may step a bar; start and end belong to one thread.
#pragma once
#include <stdbool.h>

extern bool log_quiet;    // --quiet: only errors
extern bool log_no_color; // --no-color or NO_COLOR

void log_note(const char *fmt, ...) __attribute__((format(printf, 1, 2)));
void log_warn(const char *fmt, ...) __attribute__((format(printf, 1, 2)));
void log_error(const char *fmt, ...) __attribute__((format(printf, 1, 2))); // "nacre: ..."

struct progress {
    const char *what; // "merging", not owned
    long total, done;
    double start_s, drawn_s;
};
void progress_start(struct progress *p, const char *what, long total);
void progress_step(struct progress *p, long by);
void progress_end(struct progress *p); // removes the bar

double now_s(void); // CLOCK_MONOTONIC, seconds: for timings
