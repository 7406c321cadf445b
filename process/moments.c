// moments.c - windowed transforms of the Chebyshev polynomials of a height field.
#include "process/moments.h"
#include "core/mem.h"
#include "process/fft.h"
#include <complex.h>
#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

enum {
    ROWS = 8,   // rows a thread transforms before it writes: one cache line of a column
    BLOCK_K = 8 // polynomials in flight at once
};

static int origin(const struct bins *b) // where bin 0 stands: taps reach beyond -fine / 2
{
    return b->fine / 2 + TAPS;
}

void bins_init(struct bins *b, int nodes)
{
    const int fine = fft_good_size(2 * (nodes > TAPS ? nodes : TAPS));
    *b = (struct bins){.fine = fine, .slot = xcalloc(2 * (size_t)fine, sizeof(int))};
    for (int k = 0; k < 2 * fine; k++)
        b->slot[k] = -1;
}

void bins_need(struct bins *b, int first)
{
    for (int t = 0; t < TAPS; t++) {
        int *slot = b->slot + first + t + origin(b);
        b->kept += *slot < 0;
        *slot = 0;
    }
}

void bins_close(struct bins *b)
{
    b->kept = 0;
    for (int k = 0; k < 2 * b->fine; k++)
        if (b->slot[k] >= 0)
            b->slot[k] = b->kept++;
}

int bins_slot(const struct bins *b, int first)
{
    return b->slot[first + origin(b)];
}

void bins_finish(struct bins *b)
{
    free(b->slot);
    *b = (struct bins){0};
}

// The bins in slot order.
static int *bins_list(const struct bins *b)
{
    int *list = xcalloc((size_t)b->kept + 1, sizeof *list);
    for (int k = 0; k < 2 * b->fine; k++)
        if (b->slot[k] >= 0)
            list[b->slot[k]] = k - origin(b);
    return list;
}

static int block_of(int count)
{
    return count < BLOCK_K ? count : BLOCK_K;
}

size_t moments_bytes(const struct patch *p, int count, int cols, int rows)
{
    const size_t c = (size_t)cols, k = (size_t)count;
    return c * (size_t)rows * 2 * k * sizeof(float) +
           c * (size_t)block_of(count) * (size_t)p->ny * sizeof(float complex);
}

struct pass { // one block of polynomials
    const struct patch *p;
    struct moments *m;
    struct fft *row, *col;
    const int *bin_x, *bin_y;
    double *scale_x, *scale_y; // window times interpolation correction
    float complex *half;       // [x.kept][block][ny] after the transforms along x
    int k0, block;
};

// T_k0 and T_k0+1 of one row; the recurrence carries on from there, at most BLOCK_K steps.
static void start_row(const struct pass *s, int j, double *x, double *before, double *now)
{
    const struct patch *p = s->p;
    const float *z = p->z + (size_t)j * (size_t)p->stride;
    const double scale = p->half_m > 0 ? 1 / p->half_m : 0;
    for (int i = 0; i < p->nx; i++) {
        x[i] = fmax(-1, fmin(1, (z[i] - p->mid_m) * scale));
        const double angle = acos(x[i]);
        before[i] = cos(abs(s->k0 - 1) * angle);
        now[i] = cos(s->k0 * angle);
    }
}

static void run_rows(const struct pass *s, int first, double *poly, float *real,
                     float complex *spec, float complex *tile)
{
    const struct patch *p = s->p;
    const int nx = p->nx, fine = s->m->x.fine, kept = s->m->x.kept;
    const int rows = p->ny - first < ROWS ? p->ny - first : ROWS;
    for (int r = 0; r < rows; r++)
        start_row(s, first + r, poly + 3 * r * nx, poly + (3 * r + 1) * nx,
                  poly + (3 * r + 2) * nx);
    for (int d = 0; d < s->block; d++) {
        for (int r = 0; r < rows; r++) {
            double *x = poly + 3 * r * nx, *before = x + nx, *now = before + nx;
            memset(real, 0, (size_t)fine * sizeof *real);
            for (int i = 0; i < nx; i++) {
                const int at = i - p->centre_x;
                real[at < 0 ? at + fine : at] =
                    (float)(now[i] * s->scale_x[i] * s->scale_y[first + r]);
                const double next = 2 * x[i] * now[i] - before[i];
                before[i] = now[i];
                now[i] = next;
            }
            fft_run(s->row, real, spec);
            for (int c = 0; c < kept; c++) {
                const int bin = s->bin_x[c];
                tile[r * kept + c] = bin < 0          ? conjf(spec[-bin])
                                     : bin > fine / 2 ? conjf(spec[fine - bin])
                                                      : spec[bin];
            }
        }
        for (int c = 0; c < kept; c++) {
            float complex *to = s->half + (size_t)(c * s->block + d) * (size_t)p->ny + first;
            for (int r = 0; r < rows; r++)
                to[r] = tile[r * kept + c];
        }
    }
}

static void run_column(const struct pass *s, int c, float complex *in, size_t stride)
{
    const struct patch *p = s->p;
    const struct moments *m = s->m;
    const int fine = m->y.fine, rows = m->y.kept, count = m->count;
    float complex *out = in + stride; // [block][stride]
    for (int d = 0; d < s->block; d++) {
        const float complex *from = s->half + (size_t)(c * s->block + d) * (size_t)p->ny;
        memset(in, 0, (size_t)fine * sizeof *in);
        for (int j = 0; j < p->ny; j++) {
            const int at = j - p->centre_y;
            in[at < 0 ? at + fine : at] = from[j];
        }
        fft_run(s->col, in, out + (size_t)d * stride);
    }
    float *value = m->value + (size_t)c * (size_t)rows * 2 * (size_t)count;
    for (int r = 0; r < rows; r++, value += 2 * count) {
        const int bin = ((s->bin_y[r] % fine) + fine) % fine;
        for (int d = 0; d < s->block; d++) {
            const int k = s->k0 + d, slot = k % 2 ? m->evens + k / 2 : k / 2;
            const float complex v = out[(size_t)d * stride + (size_t)bin];
            value[slot] = crealf(v);
            value[count + slot] = cimagf(v);
        }
    }
}

static double *axis_scale(const double *window, int nodes, int centre, int fine)
{
    double *scale = xcalloc((size_t)nodes, sizeof *scale);
    for (int i = 0; i < nodes; i++)
        scale[i] = window[i] * taps_correction(fine, i - centre);
    return scale;
}

// Scratch of one thread is cut from one block: polynomials, real row, its transform and a tile of
// columns for the rows; then one column and its transforms. Every part is 64-byte aligned.
static size_t aligned(size_t samples)
{
    return (samples + 7) / 8 * 8;
}

static bool run_passes(struct pass *s, struct err *e)
{
    const struct patch *p = s->p;
    struct moments *m = s->m;
    const size_t poly = aligned(ROWS * 3 * (size_t)p->nx); // a double is as large as a complex
    const size_t real = poly + aligned((size_t)m->x.fine), spec = real + aligned((size_t)m->x.fine);
    const size_t rows = spec + aligned(ROWS * (size_t)m->x.kept);
    const size_t column = aligned((size_t)m->y.fine), cols = (BLOCK_K + 1) * column;
    const size_t each = rows > cols ? rows : cols;
    float complex *scratch =
        sample_alloc(each * (size_t)omp_get_max_threads(), sizeof *scratch, "FFT rows", e);
    if (!scratch)
        return false;
    for (s->k0 = 0; s->k0 < m->count; s->k0 += BLOCK_K) {
        s->block = block_of(m->count - s->k0);
#pragma omp parallel
        {
            float complex *mine = scratch + each * (size_t)omp_get_thread_num();
#pragma omp for schedule(dynamic)
            for (int first = 0; first < p->ny; first += ROWS)
                run_rows(s, first, (double *)mine, (float *)(mine + poly), mine + real,
                         mine + spec);
#pragma omp for schedule(dynamic)
            for (int c = 0; c < m->x.kept; c++)
                run_column(s, c, mine, column);
        }
    }
    free(scratch);
    return true;
}

bool moments_fill(struct moments *m, const struct patch *p, int count, struct err *e)
{
    m->count = count;
    m->evens = (count + 1) / 2;
    const size_t cols = (size_t)m->x.kept, rows = (size_t)m->y.kept;
    struct pass s = {.p = p, .m = m, .bin_x = bins_list(&m->x), .bin_y = bins_list(&m->y)};
    s.scale_x = axis_scale(p->gx, p->nx, p->centre_x, m->x.fine);
    s.scale_y = axis_scale(p->gy, p->ny, p->centre_y, m->y.fine);
    s.row = fft_new(FFT_R2C, FFT_FLOAT, 1, m->x.fine, 1, false, e);
    s.col = s.row ? fft_new(FFT_FORWARD, FFT_FLOAT, 1, m->y.fine, 1, false, e) : NULL;
    free(m->value);
    m->value = s.col ? sample_alloc(cols * rows, 2 * (size_t)count * sizeof *m->value,
                                    "transforms of the height field", e)
                     : NULL;
    s.half = m->value ? sample_alloc(cols * (size_t)block_of(count), (size_t)p->ny * sizeof *s.half,
                                     "transforms of the height field", e)
                      : NULL;
    const bool ok = s.half && run_passes(&s, e);
    free(s.half);
    fft_free(s.row);
    fft_free(s.col);
    free((int *)s.bin_x);
    free((int *)s.bin_y);
    free(s.scale_x);
    free(s.scale_y);
    return ok;
}

void moments_finish(struct moments *m)
{
    if (!m)
        return;
    bins_finish(&m->x);
    bins_finish(&m->y);
    free(m->value);
    *m = (struct moments){0};
}
