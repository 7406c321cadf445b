// bench_lut.c - the table from a photograph: time and error per method, tolerance and size.
#define _GNU_SOURCE
#include "core/imgfile.h"
#include "core/log.h"
#include "core/mem.h"
#include "process/lut.h"
#include "process/table_spline.h"
#include "tests/bench/bench.h"
#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

// A pattern of 1000 x 1000 pixels and points of the plane where its table is known.
struct job {
    struct lut_pattern pattern;
    struct spectrum light;
    int points;
    double (*truth)[5]; // [points] u, v, X, Y, Z
    struct lut_request request;
    struct table table;
    struct lut_report report;
};

static bool read_reference(struct job *b, struct err *e)
{
    struct image im;
    FILE *f = fopen(bench_shared("reference/lut/truth.csv"), "r");
    if (!f)
        return err_errno(e, "truth.csv");
    char line[256];
    b->truth = xcalloc(10000, sizeof *b->truth);
    while (b->points < 10000 && fgets(line, sizeof line, f)) {
        double *t = b->truth[b->points];
        b->points += sscanf(line, "%lf,%lf,%lf,%lf,%lf", t, t + 1, t + 2, t + 3, t + 4) == 5;
    }
    fclose(f);
    if (!image_read(&im, bench_shared("reference/lut/pattern.pfm"), e))
        return false;
    const bool ok = lut_pattern_init(&b->pattern, &im, 0, 1, e);
    image_finish(&im);
    b->pattern.h_per_px = 0.0011248194656100288; // case.json
    b->pattern.cx = 502.436;
    b->pattern.cy = 488.689;
    return ok;
}

enum { PITCH = 25 }; // px

// A crossed grating of Gaussian lobes, sigma 2.2 px, at (x, y) px from the centre.
static double lobes(double x, double y)
{
    const double dx = x - PITCH * round(x / PITCH), dy = y - PITCH * round(y / PITCH);
    return exp(-(dx * dx + dy * dy) / (2 * 2.2 * 2.2)) / (1 + 1e-4 * (x * x + y * y));
}

static bool make_case(struct job *b, struct err *e)
{
    enum { SIDE = 1000, POINTS = 500 };
    struct image im;
    if (!image_init(&im, SIDE, SIDE, 1, e))
        return false;
    for (int k = 0; k < SIDE * SIDE; k++)
        im.px[k] = (float)lobes(k % SIDE - 500.3, k / SIDE - 490.7);
    const bool ok = lut_pattern_init(&b->pattern, &im, 0, 1, e);
    image_finish(&im);
    b->pattern.h_per_px = 1.1e-3;
    b->pattern.cx = 500.3;
    b->pattern.cy = 490.7;
    b->truth = xcalloc(POINTS, sizeof *b->truth);
    for (b->points = 0; b->points < POINTS; b->points++) {
        double *t = b->truth[b->points];
        t[0] = 0.3 * sin(1.7 * b->points);
        t[1] = 0.3 * sin(2.9 * b->points + 1);
        double luminance = 0;
        for (int nm10 = 3800; nm10 <= 7800; nm10 += 2) { // 0.2 nm
            const double ratio = 5200.0 / nm10, end = nm10 == 3800 || nm10 == 7800 ? 0.5 : 1;
            double cmf[3];
            cie_xyz(nm10 * 1e-10, cmf);
            luminance += end * cmf[1];
            for (int c = 0; c < 3; c++)
                t[2 + c] += end * cmf[c] * ratio * ratio *
                            lobes(t[0] * ratio / 1.1e-3, t[1] * ratio / 1.1e-3);
        }
        for (int c = 0; c < 3; c++)
            t[2 + c] /= 4 * M_PI * M_PI * luminance;
    }
    return ok;
}

static bool build(void *ctx, struct err *e)
{
    struct job *b = ctx;
    table_finish(&b->table);
    return lut_build(&b->request, &b->table, &b->report, e);
}

// Relative L2 error at the known points that the table holds; the largest over the peak in *worst.
static bool judge(const struct job *b, double *error, double *worst, struct err *e)
{
    struct table_spline s;
    double diff = 0, norm = 0, most = 0, peak = 0;
    if (!table_spline_init(&s, &b->table, e))
        return false;
    for (int k = 0; k < b->points; k++) {
        const double *t = b->truth[k];
        double got[3];
        if (fmax(fabs(t[0]), fabs(t[1])) > b->table.range * 0.98)
            continue;
        table_spline_at(&s, t[0], t[1], 2, 0, got);
        for (int c = 0; c < 3; c++) {
            const double d = got[c] - t[2 + c];
            diff += d * d;
            norm += t[2 + c] * t[2 + c];
            most = fmax(most, fabs(d));
            peak = fmax(peak, t[2 + c]);
        }
    }
    table_spline_finish(&s);
    *error = sqrt(diff / norm);
    *worst = most / peak;
    return true;
}

struct setting {
    enum lut_method method;
    int n, wavelengths;
    double tolerance;
};

static bool measure(struct bench_report *r, struct job *b, const struct setting *s, int threads,
                    struct bench_time *t, struct err *e) // threads 0: all
{
    char name[40], text[80];
    double error, worst;
    const int all = omp_get_max_threads();
    b->request.method = s->method;
    b->request.n = s->n;
    b->request.wavelengths = s->wavelengths;
    b->request.tolerance = s->tolerance;
    omp_set_num_threads(threads ? threads : all);
    const bool ok = bench_measure(build, b, t, e);
    omp_set_num_threads(all);
    if (!ok || !judge(b, &error, &worst, e))
        return false;
    if (s->method == LUT_SAMPLED)
        snprintf(name, sizeof name, "sampled, %d wavelengths", s->wavelengths);
    else
        snprintf(name, sizeof name, "%s", lut_method_name(s->method));
    const int used = snprintf(text, sizeof text, "%d nodes, %d thread%s", s->n,
                              threads ? threads : all, threads == 1 ? "" : "s");
    if (s->method == LUT_EXACT)
        snprintf(text + used, sizeof text - (size_t)used, ", tolerance %g", s->tolerance);
    char task[20];
    snprintf(task, sizeof task, "%d nodes", s->n);
    bench_task(r, task);
    bench_row(r, name, text, *t, error, "relative L2 against the known points");
    if (s->method == LUT_EXACT && s->tolerance == 1e-4 && !threads)
        bench_default(r);
    if (s->method == LUT_EXACT && s->n == 2048)
        bench_figure(r, "exact: largest error over the peak", worst, "");
    return true;
}

// The command itself, as a user runs it: wall time and peak memory of the process.
static bool run_process(struct bench_report *r, struct err *e)
{
    const char *pattern = bench_shared("reference/lut/pattern.pfm");
    double wall_s[5], peak_mb = 0;
    if (!pattern)
        return true;
    for (int k = 0; k < 5; k++) {
        const double start_s = now_s();
        const pid_t child = fork();
        if (child == 0) {
            if (!freopen("/dev/null", "w", stdout))
                _exit(126);
            execl("/proc/self/exe", "nacre", "lut", pattern, "--lambda", "520nm", "--h-per-pixel",
                  "0.0011248194656100288", "--center", "502.436,488.689", "--range", "0.35",
                  "--size", "2048", "--quiet", "-o", "/tmp/nacre-bench-lut.exr", (char *)NULL);
            _exit(127);
        }
        int status = 0;
        struct rusage use;
        if (child < 0 || wait4(child, &status, 0, &use) < 0 || status)
            return err_set(e, ERR_FILE, "nacre lut did not run");
        wall_s[k] = now_s() - start_s;
        peak_mb = fmax(peak_mb, (double)use.ru_maxrss / 1024);
        unlink("/tmp/nacre-bench-lut.exr");
    }
    for (int i = 1; i < 5; i++)
        for (int j = i; j > 0 && wall_s[j] < wall_s[j - 1]; j--) {
            const double swap = wall_s[j];
            wall_s[j] = wall_s[j - 1];
            wall_s[j - 1] = swap;
        }
    bench_figure(r, "process, pattern.pfm to 2048 x 2048 .exr: median wall", wall_s[2], "s");
    bench_figure(r, "the same: peak memory", peak_mb, "MB");
    return true;
}

static bool run(struct bench_report *r, struct err *e)
{
    static const struct setting methods[] = {
        {LUT_FLOOR, 512, 0, 1},        {LUT_SAMPLED, 512, 81, 1e-3}, {LUT_SAMPLED, 512, 161, 1e-3},
        {LUT_SAMPLED, 512, 401, 1e-4}, {LUT_EXACT, 512, 0, 1e-2},    {LUT_EXACT, 512, 0, 1e-3},
        {LUT_EXACT, 512, 0, 1e-4},     {LUT_EXACT, 512, 0, 1e-5},    {LUT_EXACT, 512, 0, 1e-6},
    };
    static const int sizes[] = {256, 512, 1024, 2048, 4096};
    const double authors_s = 44;
    struct job b = {0};
    struct bench_time t, exact, one, slow;
    bool ok =
        illuminant_get(&b.light, "E", e) &&
        (bench_shared("reference/lut/pattern.pfm") ? read_reference(&b, e) : make_case(&b, e));
    b.request = (struct lut_request){.pattern = &b.pattern,
                                     .lambda_m = 520e-9,
                                     .light = &b.light,
                                     .f0 = 1,
                                     .exponent = 2,
                                     .range = 0.35,
                                     .power = 1};
    if (!bench_shared("reference/lut/pattern.pfm"))
        bench_note(r, "no reference data: a crossed grating of lobes in closed form");
    for (size_t k = 0; ok && k < sizeof methods / sizeof *methods; k++)
        if (!bench_quick(r) || methods[k].method != LUT_SAMPLED)
            ok = measure(r, &b, &methods[k], methods[k].method == LUT_FLOOR, &t, e);
    for (int k = 0; ok && k < (bench_quick(r) ? 3 : 5); k++) {
        ok = measure(r, &b, &(struct setting){LUT_EXACT, sizes[k], 0, 1e-4}, 0, &t, e);
        bench_growth(r, "exact", sizes[k], t.wall_s);
    }
    bench_exponent(r, "exact", 2);
    if (ok && !bench_quick(r)) {
        const struct setting best = {LUT_EXACT, 2048, 0, 1e-4}, floor = {LUT_FLOOR, 2048, 0, 1};
        ok = measure(r, &b, &best, 0, &exact, e) && measure(r, &b, &floor, 1, &slow, e) &&
             measure(r, &b, &best, 1, &one, e) && run_process(r, e);
        if (ok) {
            bench_figure(r, "2048 nodes: floor / exact, one thread each", slow.wall_s / one.wall_s,
                         "times");
            bench_figure(r, "2048 nodes: floor (which has one thread) / exact on all",
                         slow.wall_s / exact.wall_s, "times");
            bench_figure(r, "2048 nodes, one thread: authors' program / exact",
                         authors_s / one.wall_s, "times");
            bench_note(r,
                       "The authors' program (github antoinetlc/realistic_diffraction) was timed "
                       "once, outside, on one core, for a 2048 x 2048 table of a 1000 x 1000 "
                       "pattern: %g s and 4.1 GB. Only our own code runs here.",
                       authors_s);
        }
    }
    table_finish(&b.table);
    lut_pattern_finish(&b.pattern);
    spectrum_finish(&b.light);
    free(b.truth);
    return ok;
}

const struct bench bench_lut = {"lut", "the diffraction table from a photograph", run};
