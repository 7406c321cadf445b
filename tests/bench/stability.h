// stability.h - functions under arguments from the ends of the number line, held against long
// double.
//
// A probe draws its arguments log-uniformly between its limits, denormals, ends, zeros and equal
// arguments among them, evaluates a function and tells its error; a result that is NaN or infinite
// is an error of NAN. Everything is by counter: the same seed gives the same arguments.
#pragma once
#include <stdbool.h>
#include <stdint.h>

enum { STABILITY_ARGS = 8 };

enum stability_kind {
    AT_LOG,    // lo..hi, both above 0, uniform in the logarithm
    AT_SIGNED, // the same with either sign, or 0
    AT_UNIT,   // 0..1, its neighbourhoods of 0 and 1 as likely as the rest
    AT_COUNT,  // a whole number lo..hi, uniform in the logarithm
};

struct stability_arg {
    enum stability_kind kind;
    double lo, hi;
};

struct stability_probe {
    const char *name;
    double bound;     // of the error
    const char *unit; // what it is relative to
    int cost;         // evaluations that one of the cheapest functions makes in the same time
    double (*error)(const double *x, uint64_t seed);
    struct stability_arg arg[STABILITY_ARGS]; // lo 0 and hi 0: no more
};

extern const struct stability_probe stability_core[], stability_process[], stability_fields[],
    stability_render[]; // each ends with a zeroed one

struct stability_result {
    const struct stability_probe *probe;
    long evaluations, not_finite, broken;
    double worst; // error
    double at[STABILITY_ARGS];
    uint64_t seed;               // of that evaluation: what arrays were filled with
    double flaw[STABILITY_ARGS]; // arguments of the first evaluation that was not finite
    uint64_t flaw_seed;
};

int stability_count(void);
// All probes with `count` evaluations together or more; result[stability_count()].
void stability_run(long count, uint64_t seed, struct stability_result *result);
// One evaluation again.
double stability_once(const struct stability_result *r);

int stability_args(const struct stability_probe *p);
// "u = 1e-300, v = 0": the arguments for a message; returns buf.
char *stability_text(const struct stability_probe *p, const double *at, char *buf, int size);

// |got - want| / scale; NAN when got is not finite. 0 / 0 is 0.
double stability_off(double got, long double want, long double scale);
// The larger of two errors; NAN wins.
double stability_worse(double a, double b);
// Standard normal samples.
void stability_noise(uint64_t seed, int n, double *out);
