// bench_front.c - judgements over rows and points: the Pareto front, defaults, exponents of growth.
#define _GNU_SOURCE
#include "core/mem.h"
#include "tests/bench/bench_report.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

void bench_task(struct bench_report *r, const char *task)
{
    free(r->task);
    r->task = task ? xstrdup(task) : NULL;
}

void bench_default(struct bench_report *r)
{
    r->row[r->n_rows - 1].is_default = true;
}

bool bench_comparable(const struct bench_row *a, const struct bench_row *b)
{
    return a->bench == b->bench && a->error > 0 && b->error > 0 && a->t.wall_s > 0 &&
           b->t.wall_s > 0 && !strcmp(a->error_kind, b->error_kind) && !strcmp(a->task, b->task);
}

// No worse in both, and `part` of the time or less.
static bool beats(const struct bench_row *a, const struct bench_row *b, double part)
{
    return a->error <= b->error && a->t.wall_s <= part * b->t.wall_s;
}

void bench_find_front(struct bench_report *r)
{
    for (int k = 0; k < r->n_rows; k++) {
        struct bench_row *w = &r->row[k];
        const struct bench_row *better = NULL;
        if (w->bench != r->now)
            continue;
        w->on_front = bench_comparable(w, w);
        for (int q = 0; q < r->n_rows; q++) {
            const struct bench_row *o = &r->row[q];
            if (q == k || !bench_comparable(w, o))
                continue;
            if (beats(o, w, 1) && !(beats(w, o, 1) && q > k))
                w->on_front = false;
            if (beats(o, w, 0.9)) // so much do times scatter
                better = o;
        }
        if (w->is_default && better)
            bench_note(r, "DEFAULT OFF THE FRONT: %s, %s is beaten by %s, %s", w->method,
                       w->setting, better->method, better->setting);
        else if (w->is_default)
            w->on_front = true;
    }
}

void bench_exponent(struct bench_report *r, const char *method, double expected)
{
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (int k = 0; k < r->n_points; k++) {
        const struct bench_point *p = &r->point[k];
        if (p->bench != r->now || strcmp(p->method, method))
            continue;
        const double a = log(p->n), b = log(p->wall_s);
        n++;
        x += a;
        y += b;
        xx += a * a;
        xy += a * b;
    }
    if (n < 2)
        return;
    const double slope = (n * xy - x * y) / (n * xx - x * x);
    char *what = xasprintf("%s: exponent of time against size, expected %.3g", method, expected);
    bench_figure(r, what, slope, "");
    free(what);
    if (fabs(slope - expected) > 0.3)
        bench_note(r, "%s: time grows with the power %.2f of the size, not %.3g", method, slope,
                   expected);
}
