// bench_kernels.c - the hot kernels against what this machine can do: bytes and flops counted,
// memory bandwidth and FMA rate measured here and now; and how their time grows with size.
//
// The limit is the larger of bytes / bandwidth and flops / rate; what stays in the cache passes it.
// Bytes are those that must come and go once if caches keep everything else, flops those of the
// plain formula. Products and sums are not contracted (the same bytes on every machine) but in
// blurs: others reach half of the FMA rate at most.
#define _GNU_SOURCE
#include "core/mem.h"
#include "process/blur.h"
#include "process/bspline.h"
#include "process/deconvolve.h"
#include "process/fft.h"
#include "process/hdr.h"
#include "process/lut.h"
#include "tests/bench/bench.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LANES = 16, CHAINS = 12, FRAMES = 9, TRIADS = 1 << 24, ROUNDS = 1000000 };

// Independent chains of products and sums, enough of them to hide the latency; fused, as nothing
// else here is.
typedef float vec __attribute__((vector_size(64)));
__attribute__((target_clones("avx512f", "arch=x86-64-v3", "default"),
               optimize("O3", "fp-contract=fast"))) static float
chains(int rounds)
{
    vec x[CHAINS], sum = {0};
    for (int k = 0; k < CHAINS; k++)
        x[k] = sum + 1e-3f * (float)k;
    for (int r = 0; r < rounds; r++)
#pragma GCC unroll 12
        for (int k = 0; k < CHAINS; k++)
            x[k] = x[k] * 0.999f + 1e-3f;
    for (int k = 0; k < CHAINS; k++)
        sum += x[k];
    return sum[0] + sum[LANES - 1];
}

static volatile float sink;

static bool run_chains(void *ctx, struct err *e)
{
    (void)ctx;
    (void)e;
    float sum = 0;
#pragma omp parallel reduction(+ : sum)
    sum += chains(ROUNDS);
    sink = sum;
    return true;
}

static bool run_triad(void *ctx, struct err *e)
{
    float *a = ctx, *b = a + TRIADS, *c = b + TRIADS;
    (void)e;
#pragma omp parallel for schedule(static)
    for (int k = 0; k < TRIADS; k++)
        a[k] = b[k] + 0.5f * c[k];
    return true;
}

static int threads(void)
{
    int n = 0;
#pragma omp parallel reduction(+ : n)
    n++;
    return n;
}

static bool machine(double *bytes_per_s, double *flops_per_s, struct err *e)
{
    struct bench_time t;
    float *a = sample_alloc(3 * (size_t)TRIADS, sizeof *a, "arrays", e);
    if (!a)
        return false;
    for (size_t k = 0; k < 3 * (size_t)TRIADS; k++)
        a[k] = (float)k;
    bool ok = bench_measure(run_triad, a, &t, e);
    *bytes_per_s = 3 * sizeof(float) * (double)TRIADS / t.wall_s; // as STREAM counts
    free(a);
    ok = ok && bench_measure(run_chains, NULL, &t, e);
    *flops_per_s = 2.0 * CHAINS * LANES * ROUNDS * threads() / t.wall_s;
    return ok;
}

// What all kernels work on: pictures of n x n samples.
struct work {
    int n;
    float *in, *out;
    struct blur *narrow, *wide;
    struct fft *fft;
    const float *frame[FRAMES];
    double time_s[FRAMES];
    struct spectrum light;
    struct lut_pattern pattern;
};

static void work_finish(struct work *w)
{
    blur_free(w->narrow);
    blur_free(w->wide);
    fft_free(w->fft);
    lut_pattern_finish(&w->pattern);
    spectrum_finish(&w->light);
    free(w->in);
    free(w->out);
}

static bool work_init(struct work *w, int n, struct err *e)
{
    const size_t count = (size_t)n * (size_t)n;
    struct image im = {0};
    *w = (struct work){.n = n};
    w->in = sample_alloc(FRAMES * count, sizeof *w->in, "pictures", e);
    w->out = sample_alloc(count + 4 * (size_t)n, sizeof *w->out, "picture", e);
    if (!w->in || !w->out || !image_init(&im, n, n, 1, e))
        return false;
    for (int k = 0; k < FRAMES; k++) {
        w->time_s[k] = 1e-3 * pow(2, k);
        w->frame[k] = w->in + (size_t)k * count;
        for (size_t i = 0; i < count; i++)
            w->in[(size_t)k * count + i] =
                fminf(4095, (float)(w->time_s[k] * 1e4 * (1.5 + sin(1e-2 * (double)i))));
    }
    memcpy(im.px, w->in, count * sizeof *im.px);
    w->narrow = blur_gauss(n, n, 2, e);
    w->wide = blur_gauss(n, n, 12, e);
    w->fft = fft_new(FFT_R2C, FFT_FLOAT, n, n, 1, false, e);
    const bool ok = w->narrow && w->wide && w->fft && illuminant_get(&w->light, "E", e) &&
                    lut_pattern_init(&w->pattern, &im, 0, 1, e);
    w->pattern.h_per_px = 0.7 / n;
    w->pattern.cx = w->pattern.cy = 0.5 * (n - 1);
    image_finish(&im);
    return ok;
}

static bool run_merge(void *ctx, struct err *e)
{
    struct work *w = ctx;
    struct image out = {0};
    struct hdr_counts counts;
    const struct hdr_frames f = {FRAMES, w->n, w->n, 1, w->frame, w->time_s, 4095, {6, 0.4}};
    const bool ok = hdr_merge(&f, HDR_POISSON, &out, &counts, e);
    image_finish(&out);
    return ok;
}

static bool run_narrow(void *ctx, struct err *e)
{
    struct work *w = ctx;
    (void)e;
    blur_apply(w->narrow, w->in, w->out);
    return true;
}

static bool run_wide(void *ctx, struct err *e)
{
    struct work *w = ctx;
    (void)e;
    blur_apply(w->wide, w->in, w->out);
    return true;
}

static bool run_richardson(void *ctx, struct err *e)
{
    struct work *w = ctx;
    const struct deconvolve_options opt = {.iterations = 10};
    struct deconvolve_result res;
    return deconvolve(w->narrow, w->n, w->n, w->in, &opt, w->out, &res, e);
}

static bool run_spline(void *ctx, struct err *e)
{
    struct work *w = ctx;
    (void)e;
    memcpy(w->out, w->in, (size_t)w->n * (size_t)w->n * sizeof *w->out);
    bspline_fit_image(w->out, w->n, w->n, BSPLINE_QUINTIC);
    return true;
}

static bool run_fft(void *ctx, struct err *e)
{
    struct work *w = ctx;
    (void)e;
    fft_run(w->fft, w->in, w->out);
    return true;
}

static bool run_table(void *ctx, struct err *e)
{
    struct work *w = ctx;
    struct table t = {0};
    struct lut_report report;
    const struct lut_request r = {.pattern = &w->pattern,
                                  .lambda_m = 530e-9,
                                  .light = &w->light,
                                  .f0 = 1,
                                  .exponent = 2,
                                  .n = w->n,
                                  .range = 0.3,
                                  .power = 1,
                                  .method = LUT_EXACT,
                                  .tolerance = 1e-3};
    const bool ok = lut_build(&r, &t, &report, e);
    table_finish(&t);
    return ok;
}

// Per sample of the picture; by_log: flops are times log2 of the number of samples.
static const struct kernel {
    const char *name;
    bool (*run)(void *ctx, struct err *e);
    double bytes, flops;
    bool by_log;
    double exponent; // of time against the side that is expected
    const char *why; // less than a third of the limit is reached
} kernels[] = {
    {"hdr merge, 9 frames", run_merge, 4 * (FRAMES + 3), 14 * FRAMES, false, 2,
     "a division and branches per frame: which frames count is decided sample by sample"},
    {"blur, sigma 2, direct", run_narrow, 8, 2 * 2 * 17, false, 2,
     "loads across cache lines, one a cycle, for every product (blur_passes.c)"},
    {"blur, sigma 12, FFT", run_wide, 8, 2 * 2.5, true, 2,
     "FFTW's transforms reach a fifth of the FMA rate at such sizes; margins are transformed too"},
    {"Richardson-Lucy, 10 iterations, sigma 2", run_richardson, 10 * 12, 10 * (2 * 2 * 2 * 17 + 4),
     false, 2, "loads across cache lines, one a cycle, for every product (blur_passes.c)"},
    {"quintic spline fit", run_spline, 4 * 8, 2 * 2 * 8, false, 2,
     "each sample waits for the one before: recursions of four poles"},
    {"FFT, real, float", run_fft, 8, 2.5, true, 2.1,
     "one thread a transform (the same bytes on every run), and FFTW's columns miss the cache"},
    {"table, exact", run_table, 4 + 12, 4 * 36 + 3 * 60, false, 2,
     "five passes of one-dimensional splines over pictures that leave the cache in between"},
};
enum { KERNELS = sizeof kernels / sizeof *kernels };

enum { SIZES = 4 };
static const int sizes[SIZES] = {256, 512, 1024, 2048};

static bool one_size(struct bench_report *r, int n, double bytes_per_s, double flops_per_s,
                     bool largest, double wall_s[KERNELS], struct err *e)
{
    struct work w;
    bool ok = work_init(&w, n, e);
    for (int k = 0; ok && k < KERNELS; k++) {
        const struct kernel *q = &kernels[k];
        struct bench_time t;
        char text[80];
        if (!(ok = bench_measure(q->run, &w, &t, e)))
            break;
        const double samples = (double)n * n;
        const double flops = q->flops * samples * (q->by_log ? log2(samples) : 1);
        const double by_bytes = q->bytes * samples / bytes_per_s, by_flops = flops / flops_per_s;
        const double reached = fmax(by_bytes, by_flops) / t.wall_s;
        wall_s[k] = t.wall_s;
        if (!largest)
            continue;
        snprintf(text, sizeof text, "%d x %d, %s", n, n,
                 by_bytes > by_flops ? "bound by memory" : "bound by arithmetic");
        bench_row(r, q->name, text, t, fmax(0, 1 - reached), "1 - share of the limit");
        bench_figure(r, q->name, 100 * reached, "% of the limit");
        if (reached < 1. / 3)
            bench_note(r, "%s: %s", q->name, q->why);
    }
    work_finish(&w);
    return ok;
}

static bool run(struct bench_report *r, struct err *e)
{
    const int n = bench_quick(r) ? 2 : SIZES;
    double bytes_per_s = NAN, flops_per_s = NAN, wall_s[SIZES][KERNELS];
    bool ok = machine(&bytes_per_s, &flops_per_s, e);
    bench_figure(r, "memory bandwidth (triad), all threads", bytes_per_s * 1e-9, "GB/s");
    bench_figure(r, "FMA rate (float), all threads", flops_per_s * 1e-9, "Gflop/s");
    for (int k = 0; ok && k < n; k++)
        ok = one_size(r, sizes[k], bytes_per_s, flops_per_s, k == n - 1, wall_s[k], e);
    for (int k = 0; ok && k < KERNELS; k++) {
        for (int s = 0; s < n; s++)
            bench_growth(r, kernels[k].name, sizes[s], wall_s[s][k]);
        bench_exponent(r, kernels[k].name, kernels[k].exponent);
    }
    return ok;
}

extern const struct bench bench_kernels;
const struct bench bench_kernels = {
    .name = "kernels",
    .summary = "hot kernels against bandwidth and FMA rate of this machine, and against their size",
    .run = run,
};
