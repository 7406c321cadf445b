// bench_report.c - rows of time and error, printed, kept as JSON and CSV, and plotted by gnuplot.
#define _GNU_SOURCE
#include "tests/bench/bench_report.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/outfile.h"
#include "core/sort.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

struct row {
    const struct bench *bench;
    char *method, *setting, *error_kind;
    struct bench_time t;
    double error;
};

struct line { // a note, or a figure when unit is set
    const struct bench *bench;
    char *text, *unit;
    double value;
};

struct point { // of a method's growth
    const struct bench *bench;
    char *method;
    double n, wall_s;
};

struct bench_report {
    bool quick;
    const struct bench *now;
    struct row *row;
    struct line *line;
    struct point *point;
    int n_rows, n_lines, n_points;
};

struct bench_report *bench_report_new(bool quick)
{
    struct bench_report *r = xcalloc(1, sizeof *r);
    r->quick = quick;
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
    }
    for (int k = 0; k < r->n_lines; k++) {
        free(r->line[k].text);
        free(r->line[k].unit);
    }
    for (int k = 0; k < r->n_points; k++)
        free(r->point[k].method);
    free(r->point);
    free(r->row);
    free(r->line);
    free(r);
}

bool bench_quick(const struct bench_report *r)
{
    return r->quick;
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
    r->row[r->n_rows++] =
        (struct row){r->now, xstrdup(method), xstrdup(setting), xstrdup(error_kind), t, error};
}

static void add_line(struct bench_report *r, char *text, char *unit, double value)
{
    r->line = xrealloc(r->line, (size_t)r->n_lines + 1, sizeof *r->line);
    r->line[r->n_lines++] = (struct line){r->now, text, unit, value};
}

void bench_figure(struct bench_report *r, const char *what, double value, const char *unit)
{
    add_line(r, xstrdup(what), xstrdup(unit), value);
}

void bench_growth(struct bench_report *r, const char *method, double n, double wall_s)
{
    r->point = xrealloc(r->point, (size_t)r->n_points + 1, sizeof *r->point);
    r->point[r->n_points++] = (struct point){r->now, xstrdup(method), n, wall_s};
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
    bool titled = false;
    for (int k = 0; k < r->n_rows; k++) {
        const struct row *w = &r->row[k];
        if (w->bench != r->now)
            continue;
        if (!titled)
            log_note("  %-*s  %-*s %10s %10s %8s %9s  %s", wide, "method", wider, "setting",
                     "wall ms", "cpu ms", "MB", "error", "of");
        titled = true;
        log_note("  %-*s  %-*s %10.4g %10.4g %8.4g %9.2e  %s", wide, w->method, wider, w->setting,
                 w->t.wall_s * 1e3, w->t.cpu_s * 1e3, w->t.peak_mb, w->error, w->error_kind);
    }
    for (int k = 0; k < r->n_lines; k++) {
        const struct line *l = &r->line[k];
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
        const struct row *w = &r->row[k];
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
    }
    for (int k = 0; k < r->n_lines; k++) {
        const struct line *l = &r->line[k];
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

static bool write_csv(const struct bench_report *r, const char *path, struct err *e)
{
    char *text = NULL;
    size_t size = 0;
    FILE *f = open_memstream(&text, &size);
    fputs("stage,method,setting,wall_s,cpu_s,peak_mb,runs,error,error_kind\n", f);
    for (int k = 0; k < r->n_rows; k++) {
        const struct row *w = &r->row[k];
        fprintf(f, "%s,%s,\"%s\",%.6g,%.6g,%.4g,%d,%.6g,\"%s\"\n", w->bench->name, w->method,
                w->setting, w->t.wall_s, w->t.cpu_s, w->t.peak_mb, w->t.runs, w->error,
                w->error_kind);
    }
    fclose(f);
    const bool ok = outfile_write(path, text, size, e);
    free(text);
    return ok;
}

// One method's rows of a stage as a gnuplot data block: time in ms against error.
static bool plot_data(const struct bench_report *r, const struct bench *b, FILE *to, char *plots,
                      size_t room)
{
    bool any = false;
    for (int k = 0; k < r->n_rows; k++) {
        const struct row *w = &r->row[k];
        bool seen = w->bench != b;
        for (int p = 0; p < k && !seen; p++)
            seen = r->row[p].bench == b && !strcmp(r->row[p].method, w->method);
        if (seen)
            continue;
        fprintf(to, "$d%d << EOD\n", k);
        int count = 0;
        for (int q = k; q < r->n_rows; q++)
            if (r->row[q].bench == b && !strcmp(r->row[q].method, w->method) &&
                r->row[q].error > 0) {
                fprintf(to, "%g %g\n", r->row[q].t.wall_s * 1e3, r->row[q].error);
                count++;
            }
        fputs("EOD\n", to);
        if (!count)
            continue;
        const size_t used = strlen(plots);
        snprintf(plots + used, room - used, "%s$d%d using 1:2 with points pt 7 ps 1.4 title \"%s\"",
                 any ? ", " : "plot ", k, w->method);
        any = true;
    }
    return any;
}

static bool plot_stage(const struct bench_report *r, const struct bench *b, const char *folder)
{
    FILE *gp = popen("gnuplot 2>/dev/null", "w");
    if (!gp)
        return false;
    char plots[8000] = "";
    const bool any = plot_data(r, b, gp, plots, sizeof plots);
    if (any)
        fprintf(gp,
                "set terminal svg size 760,460 font 'sans,13' background '#ffffff'\n"
                "set output '%s/%s.svg'\nset title '%s: %s' noenhanced\nset logscale xy\n"
                "set format '10^{%%L}'\nset xlabel 'time, ms'\nset ylabel 'error'\nset grid lc "
                "'#dddddd'\n"
                "set key outside right noenhanced\nset border lc '#555555'\n%s\n",
                folder, b->name, b->name, b->summary, plots);
    return !pclose(gp) && any;
}

// Time against size, one curve a method, and n^2 log n from the start of the first.
static bool plot_growth(const struct bench_report *r, const struct bench *b, const char *folder)
{
    FILE *gp = popen("gnuplot 2>/dev/null", "w");
    if (!gp)
        return false;
    char *plots = NULL;
    size_t size;
    FILE *to = open_memstream(&plots, &size);
    const struct point *first = NULL, *before = NULL;
    for (int k = 0; k < r->n_points; k++) {
        const struct point *p = &r->point[k];
        if (p->bench != b)
            continue;
        if (!before || strcmp(before->method, p->method)) {
            if (before)
                fputs("EOD\n", gp);
            fprintf(gp, "$d%d << EOD\n", k);
            fprintf(to, "$d%d using 1:2 with linespoints pt 7 title \"%s\", ", k, p->method);
        }
        fprintf(gp, "%g %g\n", p->n, p->wall_s * 1e3);
        first = first ? first : p;
        before = p;
    }
    fclose(to);
    if (first)
        fprintf(gp,
                "EOD\nset terminal svg size 760,460 font 'sans,13' background '#ffffff'\n"
                "set output '%s/%s-growth.svg'\nset title '%s: time against size' noenhanced\n"
                "set logscale xy\nset format y '10^{%%L}'\nset xlabel 'nodes a side'\n"
                "set ylabel 'time, ms'\nset grid lc '#dddddd'\nset key left top\n"
                "plot %s%g*(x/%g)**2*log(x)/log(%g) dt 2 lc '#888888' title 'n^2 log n'\n",
                folder, b->name, b->name, plots, first->wall_s * 1e3, first->n, first->n);
    free(plots);
    return !pclose(gp) && first;
}

static void page_stage(const struct bench_report *r, const struct bench *b, bool plotted,
                       bool grows, FILE *f)
{
    fprintf(f, "<h2>%s</h2><p>%s</p>", b->name, b->summary);
    if (plotted)
        fprintf(f, "<img src=\"%s.svg\" alt=\"time against error\">", b->name);
    if (grows)
        fprintf(f, "<img src=\"%s-growth.svg\" alt=\"time against size\">", b->name);
    fputs("<table><tr><th>method<th>setting<th>wall, ms<th>CPU, ms<th>peak, MB<th>error<th>of</tr>",
          f);
    for (int k = 0; k < r->n_rows; k++) {
        const struct row *w = &r->row[k];
        if (w->bench == b)
            fprintf(f, "<tr><td>%s<td>%s<td>%.4g<td>%.4g<td>%.4g<td>%.2e<td>%s</tr>", w->method,
                    w->setting, w->t.wall_s * 1e3, w->t.cpu_s * 1e3, w->t.peak_mb, w->error,
                    w->error_kind);
    }
    fputs("</table>", f);
    for (int k = 0; k < r->n_lines; k++) {
        const struct line *l = &r->line[k];
        if (l->bench == b && l->unit)
            fprintf(f, "<p>%s: <b>%.4g</b> %s</p>", l->text, l->value, l->unit);
        else if (l->bench == b)
            fprintf(f, "<p>%s</p>", l->text);
    }
}

bool bench_report_write(const struct bench_report *r, const char *folder, struct err *e)
{
    if (mkdir(folder, 0777) && access(folder, W_OK))
        return err_errno(e, "%s", folder);
    char *csv = xasprintf("%s/bench.csv", folder), *page = xasprintf("%s/bench.html", folder);
    bool ok = write_csv(r, csv, e);
    char *text = NULL;
    size_t size = 0;
    FILE *f = open_memstream(&text, &size);
    fputs("<!doctype html><meta charset=utf-8><title>nacre bench</title><style>body{font:15px/1.5 "
          "sans-serif;"
          "max-width:70em;margin:2em auto;padding:0 1em;color:#222}table{border-collapse:collapse}"
          "td,th{padding:.2em .8em;text-align:left;border-bottom:1px solid #ddd}</style><h1>Run "
          "time against "
          "error</h1>",
          f);
    const struct bench *last = NULL;
    for (int k = 0; ok && k < r->n_rows; k++)
        if (r->row[k].bench != last) {
            last = r->row[k].bench;
            page_stage(r, last, plot_stage(r, last, folder), plot_growth(r, last, folder), f);
        }
    fclose(f);
    ok = ok && outfile_write(page, text, size, e);
    free(text);
    free(csv);
    free(page);
    return ok;
}
