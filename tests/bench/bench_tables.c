// bench_tables.c - tables from height fields: time and error, bases, D14 beside us.
#define _GNU_SOURCE
#include "core/hfield_file.h"
#include "core/mem.h"
#include "process/direct.h"
#include "process/tables.h"
#include "tests/bench/bench.h"
#include "tests/bench/d14_peer.h"
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct job {
    struct hfield hf;
    struct spectrum light;
    struct tables_spec spec;
    struct table t;
};

static struct tables_spec spec_of(enum table_basis basis, int count, double tolerance)
{
    return (struct tables_spec){.coherence_m = 65e-6,
                                .repeat = {1, 1},
                                .step_m = 5e-9,
                                .n = 501,
                                .power = 5,
                                .range = 2,
                                .basis = basis,
                                .w_max = 2,
                                .count = count,
                                .tolerance = tolerance,
                                .memory = 1000000000};
}

static bool make(void *ctx, struct err *e)
{
    struct job *j = ctx;
    table_finish(&j->t);
    j->spec.light = &j->light;
    return tables_make(&j->t, &j->spec, &j->hf, e);
}

static void job_finish(struct job *j)
{
    table_finish(&j->t);
    hfield_finish(&j->hf);
    spectrum_finish(&j->light);
}

struct truth { // points with their values
    int n;
    double (*at)[3], (*xyz)[3];
};

static void truth_finish(struct truth *t)
{
    free(t->at);
    free(t->xyz);
}

static double error_of(const struct table *t, const struct truth *truth)
{
    double apart = 0, all = 0;
    for (int k = 0; k < truth->n; k++) {
        const double *p = truth->at[k];
        double got[3];
        table_eval(t, p[0], p[1], p[2], 0, got);
        for (int c = 0; c < 3; c++) {
            apart += (got[c] - truth->xyz[k][c]) * (got[c] - truth->xyz[k][c]);
            all += truth->xyz[k][c] * truth->xyz[k][c];
        }
    }
    return sqrt(apart / all);
}

static bool truth_read(struct truth *t, const char *path, struct err *e)
{
    FILE *f = fopen(path, "r");
    if (!f)
        return err_errno(e, "%s", path);
    double p[3], x[3];
    *t = (struct truth){0};
    int unused = fscanf(f, "u,v,w,X,Y,Z");
    (void)unused;
    while (fscanf(f, " %lf,%lf,%lf,%lf,%lf,%lf", p, p + 1, p + 2, x, x + 1, x + 2) == 6) {
        t->at = xrealloc(t->at, (size_t)t->n + 1, sizeof *t->at);
        t->xyz = xrealloc(t->xyz, (size_t)t->n + 1, sizeof *t->xyz);
        memcpy(t->at[t->n], p, sizeof p);
        memcpy(t->xyz[t->n++], x, sizeof x);
    }
    fclose(f);
    return true;
}

// Random nodes of the table at ten w, summed directly.
static bool truth_sum(struct truth *t, const struct job *j, int n, struct err *e)
{
    const struct table nodes = {.n = j->spec.n, .range = j->spec.range, .power = j->spec.power};
    uint32_t state = 11;
    *t = (struct truth){.n = n};
    t->at = xcalloc((size_t)n, sizeof *t->at);
    t->xyz = xcalloc((size_t)n, sizeof *t->xyz);
    for (int k = 0; k < n; k++) {
        for (int q = 0; q < 2; q++) {
            state = state * 1664525u + 1013904223u;
            t->at[k][q] = table_node(&nodes, (int)((state >> 8) % (uint32_t)nodes.n));
        }
        t->at[k][2] = 0.1 + 0.2 * (k % 10); // midpoints: the mean over w in 0..2
    }
    struct spectral light = {0};
    const struct direct d = {
        .heights = &j->hf, .light = &light, .coherence_m = j->spec.coherence_m, .repeat = {1, 1}};
    const bool ok = spectral_init(&light, &j->light, j->spec.step_m, e) &&
                    direct_xyz(&d, n, (const double(*)[3])t->at, t->xyz, e);
    spectral_finish(&light);
    return ok;
}

static bool open_reference(struct job *j, const char *name, struct err *e)
{
    char path[64];
    snprintf(path, sizeof path, "reference/tables/height_%s.pfm", name);
    const struct hfield_hints hints = {.dx_m = 65e-6 / 256};
    *j = (struct job){0};
    return hfield_read(&j->hf, bench_shared(path), &hints, e) && illuminant_get(&j->light, "E", e);
}

static bool run_row(struct bench_report *r, struct job *j, const struct truth *truth,
                    const char *method, const char *setting, const char *kind, struct err *e)
{
    struct bench_time time;
    if (!bench_measure(make, j, &time, e))
        return false;
    bench_row(r, method, setting, time, error_of(&j->t, truth), kind);
    return true;
}

static bool bases(struct bench_report *r, const char *name, struct err *e)
{
    static const struct {
        const char *name;
        enum table_basis basis;
        int count, hurry; // hurry: also when quick
    } cases[] = {
        {"pod", TABLE_POD, 2, 1},
        {"pod", TABLE_POD, 3, 0},
        {"pod", TABLE_POD, 4, 0},
        {"pod", TABLE_POD, 12, 1},
        {"chebyshev", TABLE_CHEBYSHEV, 2, 1},
        {"chebyshev", TABLE_CHEBYSHEV, 3, 0},
        {"chebyshev", TABLE_CHEBYSHEV, 4, 0},
        {"chebyshev", TABLE_CHEBYSHEV, 12, 0},
        {"taylor", TABLE_TAYLOR, 3, 0},
        {"taylor", TABLE_TAYLOR, 25, 0},
        {"taylor", TABLE_TAYLOR, 67, 0},
    };
    struct job j;
    struct truth truth = {0};
    char path[64];
    snprintf(path, sizeof path, "reference/tables/truth_%s.csv", name);
    bench_task(r, name);
    bool ok = open_reference(&j, name, e) && truth_read(&truth, bench_shared(path), e);
    for (size_t k = 0; ok && k < sizeof cases / sizeof *cases; k++) {
        if (bench_quick(r) && !cases[k].hurry)
            continue;
        char setting[64];
        snprintf(setting, sizeof setting, "%s, %d tables", name, cases[k].count);
        j.spec = spec_of(cases[k].basis, cases[k].count, 0);
        ok = run_row(r, &j, &truth, cases[k].name, setting, "relative L2 against the truth", e);
    }
    truth_finish(&truth);
    job_finish(&j);
    return ok;
}

static bool tolerances(struct bench_report *r, struct job *j, const char *name, struct err *e)
{
    struct truth truth = {0};
    bench_task(r, name);
    bool ok = truth_sum(&truth, j, bench_quick(r) ? 300 : 10000, e);
    for (int k = 2; ok && k <= 3; k++) {
        char setting[96];
        const double coherence_m = j->spec.coherence_m;
        j->spec = spec_of(TABLE_POD, 0, pow(10, -k));
        j->spec.coherence_m = coherence_m;
        ok = make(j, e);
        snprintf(setting, sizeof setting, "%s, tolerance 1e-%d: %d tables", name, k, j->t.count);
        ok = ok && run_row(r, j, &truth, "pod", setting, "relative L2 at random nodes", e);
        if (ok && k == 3)
            bench_default(r);
    }
    truth_finish(&truth);
    return ok;
}

// Waves and noise, 300 nm high, 65 um wide.
static bool make_field(struct job *j, int n, struct err *e)
{
    *j = (struct job){0};
    if (!hfield_init(&j->hf, n, n, 65e-6 / n, 65e-6 / n, e))
        return false;
    uint32_t state = 1;
    for (int k = 0; k < n * n; k++) {
        const double x = k % n * 65.0 / n, y = k / n * 65.0 / n;
        state = state * 1664525u + 1013904223u;
        j->hf.z[k] = (float)(3e-7 * (0.3 * sin(4.1 * x + 0.7 * y) + 0.3 * cos(5.3 * y - 1.1 * x) +
                                     0.2 * sin(11.7 * x + 3 * sin(y)) +
                                     0.2 * ((state >> 8) / 16777216.0 - 0.5)));
    }
    return illuminant_get(&j->light, "E", e);
}

static bool beside_d14(struct bench_report *r, int field, int size, int order, int points,
                       struct err *e)
{
    struct job j;
    struct truth truth = {0};
    struct bench_time time;
    char text[96];
    bool ok = make_field(&j, field, e);
    j.spec = spec_of(TABLE_POD, 0, 1e-3);
    j.spec.n = size;
    ok = ok && truth_sum(&truth, &j, field > 500 ? 300 : 1000, e) &&
         bench_measure(make, &j, &time, e);
    if (ok) {
        snprintf(text, sizeof text, "field %d, table %d, 81 wavelengths", field, size);
        bench_row(r, "pod 1e-3", text, time, error_of(&j.t, &truth), "relative L2 at random nodes");
        double sum = 0;
        const double d14_s = d14_seconds(&j.hf, 65e-6 / 4, order, 81, size, points, &sum);
        snprintf(text, sizeof text, "D14 transcribed, N = %d, %d/%d, extrapolated", order, field,
                 size);
        bench_figure(r, text, d14_s, "s");
        snprintf(text, sizeof text, "D14 / ours, %d/%d", field, size);
        bench_figure(r, text, d14_s / time.wall_s, "times");
    }
    truth_finish(&truth);
    job_finish(&j);
    return ok;
}

static bool measured_heights(struct bench_report *r, struct err *e)
{
    static const struct {
        const char *path, *name;
        double coherence_m;
    } files[] = {{"data/heights/di-3.di", "AFM 10 um", 10e-6},
                 {"data/heights/x3p-2.x3p", "topography", 65e-6}};
    bool ok = true;
    for (int k = 0; ok && k < 2; k++) {
        struct job j = {.spec = {.n = 501, .range = 2, .power = 5, .step_m = 5e-9}};
        if (!bench_shared(files[k].path))
            continue;
        j.spec.coherence_m = files[k].coherence_m;
        ok = hfield_read(&j.hf, bench_shared(files[k].path), NULL, e) &&
             illuminant_get(&j.light, "E", e) && tolerances(r, &j, files[k].name, e);
        job_finish(&j);
    }
    return ok;
}

static bool run(struct bench_report *r, struct err *e)
{
    static const char *const names[] = {"blazed", "quasi", "rough"};
    bench_note(r, "D14's algorithm is timed on a few points of one order and wavelength and "
                  "extrapolated to the whole table, on one core");
    bool ok = beside_d14(r, 128, 129, 5, 2000, e) &&
              (bench_quick(r) || beside_d14(r, 1024, 501, 15, 200, e));
    if (!bench_shared("reference/tables/case.json")) {
        bench_note(r, "no reference data: no rows of the reference fields");
        return ok;
    }
    for (int k = 0; ok && k < 3; k++) {
        struct job j = {0};
        ok = bases(r, names[k], e) && (bench_quick(r) || open_reference(&j, names[k], e));
        if (ok && !bench_quick(r)) {
            j.spec = spec_of(TABLE_POD, 0, 1e-2);
            ok = tolerances(r, &j, names[k], e);
        }
        job_finish(&j);
    }
    return ok && (bench_quick(r) || measured_heights(r, e));
}

const struct bench bench_tables = {
    .name = "tables",
    .summary = "tables from height fields, beside D14's algorithm",
    .run = run,
};
