// bench_report.c - rows of time and error, measured, printed and kept as JSON.
#define _GNU_SOURCE
#include "tests/bench/bench_report.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/sort.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

struct bench_report *bench_report_new(bool quick, long count, uint64_t seed)
{
    struct bench_report *r = xcalloc(1, sizeof *r);
    r->quick = quick;
    r->count = count;
    r->seed = seed;
    return r;
}

void bench_report_free(struct bench_report *r)
{
    if (!r)
        return;
    for (int k = 0; k < r->n_rows; k++) {
        free(r->row[k].method);
        free(r->row[k].setting);
        free(r->row[k].error_kind);
        free(r->row[k].task);
    }
    for (int k = 0; k < r->n_lines; k++) {
        free(r->line[k].text);
        free(r->line[k].unit);
    }
    for (int k = 0; k < r->n_points; k++)
        free(r->point[k].method);
    free(r->point);
    free(r->row);
    free(r->task);
    free(r->line);
    free(r);
}

bool bench_quick(const struct bench_report *r)
{
    return r->quick;
}

long bench_count(const struct bench_report *r)
{
    return r->count;
}

uint64_t bench_seed(const struct bench_report *r)
{
    return r->seed;
}

static double cpu_now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

// Starts a new high-water mark where the kernel allows it; else the peak is that of the process.
static void reset_peak(void)
{
    FILE *f = fopen("/proc/self/clear_refs", "w");
    if (!f)
        return;
    fputs("5", f);
    fclose(f);
}

static double peak_mb(void)
{
    FILE *f = fopen("/proc/self/status", "r");
    char text[200];
    long kb = 0;
    while (f && fgets(text, sizeof text, f))
        if (sscanf(text, "VmHWM: %ld", &kb) == 1)
            break;
    if (f)
        fclose(f);
    return (double)kb * 1024e-6;
}

bool bench_measure(bool (*fn)(void *ctx, struct err *e), void *ctx, struct bench_time *t,
                   struct err *e)
{
    enum { MOST = 25 };
    double wall[MOST], cpu[MOST];
    reset_peak();
    double start = now_s();
    if (!fn(ctx, e))
        return false;
    const double first = now_s() - start;
    const int runs = first > 5 ? 1 : first > 1 ? 3 : first > 0.05 ? 5 : 15;
    for (int k = 0; k < runs; k++) {
        const double cpu_start = cpu_now_s();
        start = now_s();
        if (!fn(ctx, e))
            return false;
        wall[k] = now_s() - start;
        cpu[k] = cpu_now_s() - cpu_start;
    }
    sort_doubles(wall, (size_t)runs);
    sort_doubles(cpu, (size_t)runs);
    *t = (struct bench_time){wall[runs / 2], cpu[runs / 2], peak_mb(), runs};
    return true;
}

void bench_row(struct bench_report *r, const char *method, const char *setting, struct bench_time t,
               double error, const char *error_kind)
{
    r->row = xrealloc(r->row, (size_t)r->n_rows + 1, sizeof *r->row);
    r->row[r->n_rows++] = (struct bench_row){.bench = r->now,
                                             .method = xstrdup(method),
                                             .setting = xstrdup(setting),
                                             .error_kind = xstrdup(error_kind),
                                             .task = xstrdup(r->task ? r->task : ""),
                                             .t = t,
                                             .error = error};
}

static void add_line(struct bench_report *r, char *text, char *unit, double value)
{
    r->line = xrealloc(r->line, (size_t)r->n_lines + 1, sizeof *r->line);
    r->line[r->n_lines++] = (struct bench_line){r->now, text, unit, value};
}

void bench_figure(struct bench_report *r, const char *what, double value, const char *unit)
{
    add_line(r, xstrdup(what), xstrdup(unit), value);
}

void bench_growth(struct bench_report *r, const char *method, double n, double wall_s)
{
    r->point = xrealloc(r->point, (size_t)r->n_points + 1, sizeof *r->point);
    r->point[r->n_points++] = (struct bench_point){r->now, xstrdup(method), n, wall_s};
}

void bench_note(struct bench_report *r, const char *fmt, ...)
{
    char text[500];
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(text, sizeof text, fmt, ap);
    va_end(ap);
    add_line(r, xstrdup(text), NULL, 0);
}

void bench_report_begin(struct bench_report *r, const struct bench *b)
{
    r->now = b;
    bench_task(r, NULL);
    log_note("%s - %s", b->name, b->summary);
}

static int max(int a, int b)
{
    return a > b ? a : b;
}

void bench_report_end(struct bench_report *r)
{
    int wide = 6, wider = 7; // the titles
    for (int k = 0; k < r->n_rows; k++)
        if (r->row[k].bench == r->now) {
            wide = max(wide, (int)strlen(r->row[k].method));
            wider = max(wider, (int)strlen(r->row[k].setting));
        }
    bench_find_front(r);
    bool titled = false;
    for (int k = 0; k < r->n_rows; k++) {
        const struct bench_row *w = &r->row[k];
        if (w->bench != r->now)
            continue;
        if (!titled)
            log_note("  %-*s  %-*s %10s %10s %8s %9s  %s", wide, "method", wider, "setting",
                     "wall ms", "cpu ms", "MB", "error", "of");
        titled = true;
        log_note("%c%c%-*s  %-*s %10.4g %10.4g %8.4g %9.2e  %s", w->on_front ? '*' : ' ',
                 w->is_default ? '>' : ' ', wide, w->method, wider, w->setting, w->t.wall_s * 1e3,
                 w->t.cpu_s * 1e3, w->t.peak_mb, w->error, w->error_kind);
    }
    for (int k = 0; k < r->n_lines; k++) {
        const struct bench_line *l = &r->line[k];
        if (l->bench == r->now && l->unit)
            log_note("  %s: %.4g %s", l->text, l->value, l->unit);
        else if (l->bench == r->now)
            log_note("  %s", l->text);
    }
    log_note(" ");
}

void bench_report_doc(const struct bench_report *r, struct doc *d)
{
    doc_bool(d, "quick", r->quick);
    for (int k = 0; k < r->n_rows; k++) {
        const struct bench_row *w = &r->row[k];
        struct doc *item = doc_item(d, "rows");
        doc_text(item, "stage", w->bench->name);
        doc_text(item, "method", w->method);
        doc_text(item, "setting", w->setting);
        doc_num(item, "wall_s", w->t.wall_s);
        doc_num(item, "cpu_s", w->t.cpu_s);
        doc_num(item, "peak_mb", w->t.peak_mb);
        doc_int(item, "runs", w->t.runs);
        doc_num(item, "error", w->error);
        doc_text(item, "error_kind", w->error_kind);
        doc_bool(item, "front", w->on_front);
        doc_bool(item, "default", w->is_default);
    }
    for (int k = 0; k < r->n_lines; k++) {
        const struct bench_line *l = &r->line[k];
        struct doc *item = doc_item(d, l->unit ? "figures" : "notes");
        doc_text(item, "stage", l->bench->name);
        doc_text(item, l->unit ? "what" : "text", l->text);
        if (l->unit) {
            doc_num(item, "value", l->value);
            doc_text(item, "unit", l->unit);
        }
    }
}

const char *bench_shared(const char *path)
{
    static char full[8][1024];
    static int turn;
    char *p = full[turn++ % 8];
    snprintf(p, sizeof full[0], "%s/%s", SHARED_DIR, path);
    return access(p, R_OK) ? NULL : p;
}
