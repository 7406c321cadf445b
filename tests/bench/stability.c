// stability.c - draws arguments, runs probes, keeps the worst.
#define _GNU_SOURCE
#include "tests/bench/stability.h"
#include "sim/rng.h"
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

static const struct stability_probe *const lists[] = {stability_core, stability_process,
                                                      stability_fields, stability_render};
enum { LISTS = sizeof lists / sizeof *lists };

double stability_off(double got, long double want, long double scale)
{
    if (!isfinite(got))
        return NAN;
    const long double d = fabsl((long double)got - want);
    return d > 0 ? (double)(d / scale) : 0;
}

double stability_worse(double a, double b)
{
    return isnan(a) || isnan(b) ? NAN : fmax(a, b);
}

void stability_noise(uint64_t seed, int n, double *out)
{
    struct rng r = rng_at(seed, 1, 0);
    for (int k = 0; k < n; k++)
        out[k] = rng_normal(&r);
}

int stability_args(const struct stability_probe *p)
{
    int n = 0;
    while (n < STABILITY_ARGS && p->arg[n].hi > 0)
        n++;
    return n;
}

static double log_uniform(struct rng *r, double lo, double hi)
{
    const double x = exp(log(lo) + rng_uniform(r) * (log(hi) - log(lo)));
    return fmax(lo, fmin(hi, x));
}

static double near_ends(struct rng *r)
{
    const double x = rng_uniform(r);
    switch (rng_word(r) % 8) {
    case 0: return log_uniform(r, 1e-320, 1);
    case 1: return 1 - log_uniform(r, 1e-16, 1);
    case 2: return 0;
    case 3: return 1;
    default: return x;
    }
}

static double draw_one(struct rng *r, const struct stability_arg *a, const double *before, int k)
{
    if (a->kind == AT_UNIT)
        return near_ends(r);
    if (a->kind == AT_COUNT)
        return floor(log_uniform(r, a->lo, a->hi + 0.999));
    const uint32_t special = rng_word(r) % 24;
    double x = log_uniform(r, a->lo, a->hi);
    if (special == 0)
        x = a->lo;
    else if (special == 1)
        x = a->hi;
    else if (special == 2 && a->lo <= 1 && a->hi >= 1)
        x = 1;
    else if (special == 3 && k > 0 && before[k - 1] >= a->lo && before[k - 1] <= a->hi)
        x = before[k - 1];
    else if (special == 4 && k > 0 && before[k - 1] >= a->lo && before[k - 1] < a->hi)
        x = nextafter(before[k - 1], a->hi);
    else if (special == 5 && a->kind == AT_SIGNED)
        x = 0;
    return a->kind == AT_SIGNED && rng_word(r) % 2 ? -x : x;
}

static void draw(const struct stability_probe *p, uint64_t seed, double *x)
{
    struct rng r = rng_at(seed, 0, 0);
    const int n = stability_args(p);
    for (int k = 0; k < n; k++)
        x[k] = draw_one(&r, &p->arg[k], x, k);
}

static void run_probe(const struct stability_probe *p, long count, uint64_t seed,
                      struct stability_result *out)
{
    struct stability_result r = {.probe = p, .evaluations = count};
    for (long k = 0; k < count; k++) {
        const uint64_t one = seed + (uint64_t)k;
        double x[STABILITY_ARGS] = {0};
        draw(p, one, x);
        const double error = p->error(x, one);
        if (!isfinite(error) && !r.not_finite++) {
            memcpy(r.flaw, x, sizeof x);
            r.flaw_seed = one;
        }
        r.broken += error > p->bound;
        if (error > r.worst) {
            r.worst = error;
            memcpy(r.at, x, sizeof x);
            r.seed = one;
        }
    }
    *out = r;
}

int stability_count(void)
{
    int n = 0;
    for (int k = 0; k < LISTS; k++)
        for (const struct stability_probe *p = lists[k]; p->name; p++)
            n++;
    return n;
}

double stability_once(const struct stability_result *r)
{
    return r->probe->error(r->at, r->seed);
}

void stability_run(long count, uint64_t seed, struct stability_result *result)
{
    const struct stability_probe *probe[256];
    double shares = 0;
    int n = 0;
    for (int k = 0; k < LISTS; k++)
        for (const struct stability_probe *p = lists[k]; p->name; p++) {
            probe[n++] = p;
            shares += 1.0 / p->cost;
        }
#pragma omp parallel for schedule(dynamic, 1)
    for (int k = 0; k < n; k++) {
        const long mine = 1 + (long)ceil((double)count / shares / probe[k]->cost);
        run_probe(probe[k], mine, (seed * 1000 + (uint64_t)k) << 32, &result[k]);
    }
}

char *stability_text(const struct stability_probe *p, const double *at, char *buf, int size)
{
    int used = 0;
    *buf = 0;
    for (int k = 0; k < stability_args(p) && used < size; k++)
        used += snprintf(buf + used, (size_t)(size - used), "%s%.17g", k ? ", " : "", at[k]);
    return buf;
}
