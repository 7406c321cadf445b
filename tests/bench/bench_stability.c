// bench_stability.c - numeric functions at the ends of the number line: the worst error of each,
// and the arguments that make it.
#include "core/mem.h"
#include "tests/bench/bench.h"
#include "tests/bench/stability.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

struct job {
    const struct stability_result *r;
    long times;
};

static bool evaluate(void *ctx, struct err *e)
{
    const struct job *j = ctx;
    (void)e;
    for (long k = 0; k < j->times; k++)
        stability_once(j->r);
    return true;
}

static bool tell(struct bench_report *r, const struct stability_result *w, struct err *e)
{
    char text[220], at[300];
    struct job job = {w, 1000 / w->probe->cost + 1};
    struct bench_time t;
    if (!bench_measure(evaluate, &job, &t, e))
        return false;
    snprintf(text, sizeof text, "%ld times, bound %.0e", w->evaluations, w->probe->bound);
    bench_row(r, w->probe->name, text, t, w->worst, w->probe->unit);
    if (w->not_finite)
        bench_note(r, "%s: NOT FINITE %ld times, first at (%s)", w->probe->name, w->not_finite,
                   stability_text(w->probe, w->flaw, at, sizeof at));
    if (w->broken)
        bench_note(r, "%s: BEYOND ITS BOUND %ld times", w->probe->name, w->broken);
    bench_note(r, "%s: worst at (%s)", w->probe->name,
               stability_text(w->probe, w->at, at, sizeof at));
    return true;
}

static bool run(struct bench_report *r, struct err *e)
{
    const int n = stability_count();
    const long count = bench_count(r) ? bench_count(r) : bench_quick(r) ? 100000 : 2000000;
    struct stability_result *w = xcalloc((size_t)n, sizeof *w);
    long all = 0, bad = 0;
    bool ok = true;
    stability_run(count, bench_seed(r), w);
    for (int k = 0; ok && k < n; k++) {
        ok = tell(r, &w[k], e);
        all += w[k].evaluations;
        bad += w[k].not_finite + w[k].broken;
    }
    bench_figure(r, "functions", n, "");
    bench_figure(r, "evaluations", (double)all, "");
    bench_figure(r, "not finite, or beyond the bound", (double)bad, "");
    free(w);
    if (ok && bad)
        ok = err_set(e, ERR_DATA, "%ld of %ld evaluations are not finite or beyond their bound",
                     bad, all);
    return ok;
}

extern const struct bench bench_stability;
const struct bench bench_stability = {
    .name = "stability",
    .summary = "functions at extreme arguments against long double",
    .run = run,
};
