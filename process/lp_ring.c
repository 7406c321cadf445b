// lp_ring.c - samples a square ring of the picture along rays and correlates every ray.
#define _GNU_SOURCE
#include "process/lp_ring.h"
#include "core/mem.h"
#include "process/bspline.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    PAD = 23,  // rays beyond the sector: 3 to read, 20 for the spline fit (0.431^20 = 5e-8)
    CHUNK = 8, // blocks of rays that one task samples and filters
    GROUP = 4, // results that share a pass over the samples
};

static int sectors(const struct lp_ring *r)
{
    return r->symmetric ? 2 : 4;
}

// Samples along a ray that all results together look at.
static int samples_of(const struct lp_ring *r)
{
    return (r->rows + GROUP - 1) / GROUP * GROUP * r->taps.stride + r->taps.n;
}

static int chunks_of(const struct lp_ring *r)
{
    return (r->rays / LP_BLOCK + CHUNK - 1) / CHUNK;
}

typedef float rays16 __attribute__((vector_size(64))); // one sample of LP_BLOCK rays

// sum[o][c] = sum over m in [from, to) of tap[m - o stride][c] in[m]
__attribute__((target_clones("avx512f", "avx2", "default"))) static void
filter_group(const rays16 *in, const float (*tap)[3], int stride, int from, int to,
             float *sum /* [GROUP][3][LP_BLOCK] */)
{
    rays16 s[GROUP][3];
    memset(s, 0, sizeof s);
    for (int m = from; m < to; m++) {
        const rays16 v = in[m];
        for (int o = 0; o < GROUP; o++)
            for (int c = 0; c < 3; c++)
                s[o][c] += tap[m - o * stride][c] * v;
    }
    memcpy(sum, s, sizeof s);
}

// One block of rays: every result of the ring from its samples in[n_in].
static long filter_block(struct lp_ring *r, int sector, int block, const rays16 *in,
                         const uint8_t *in_live)
{
    const struct lp_taps *t = &r->taps;
    const int n_in = samples_of(r);
    int first = 0, last = n_in - 1;
    while (first < n_in && !in_live[first])
        first++;
    while (last > first && !in_live[last])
        last--;
    long skipped = 0;
    const int blocks = r->rays / LP_BLOCK;
    for (int row = 0; row < r->rows; row += GROUP) {
        const int at = row * t->stride, end = at + t->n + (GROUP - 1) * t->stride;
        const int from = first > at ? first : at, to = last + 1 < end ? last + 1 : end;
        const int used = r->rows - row < GROUP ? r->rows - row : GROUP;
        if (from >= to) {
            skipped += used;
            continue;
        }
        float sum[GROUP][3][LP_BLOCK];
        filter_group(in + at, (const float(*)[3])t->tap, t->stride, from - at, to - at, sum[0][0]);
        for (int o = 0; o < used; o++) {
            const size_t line = (size_t)(sector * r->rows + row + o);
            r->live[line * (size_t)blocks + (size_t)block] = 1;
            for (int c = 0; c < 3; c++)
                memcpy(r->coef + (line * 3 + (size_t)c) * (size_t)r->rays + block * LP_BLOCK,
                       sum[o][c], sizeof sum[o][c]);
        }
    }
    return skipped;
}

struct task {
    float *line, *row, *twin; // scratch of lp_source_ring
    rays16 *in;               // [CHUNK][n_in]
    uint8_t *live;            // [CHUNK][n_in]
};

// row[n] and live become the mean with the ray opposite to each.
static void add_opposite(const struct lp_source *s, int sector, double a, double t0, double dt,
                         int n, struct task *w, uint8_t live[CHUNK])
{
    uint8_t twin_live[CHUNK];
    lp_source_ring(s, sector + 2, a, -(t0 + (n - 1) * dt), dt, n, w->line, w->twin, twin_live);
    for (int k = 0; k < n; k++)
        w->row[k] = 0.5f * (w->row[k] + w->twin[n - 1 - k]);
    for (int b = 0; b < n / LP_BLOCK; b++)
        live[b] |= twin_live[n / LP_BLOCK - 1 - b];
}

// Samples and filters the blocks of rays from `block` on.
static void run_task(struct lp_ring *r, const struct lp_source *s, int sector, int block,
                     struct task *w, struct lp_counts *counts)
{
    const struct lp_taps *t = &r->taps;
    const int n_in = samples_of(r);
    const int left = r->rays / LP_BLOCK - block, n = left < CHUNK ? left : CHUNK;
    const double dt = 1.0 / r->half, t0 = (block * LP_BLOCK - r->middle) * dt;
    const double ln_in = r->ln_first + t->first * t->step;
    for (int m = 0; m < n_in; m++) {
        uint8_t live[CHUNK];
        const double a = exp(ln_in + m * t->step);
        lp_source_ring(s, sector, a, t0, dt, n * LP_BLOCK, w->line, w->row, live);
        if (r->symmetric)
            add_opposite(s, sector, a, t0, dt, n * LP_BLOCK, w, live);
        for (int b = 0; b < n; b++) {
            memcpy(&w->in[b * n_in + m], w->row + b * LP_BLOCK, sizeof *w->in);
            w->live[b * n_in + m] = live[b];
            counts->samples_skipped += !live[b];
        }
    }
    counts->samples += (double)n * n_in;
    counts->results += (double)n * r->rows;
    for (int b = 0; b < n; b++)
        counts->results_skipped +=
            (double)filter_block(r, sector, block + b, w->in + b * n_in, w->live + b * n_in);
}

// Live blocks spread by what the spline fit rings: two blocks.
static void spread_live(struct lp_ring *r)
{
    const int blocks = r->rays / LP_BLOCK;
    uint8_t *was = xcalloc((size_t)blocks, 1);
    for (uint8_t *line = r->live; line < r->live + sectors(r) * r->rows * blocks; line += blocks) {
        memcpy(was, line, (size_t)blocks);
        for (int b = 0; b < blocks; b++)
            for (int d = b > 1 ? b - 2 : 0; d <= b + 2 && d < blocks; d++)
                line[b] |= was[d];
    }
    free(was);
}

static bool task_init(struct task *w, const struct lp_ring *rings, int n, const struct lp_source *s,
                      struct err *e)
{
    size_t most = 1;
    for (int q = 0; q < n; q++)
        most = (size_t)samples_of(&rings[q]) > most ? (size_t)samples_of(&rings[q]) : most;
    *w = (struct task){
        .line = xcalloc(lp_source_scratch(s), sizeof(float)),
        .row = xcalloc(CHUNK * LP_BLOCK, sizeof(float)),
        .twin = xcalloc(CHUNK * LP_BLOCK, sizeof(float)),
        .in = sample_alloc(CHUNK * most, sizeof *w->in, "rays", e),
        .live = xcalloc(CHUNK * most, 1),
    };
    return w->in != NULL;
}

static void task_finish(struct task *w)
{
    free(w->line);
    free(w->row);
    free(w->twin);
    free(w->in);
    free(w->live);
}

// The ring that task number *task belongs to; *task becomes its number there. NULL: none.
static struct lp_ring *ring_of_task(struct lp_ring *rings, int n, int *task)
{
    for (struct lp_ring *r = rings; r < rings + n; r++) {
        if (*task < sectors(r) * chunks_of(r))
            return r;
        *task -= sectors(r) * chunks_of(r);
    }
    return NULL;
}

// All rings and the middle in one go: few barriers, and the cores share the small rings.
static bool sample_all(struct lp_ring *rings, int n, struct lp_middle *middle,
                       const struct lp_source *s, struct lp_counts *counts, struct err *e)
{
    bool ok = true;
    int tasks = 0;
    double samples = 0, samples_skipped = 0, results = 0, results_skipped = 0;
    for (int q = 0; q < n; q++)
        tasks += sectors(&rings[q]) * chunks_of(&rings[q]);
#pragma omp parallel reduction(+ : samples, samples_skipped, results, results_skipped)
    {
        struct err mine = {0};
        struct lp_counts c = {0};
        struct task w;
        const bool ready = task_init(&w, rings, n, s, &mine);
#pragma omp for schedule(dynamic) nowait
        for (int k = 0; k < tasks; k++) {
            int task = k;
            struct lp_ring *r = ring_of_task(rings, n, &task);
            if (ready)
                run_task(r, s, task / chunks_of(r), task % chunks_of(r) * CHUNK, &w, &c);
        }
#pragma omp for schedule(dynamic)
        for (int j = 0; j < middle->n; j++)
            lp_middle_row(middle, s, j);
        if (!ready) {
#pragma omp critical
            {
                ok = false;
                *e = mine;
            }
        }
        samples += c.samples; // whole numbers: exact in any order
        samples_skipped += c.samples_skipped;
        results += c.results;
        results_skipped += c.results_skipped;
        task_finish(&w);
    }
    *counts = (struct lp_counts){samples, samples_skipped, results, results_skipped};
    return ok;
}

// Values along t become coefficients; along ln a they are already (lp_taps.h).
static void fit_all(struct lp_ring *rings, int n, struct lp_middle *middle)
{
    enum { LINES = 48 };
    int groups = 0;
    for (int q = 0; q < n; q++)
        groups += (sectors(&rings[q]) * rings[q].rows * 3 + LINES - 1) / LINES;
#pragma omp parallel for schedule(dynamic)
    for (int k = 0; k < groups + 1; k++) {
        int group = k;
        struct lp_ring *r = rings;
        for (; r < rings + n; r++) {
            const int lines = sectors(r) * r->rows * 3, own = (lines + LINES - 1) / LINES;
            if (group < own) {
                const int first = group * LINES, left = lines - first;
                bspline_fit_rows(r->coef + (size_t)first * (size_t)r->rays, r->rays,
                                 left < LINES ? left : LINES, BSPLINE_QUINTIC);
                break;
            }
            group -= own;
        }
        if (r == rings + n) {
            bspline_fit_rows(middle->coef, middle->n, 3 * middle->n, BSPLINE_QUINTIC);
            bspline_fit_columns(middle->coef, 3 * middle->n, middle->n, BSPLINE_QUINTIC);
        }
    }
    for (int q = 0; q < n; q++)
        spread_live(&rings[q]);
}

bool lp_fill(struct lp_ring *rings, int n, struct lp_middle *middle, const struct lp_source *s,
             struct lp_counts *counts, struct err *e)
{
    if (!sample_all(rings, n, middle, s, counts, e))
        return false;
    fit_all(rings, n, middle);
    return true;
}

bool lp_ring_init(struct lp_ring *r, const struct lp_kernel *k, double a_high, double spacing,
                  double tolerance, bool symmetric, struct err *e)
{
    const double outermost = a_high * lp_kernel_growth(k); // px in the picture
    struct lp_ring got = {.a_low = 0.5 * a_high, .a_high = a_high, .symmetric = symmetric};
    if (!lp_taps_init(&got.taps, k, fmin(spacing / outermost, 0.1), tolerance, e))
        return false;
    got.step = got.taps.step * got.taps.stride;
    got.ln_first = log(0.5 * a_high) - 2 * got.step;
    got.rows = (int)(log(2) / got.step) + 7;
    got.half = (int)ceil(outermost / spacing);
    got.middle = got.half + PAD;
    got.rays = (2 * got.middle + 1 + LP_BLOCK - 1) / LP_BLOCK * LP_BLOCK;
    const size_t lines = (size_t)(sectors(&got) * got.rows);
    got.coef = sample_alloc(lines * 3 * (size_t)got.rays, sizeof *got.coef, "rays", e);
    got.live = xcalloc(lines * (size_t)(got.rays / LP_BLOCK), 1);
    if (!got.coef) {
        lp_ring_finish(&got);
        return false;
    }
    *r = got;
    return true;
}

void lp_ring_finish(struct lp_ring *r)
{
    lp_taps_finish(&r->taps);
    free(r->coef);
    free(r->live);
    *r = (struct lp_ring){0};
}
