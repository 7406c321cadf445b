// lp_ring.c - samples a square ring of the picture along rays and correlates every ray.
#define _GNU_SOURCE
#include "process/lp_ring.h"
#include "core/mem.h"
#include "process/bspline.h"
#include "process/lp_taps.h"
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
static long filter_block(struct lp_ring *r, const struct lp_taps *t, int sector, int block,
                         const rays16 *in, const uint8_t *in_live, int n_in)
{
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
static void run_task(struct lp_ring *r, const struct lp_source *s, const struct lp_taps *t,
                     int sector, int block, int n_in, struct task *w, struct lp_counts *counts)
{
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
        counts->results_skipped += (double)filter_block(r, t, sector, block + b, w->in + b * n_in,
                                                        w->live + b * n_in, n_in);
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

static bool run_tasks(struct lp_ring *r, const struct lp_source *s, const struct lp_taps *t,
                      struct lp_counts *counts, struct err *e)
{
    const int n_in = (r->rows + GROUP - 1) / GROUP * GROUP * t->stride + t->n;
    const int blocks = r->rays / LP_BLOCK, chunks = (blocks + CHUNK - 1) / CHUNK;
    bool ok = true;
    double sums[4] = {0};
#pragma omp parallel
    {
        struct err mine = {0};
        struct lp_counts c = {0};
        struct task w = {
            .line = xcalloc(lp_source_scratch(s), sizeof(float)),
            .row = xcalloc(CHUNK * LP_BLOCK, sizeof(float)),
            .twin = xcalloc(CHUNK * LP_BLOCK, sizeof(float)),
            .in = sample_alloc((size_t)CHUNK * (size_t)n_in, sizeof *w.in, "rays", &mine),
            .live = xcalloc((size_t)CHUNK * (size_t)n_in, 1),
        };
#pragma omp for schedule(dynamic)
        for (int task = 0; task < sectors(r) * chunks; task++)
            if (w.in)
                run_task(r, s, t, task / chunks, task % chunks * CHUNK, n_in, &w, &c);
#pragma omp critical
        {
            if (!w.in) {
                ok = false;
                *e = mine;
            }
            sums[0] += c.samples; // whole numbers: exact in any order
            sums[1] += c.samples_skipped;
            sums[2] += c.results;
            sums[3] += c.results_skipped;
        }
        free(w.line);
        free(w.row);
        free(w.twin);
        free(w.in);
        free(w.live);
    }
    counts->samples += sums[0];
    counts->samples_skipped += sums[1];
    counts->results += sums[2];
    counts->results_skipped += sums[3];
    return ok;
}

static double largest_s(const struct lp_kernel *k)
{
    double s = k->s[0];
    for (int q = 1; q < k->n; q++)
        s = fmax(s, k->s[q]);
    return s;
}

bool lp_ring_init(struct lp_ring *r, const struct lp_source *s, const struct lp_kernel *k,
                  double a_high, double spacing, double tolerance, bool symmetric,
                  struct lp_counts *counts, struct err *e)
{
    const double outermost = a_high * exp(largest_s(k)); // px in the picture
    struct lp_taps taps;
    if (!lp_taps_init(&taps, k, fmin(spacing / outermost, 0.1), tolerance, e))
        return false;
    const double step = taps.step * taps.stride;
    struct lp_ring got = {
        .a_low = 0.5 * a_high,
        .a_high = a_high,
        .symmetric = symmetric,
        .ln_first = log(0.5 * a_high) - 2 * step,
        .step = step,
        .rows = (int)(log(2) / step) + 7,
        .half = (int)ceil(outermost / spacing),
    };
    got.middle = got.half + PAD;
    got.rays = (2 * got.middle + 1 + LP_BLOCK - 1) / LP_BLOCK * LP_BLOCK;
    const size_t lines = (size_t)(sectors(&got) * got.rows);
    got.coef = sample_alloc(lines * 3 * (size_t)got.rays, sizeof *got.coef, "rays", e);
    got.live = xcalloc(lines * (size_t)(got.rays / LP_BLOCK), 1);
    const bool ok = got.coef && run_tasks(&got, s, &taps, counts, e);
    lp_taps_finish(&taps);
    if (!ok) {
        lp_ring_finish(&got);
        return false;
    }
    bspline_fit_rows(got.coef, got.rays, (int)lines * 3, BSPLINE_QUINTIC);
    spread_live(&got);
    *r = got;
    return true;
}

void lp_ring_finish(struct lp_ring *r)
{
    free(r->coef);
    free(r->live);
    *r = (struct lp_ring){0};
}

bool lp_middle_init(struct lp_middle *m, const struct lp_source *s, const struct lp_kernel *k,
                    double a_high, double spacing, bool symmetric, struct err *e)
{
    enum { RIM = 12 }; // 3 to read, 9 for the spline fit
    const double per_px = 1 / spacing;
    const int half = (int)ceil(a_high * per_px) + RIM, n = 2 * half + 1;
    struct lp_taps t;
    if (!lp_taps_init(&t, k, fmin(spacing / (a_high * exp(largest_s(k))), 0.25), 0, e))
        return false;
    struct lp_middle got = {a_high, per_px, n, half, NULL};
    got.coef = sample_alloc((size_t)n * (size_t)n * 3, sizeof *got.coef, "table", e);
    if (got.coef) {
#pragma omp parallel for
        for (int j = 0; j < n; j++)
            for (int i = 0; i < n; i++) {
                double sum[3] = {0};
                for (int q = 0; q < t.n; q++) {
                    const double grow = exp((t.first + q) * t.step) * spacing;
                    const double x = (i - half) * grow, y = (j - half) * grow;
                    double l = lp_source_at(s, x, y);
                    if (symmetric)
                        l = 0.5 * (l + lp_source_at(s, -x, -y));
                    for (int c = 0; c < 3; c++)
                        sum[c] += (double)t.tap[q][c] * l;
                }
                for (int c = 0; c < 3; c++)
                    got.coef[((size_t)j * 3 + (size_t)c) * (size_t)n + (size_t)i] = (float)sum[c];
            }
        bspline_fit_rows(got.coef, n, 3 * n, BSPLINE_QUINTIC);
        bspline_fit_columns(got.coef, 3 * n, n, BSPLINE_QUINTIC);
    }
    lp_taps_finish(&t);
    *m = got;
    return got.coef != NULL;
}

void lp_middle_finish(struct lp_middle *m)
{
    free(m->coef);
    *m = (struct lp_middle){0};
}
