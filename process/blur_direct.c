// blur_direct.c - rows are blurred along themselves into a ring as high as the kernel; each turn of
// ROWS new ones completes as many rows of the result.
//
// A round (blur, something per sample, blur) takes rows in lanes: neighbours along a row lie in
// neighbouring vectors, so that both directions are summed alike. Its rows never leave the second
// cache: an iteration of Richardson-Lucy reads u and the data once and writes u once.
#define _GNU_SOURCE
#include "process/blur_direct.h"
#include "core/mem.h"
#include "process/blur_passes.h"
#include <omp.h>
#include <stdlib.h>
#include <string.h>

enum {
    VEC = BLUR_VEC,
    LANES = BLUR_LANES,
    ROWS = BLUR_ROWS,
    STRIP_BYTES = 256 << 10, // of a ring, where the picture is taken in strips
    ROUND_BYTES = 1 << 20,   // of both rings of a round
};

static size_t round_up(int n, int to)
{
    return (size_t)((n + to - 1) / to * to);
}

// Rows blurred along themselves, and the window of them that ROWS rows of the result need.
struct ring {
    int h, radius, high;
    size_t stride;
    float *px;         // [high][stride], owned
    const float **row; // [2 radius + ROWS] window, owned
    int next;          // first row of the picture that is not yet in it
};

static void ring_init(struct ring *r, const struct direct *d, size_t stride)
{
    *r = (struct ring){.h = d->h, .radius = d->radius, .stride = stride};
    r->high = 2 * (d->radius + ROWS); // a round runs up to ROWS - 1 rows ahead
    r->px = xcalloc((size_t)r->high * stride, sizeof *r->px);
    r->row = xcalloc((size_t)(2 * r->radius + ROWS), sizeof *r->row);
}

static void ring_finish(struct ring *r)
{
    free(r->px);
    free(r->row);
}

static float *ring_slot(const struct ring *r, int j)
{
    return r->px + (size_t)(j % r->high) * r->stride;
}

// The first and last row of the picture that rows from j on need.
static int ring_from(const struct ring *r, int j)
{
    return j > r->radius ? j - r->radius : 0;
}
static int ring_needs(const struct ring *r, int j)
{
    const int last = j + ROWS - 1 + r->radius;
    return last < r->h ? last : r->h - 1;
}

static void ring_columns(struct ring *r, int j, const float *taps, float *out, size_t stride,
                         size_t n)
{
    for (int m = 0; m < 2 * r->radius + ROWS; m++)
        r->row[m] = ring_slot(r, blur_reflect(j - r->radius + m, r->h));
    column_pass(r->row, out, stride, n, taps, r->radius);
}

// A stretch of a row with `radius` neighbours on both sides, which beyond the picture reflect.
struct line {
    size_t margin; // radius, rounded up
    float *px;     // [margin + n + margin], owned
};

static void line_init(struct line *l, const struct direct *d, size_t n)
{
    l->margin = round_up(d->radius, VEC);
    l->px = aligned_alloc(64, (2 * l->margin + n) * sizeof *l->px);
    if (!l->px)
        abort();
}

static void line_take(struct line *l, const struct direct *d, const float *from, int left, int n)
{
    float *to = l->px + l->margin;
    const int r = d->radius, right = left + n + r < d->w ? n + r : d->w - left;
    copy_ahead(to, from + left, right, (size_t)(ROWS * d->w));
    for (int i = right; i < n + r; i++)
        to[i] = from[blur_reflect(left + i, d->w)];
    for (int i = -r; i < 0; i++)
        to[i] = from[blur_reflect(left + i, d->w)];
}

static void direct_tile(const struct direct *d, const float *in, int left, int n, int top,
                        int bottom, struct ring *r, struct line *l, float *done, blur_on_run *fn,
                        void *ctx)
{
    const size_t lanes = round_up(n, LANES);
    r->next = ring_from(r, top);
    for (int j = top; j < bottom; j += ROWS) {
        for (; r->next <= ring_needs(r, j); r->next++) {
            line_take(l, d, in + (size_t)r->next * (size_t)d->w, left, n);
            row_pass(l->px + l->margin - d->radius, ring_slot(r, r->next), lanes, d->taps,
                     d->radius);
        }
        ring_columns(r, j, d->taps, done, r->stride, lanes);
        for (int q = 0; q < ROWS && j + q < bottom; q++)
            fn(ctx, &(struct blur_run){left, j + q, n, false, done + (size_t)q * r->stride});
    }
}

// Rows of the same power of 2 would share cache lines.
static size_t stride_of(int n)
{
    return round_up(n, LANES) + VEC;
}

static size_t lanes_stride(const struct direct *d) // whole steps of both passes, and as above
{
    return (size_t)(VEC * (d->steps + 2 * ROWS)) / (2 * VEC) * (2 * VEC) + VEC;
}

// Rows are made in turns of ROWS from row 0 on, whatever the bands: each sum has one order.
static int band_top(const struct direct *d, int band, int bands)
{
    return band == bands ? d->h : (int)((long)d->h * band / bands) / ROWS * ROWS;
}

static int bands_of(const struct direct *d)
{
    const int most = d->h / (8 * (d->radius + 1)) + 1, threads = omp_get_max_threads();
    return threads < most ? threads : most;
}

void direct_apply(const struct direct *d, const float *in, blur_on_run *fn, void *ctx)
{
    const int fit = STRIP_BYTES / 4 / (2 * (d->radius + ROWS)) / LANES * LANES;
    const int strip = d->w < fit ? d->w : fit > LANES ? fit : LANES;
    const int strips = (d->w + strip - 1) / strip, bands = bands_of(d);
#pragma omp parallel
    {
        struct ring r;
        struct line l;
        ring_init(&r, d, stride_of(strip));
        line_init(&l, d, r.stride);
        float *done = xcalloc(ROWS * r.stride, sizeof *done);
#pragma omp for schedule(static) collapse(2)
        for (int band = 0; band < bands; band++)
            for (int s = 0; s < strips; s++)
                direct_tile(d, in, s * strip, strip < d->w - s * strip ? strip : d->w - s * strip,
                            band_top(d, band, bands), band_top(d, band + 1, bands), &r, &l, done,
                            fn, ctx);
        free(done);
        free(l.px);
        ring_finish(&r);
    }
}

// Rows in lanes: sample i of a row is lane i / steps of vector i % steps, so that neighbours along
// the row lie in neighbouring vectors and no load straddles cache lines. What the last lane has
// beyond the picture is padding.
void direct_order(const struct direct *d, const float *in, float *out)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < d->h; j++) {
        const float *from = in + (size_t)j * (size_t)d->w;
        float *to = out + (size_t)j * (size_t)(VEC * d->steps);
        for (int t = 0; t < d->steps; t++)
            for (int s = 0; s < VEC; s++, to++)
                *to = s * d->steps + t < d->w ? from[s * d->steps + t] : 0;
    }
}

void direct_unorder(const struct direct *d, const float *in, float *out)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < d->h; j++) {
        const float *from = in + (size_t)j * (size_t)(VEC * d->steps);
        float *to = out + (size_t)j * (size_t)d->w;
        for (int s = 0, i = 0; s < VEC; s++)
            for (int t = 0; t < d->steps && i < d->w; t++, i++)
                to[i] = from[VEC * t + s];
    }
}

// The padding of a row in lanes and `radius` vectors on both sides of it, by reflection.
static void reflect_lanes(const struct direct *d, float *row)
{
    const int n = d->steps, pad = VEC * n - d->w;
    float *last = row + VEC - 1; // the last lane
    for (int q = 0; q < pad; q++)
        last[VEC * (n - pad + q)] = last[VEC * (n - pad - 1 - q)];
    for (int q = 0; q < d->radius; q++) {
        float *left = row - VEC * (q + 1), *right = row + VEC * (n + q);
        memcpy(left + 1, row + VEC * (n - 1 - q), (VEC - 1) * sizeof *left);
        left[0] = row[VEC * q];
        memcpy(right, row + VEC * q + 1, (VEC - 1) * sizeof *right);
        right[VEC - 1] = last[VEC * (n - 1 - 2 * pad - q)];
    }
}

// What one thread needs for a round over its rows.
struct rounds {
    struct ring first, second;
    float *line; // [radius + steps + radius][VEC] and ROWS more
    float *mid;  // [ROWS] such lines of the first blur's result
    float *done; // [ROWS][stride]
    size_t line_stride;
};

static void round_band(const struct direct *d, const float *in, int top, int bottom,
                       struct rounds *s, blur_on_run *between, blur_on_run *fn, void *ctx)
{
    const int r = d->radius, n = VEC * d->steps, start = ring_from(&s->second, top) / ROWS * ROWS,
              end = bottom + r < d->h ? bottom + r : d->h;
    float *row = s->line + VEC * r;
    int j = top;
    s->first.next = ring_from(&s->first, start);
    for (int m = start; m < end; m += ROWS) {
        for (; s->first.next <= ring_needs(&s->first, m); s->first.next++) {
            copy_ahead(row, in + (size_t)s->first.next * (size_t)n, n, (size_t)(ROWS * n));
            reflect_lanes(d, row);
            lanes_pass(s->line, ring_slot(&s->first, s->first.next), d->steps, d->taps, r);
        }
        ring_columns(&s->first, m, d->taps, s->mid + VEC * r, s->line_stride, (size_t)n);
        for (int q = 0; q < ROWS && m + q < end; q++) {
            float *line = s->mid + (size_t)q * s->line_stride, *px = line + VEC * r;
            between(ctx, &(struct blur_run){0, m + q, n, m + q < top || m + q >= bottom, px});
            reflect_lanes(d, px);
            lanes_pass(line, ring_slot(&s->second, m + q), d->steps, d->taps, r);
        }
        const int ready = m + ROWS < end ? m + ROWS : end;
        for (; j < bottom && (ready == end || ring_needs(&s->second, j) < ready); j += ROWS) {
            ring_columns(&s->second, j, d->taps, s->done, s->second.stride, (size_t)n);
            for (int q = 0; q < ROWS && j + q < bottom; q++)
                fn(ctx,
                   &(struct blur_run){0, j + q, n, false, s->done + (size_t)q * s->second.stride});
        }
    }
}

struct store {
    const struct direct *d;
    blur_on_run *fn;
    void *ctx;
};

static void store_between(void *ctx, const struct blur_run *run)
{
    const struct store *s = ctx;
    s->fn(s->ctx, run);
    copy_ahead(s->d->mid + (size_t)run->j * (size_t)s->d->w + run->i, run->px, run->n, 0);
}

void direct_round(const struct direct *d, const float *in, blur_on_run *between, blur_on_run *fn,
                  void *ctx)
{
    if (!d->steps) {
        direct_apply(d, in, store_between, &(struct store){d, between, ctx});
        direct_apply(d, d->mid, fn, ctx);
        return;
    }
    const int bands = bands_of(d);
#pragma omp parallel
    {
        struct rounds s;
        const size_t stride = lanes_stride(d);
        ring_init(&s.first, d, stride);
        ring_init(&s.second, d, stride);
        s.line_stride = stride + 2 * VEC * (size_t)d->radius;
        s.line = xcalloc(s.line_stride, sizeof *s.line);
        s.mid = xcalloc(ROWS * s.line_stride, sizeof *s.mid);
        s.done = xcalloc(ROWS * stride, sizeof *s.done);
#pragma omp for schedule(static)
        for (int band = 0; band < bands; band++)
            round_band(d, in, band_top(d, band, bands), band_top(d, band + 1, bands), &s, between,
                       fn, ctx);
        free(s.line);
        free(s.mid);
        free(s.done);
        ring_finish(&s.first);
        ring_finish(&s.second);
    }
}

bool direct_init(struct direct *d, int w, int h, const double *k, int radius, struct err *e)
{
    *d = (struct direct){.w = w, .h = h, .radius = radius, .steps = (w + VEC - 1) / VEC};
    d->taps = xcalloc((size_t)(2 * radius + 1), sizeof *d->taps);
    for (int m = -radius; m <= radius; m++)
        d->taps[m + radius] = (float)k[abs(m)];
    // lanes reflect within the outermost ones, and pay where the rings stay in the cache
    const int pad = VEC * d->steps - w;
    const size_t rings = 4 * (size_t)(radius + ROWS) * lanes_stride(d) * sizeof(float);
    if (radius + 2 * pad > d->steps || rings > ROUND_BYTES) {
        d->steps = 0;
        d->mid = sample_alloc((size_t)w * (size_t)h, sizeof *d->mid, "blur", e);
        if (!d->mid)
            direct_finish(d);
        return d->mid;
    }
    return true;
}

void direct_finish(struct direct *d)
{
    free(d->taps);
    free(d->mid);
    *d = (struct direct){0};
}
