// bench_page.c - rows of time and error as CSV and as a page with plots, drawn by gnuplot.
#define _GNU_SOURCE
#include "core/mem.h"
#include "core/outfile.h"
#include "tests/bench/bench_report.h"
#include "ui/doc.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static bool write_csv(const struct bench_report *r, const char *path, struct err *e)
{
    char *text = NULL;
    size_t size = 0;
    FILE *f = open_memstream(&text, &size);
    fputs("stage,method,setting,wall_s,cpu_s,peak_mb,runs,error,error_kind\n", f);
    for (int k = 0; k < r->n_rows; k++) {
        const struct bench_row *w = &r->row[k];
        fprintf(f, "%s,%s,\"%s\",%.6g,%.6g,%.4g,%d,%.6g,\"%s\"\n", w->bench->name, w->method,
                w->setting, w->t.wall_s, w->t.cpu_s, w->t.peak_mb, w->t.runs, w->error,
                w->error_kind);
    }
    fclose(f);
    const bool ok = outfile_write(path, text, size, e);
    free(text);
    return ok;
}

static bool write_json(const struct bench_report *r, const char *path, struct err *e)
{
    char *text = NULL;
    size_t size = 0;
    FILE *f = open_memstream(&text, &size);
    struct doc *d = doc_new();
    bench_report_doc(r, d);
    doc_print(d, true, f);
    doc_free(d);
    fclose(f);
    const bool ok = outfile_write(path, text, size, e);
    free(text);
    return ok;
}

// The row that begins plot number `nth` of a stage: one plot for each kind of error that several
// rows have. NULL when there are no more.
static const struct bench_row *plotted(const struct bench_report *r, const struct bench *b, int nth)
{
    for (int k = 0; k < r->n_rows; k++) {
        const struct bench_row *w = &r->row[k];
        int before = 0, rows = 0;
        for (int q = 0; q < r->n_rows; q++) {
            const struct bench_row *v = &r->row[q];
            const bool same = v->bench == b && !strcmp(v->error_kind, w->error_kind);
            before += same && q < k;
            rows += same && v->error > 0;
        }
        if (w->bench == b && !before && rows > 1 && !nth--)
            return w;
    }
    return NULL;
}

static char *plot_name(const struct bench *b, int nth)
{
    return nth ? xasprintf("%s-%d.svg", b->name, nth + 1) : xasprintf("%s.svg", b->name);
}

// What is last in a setting stands at its point.
static const char *label(const struct bench_row *w)
{
    enum { LONGEST = 16 };
    const char *comma = strrchr(w->setting, ','), *text = comma ? comma + 2 : w->setting;
    return strlen(text) <= LONGEST ? text : "";
}

// The rows of one method that share an error as a gnuplot data block: time in ms against error.
static void plot_data(const struct bench_report *r, const struct bench_row *first, FILE *to,
                      FILE *plots)
{
    static const int shape[] = {7, 5, 9, 13}; // filled: disc, square, triangle, diamond
    int methods = 0;
    for (int k = 0; k < r->n_rows; k++) {
        const struct bench_row *w = &r->row[k];
        bool seen = w->bench != first->bench || strcmp(w->error_kind, first->error_kind) != 0;
        for (int p = 0; p < k && !seen; p++)
            seen = r->row[p].bench == w->bench && !strcmp(r->row[p].method, w->method) &&
                   !strcmp(r->row[p].error_kind, w->error_kind);
        if (seen)
            continue;
        int count = 0;
        fprintf(to, "$d%d << EOD\n", k);
        for (int q = k; q < r->n_rows; q++) {
            const struct bench_row *v = &r->row[q];
            if (v->bench == w->bench && !strcmp(v->method, w->method) &&
                !strcmp(v->error_kind, w->error_kind) && v->error > 0) {
                fprintf(to, "%g %g \"%s\"\n", v->t.wall_s * 1e3, v->error, label(v));
                count++;
            }
        }
        fputs("EOD\n", to);
        if (count)
            fprintf(
                plots,
                "%s$d%d using 1:2 with points pt %d ps 1 lc %d title \"%s\", $d%d using 1:2:3 with "
                "labels left rotate by 30 offset 0.5,0.4 font ',9' tc '#555555' notitle",
                ftell(plots) ? ", " : "plot ", k, shape[methods % 4], 1 + methods, w->method, k);
        methods += count > 0;
    }
}

// The next of the front of a row's task and kind of error, in rising time.
static const struct bench_row *front_after(const struct bench_report *r, const struct bench_row *w,
                                           double time_s)
{
    const struct bench_row *next = NULL;
    for (int k = 0; k < r->n_rows; k++) {
        const struct bench_row *o = &r->row[k];
        if (o->on_front && bench_comparable(o, w) && o->t.wall_s > time_s &&
            (!next || o->t.wall_s < next->t.wall_s))
            next = o;
    }
    return next;
}

// The front of every task as a line, defaults as rings around their points.
static void plot_front(const struct bench_report *r, const struct bench_row *first, FILE *to,
                       FILE *plots)
{
    bool rings = false;
    fputs("$front << EOD\n", to);
    for (int k = 0; k < r->n_rows; k++) {
        const struct bench_row *w = &r->row[k];
        bool seen = w->bench != first->bench || strcmp(w->error_kind, first->error_kind) != 0;
        for (int p = 0; p < k && !seen; p++)
            seen = bench_comparable(w, &r->row[p]);
        if (seen)
            continue;
        for (const struct bench_row *f = front_after(r, w, 0); f;
             f = front_after(r, w, f->t.wall_s))
            fprintf(to, "%g %g\n", f->t.wall_s * 1e3, f->error);
        fputs("\n", to);
    }
    fputs("EOD\n$default << EOD\n", to);
    for (int k = 0; k < r->n_rows; k++) {
        const struct bench_row *w = &r->row[k];
        if (w->is_default && w->bench == first->bench && w->error > 0 &&
            !strcmp(w->error_kind, first->error_kind)) {
            fprintf(to, "%g %g\n", w->t.wall_s * 1e3, w->error);
            rings = true;
        }
    }
    fputs("EOD\n", to);
    fprintf(plots, ", $front with lines lc '#888888' dt 3 title 'Pareto front'%s",
            rings ? ", $default with points pt 6 ps 2.4 lw 2 lc '#222222' title 'default'" : "");
}

static bool plot_stage(const struct bench_report *r, const struct bench *b, int nth,
                       const char *folder)
{
    const struct bench_row *first = plotted(r, b, nth);
    FILE *gp = first ? popen("gnuplot 2>/dev/null", "w") : NULL;
    if (!gp)
        return false;
    char *plots = NULL, *name = plot_name(b, nth);
    size_t size;
    FILE *to = open_memstream(&plots, &size);
    plot_data(r, first, gp, to);
    plot_front(r, first, gp, to);
    fclose(to);
    fprintf(gp,
            "set terminal svg size 860,520 font 'sans,13' background '#ffffff'\n"
            "set output '%s/%s'\nset title '%s: %s' noenhanced\nset logscale xy\n"
            "set format '10^{%%L}'\nset xlabel 'time, ms'\nset ylabel '%s' noenhanced\n"
            "set grid lc '#dddddd'\nset colors podo\nset offsets graph .05, graph .25, graph .05, "
            "graph .05\n"
            "set key outside right noenhanced\nset border lc '#555555'\n%s\n",
            folder, name, b->name, b->summary, first->error_kind, plots);
    free(name);
    free(plots);
    return !pclose(gp);
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
    const struct bench_point *first = NULL, *before = NULL;
    for (int k = 0; k < r->n_points; k++) {
        const struct bench_point *p = &r->point[k];
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

static void page_stage(const struct bench_report *r, const struct bench *b, const char *folder,
                       FILE *f)
{
    fprintf(f, "<h2>%s</h2><p>%s</p>", b->name, b->summary);
    for (int k = 0; plot_stage(r, b, k, folder); k++) {
        char *name = plot_name(b, k);
        fprintf(f, "<img src=\"%s\" alt=\"time against error\">", name);
        free(name);
    }
    if (plot_growth(r, b, folder))
        fprintf(f, "<img src=\"%s-growth.svg\" alt=\"time against size\">", b->name);
    fputs("<table><tr><th>method<th>setting<th>wall, ms<th>CPU, ms<th>peak, MB<th>error<th>of</tr>",
          f);
    for (int k = 0; k < r->n_rows; k++) {
        const struct bench_row *w = &r->row[k];
        if (w->bench == b)
            fprintf(f, "<tr%s><td>%s%s<td>%s<td>%.4g<td>%.4g<td>%.4g<td>%.2e<td>%s</tr>",
                    w->on_front ? " class=front" : "", w->method, w->is_default ? " (default)" : "",
                    w->setting, w->t.wall_s * 1e3, w->t.cpu_s * 1e3, w->t.peak_mb, w->error,
                    w->error_kind);
    }
    fputs("</table>", f);
    for (int k = 0; k < r->n_lines; k++) {
        const struct bench_line *l = &r->line[k];
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
    char *json = xasprintf("%s/bench.json", folder);
    bool ok = write_csv(r, csv, e) && write_json(r, json, e);
    free(json);
    char *text = NULL;
    size_t size = 0;
    FILE *f = open_memstream(&text, &size);
    fputs("<!doctype html><meta charset=utf-8><title>nacre bench</title><style>body{font:15px/1.5 "
          "sans-serif;"
          "max-width:70em;margin:2em auto;padding:0 1em;color:#222}table{border-collapse:collapse}"
          ".front{font-weight:600}td,th{padding:.2em .8em;text-align:left;border-bottom:1px solid "
          "#ddd}</style><h1>Run "
          "time against error</h1><p>Bold: on the Pareto front of the rows with that error.</p>",
          f);
    const struct bench *last = NULL;
    for (int k = 0; ok && k < r->n_rows; k++)
        if (r->row[k].bench != last) {
            last = r->row[k].bench;
            page_stage(r, last, folder, f);
        }
    fclose(f);
    ok = ok && outfile_write(page, text, size, e);
    free(text);
    free(csv);
    free(page);
    return ok;
}
