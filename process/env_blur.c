// env_blur.c - one-dimensional filters along great circles of a lat-long map.
#define _GNU_SOURCE
#include "process/env_blur.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    BLOCK = 128,
    TILE = 24
}; // columns and rows done together, so that what they read stays near

bool wide_init(struct wide *m, int w, int h, struct err *e)
{
    *m = (struct wide){.w = w, .h = h, .line = ((size_t)w * 2 + BLOCK + 16) / 16 * 16};
    m->px = sample_alloc(3 * (size_t)(h + 2) * m->line, sizeof *m->px, "map", e);
    return m->px != NULL;
}

void wide_finish(struct wide *m)
{
    free(m->px);
    *m = (struct wide){0};
}

static float *wide_row(const struct wide *m, int c, int j)
{
    return m->px + ((size_t)c * (size_t)(m->h + 2) + (size_t)(j + 1)) * m->line;
}

static void wide_close(struct wide *m)
{
    const size_t w = (size_t)m->w;
#pragma omp parallel for
    for (int k = 0; k < 3 * m->h; k++) {
        float *row = wide_row(m, k / m->h, k % m->h);
        for (size_t i = w; i < m->line; i++)
            row[i] = row[i - w];
    }
    for (int c = 0; c < 3; c++)
        for (int pole = 0; pole < 2; pole++) { // seen from the other side: half a turn on
            const float *from = wide_row(m, c, pole ? m->h - 1 : 0);
            float *to = wide_row(m, c, pole ? m->h : -1);
            for (size_t i = 0; i < m->line; i++)
                to[i] = from[(i + w / 2) % w];
        }
}

void wide_take(struct wide *m, const struct image *im)
{
#pragma omp parallel for
    for (int j = 0; j < m->h; j++)
        for (int c = 0; c < 3; c++) {
            const float *from = im->px + (size_t)j * (size_t)m->w * 3 + c;
            float *row = wide_row(m, c, j);
            for (int i = 0; i < m->w; i++)
                row[i] = from[3 * i];
        }
    wide_close(m);
}

void wide_give(const struct wide *m, float scale, struct image *im)
{
#pragma omp parallel for
    for (int j = 0; j < m->h; j++)
        for (int c = 0; c < 3; c++) {
            float *to = im->px + (size_t)j * (size_t)m->w * 3 + c;
            const float *row = wide_row(m, c, j);
            for (int i = 0; i < m->w; i++)
                to[3 * i] = fmaxf(0, scale * row[i]);
        }
}

// A pixel read for every column of a row: a row and a shift, the weight of each channel.
struct cell {
    int row, shift;
    float weight[3];
};

static int by_place(const void *a_, const void *b_)
{
    const struct cell *a = a_, *b = b_;
    return a->row != b->row ? a->row - b->row : a->shift - b->shift;
}

static void add_cell(struct cell *c, int row, int shift, const float rgb[3], double weight)
{
    *c = (struct cell){row, shift, {0}};
    for (int k = 0; k < 3; k++)
        c->weight[k] = (float)weight * rgb[k];
}

// What row j reads, in the order of rows and shifts, at most 4 n cells.
static int row_cells(const struct env_taps *t, const double axis[2], int w, int h, int j,
                     struct cell *cell)
{
    const double th = M_PI * (j + .5) / h;
    const struct vec3 r = v3(0, cos(th), -sin(th)), right = v3(1, 0, 0);
    const struct vec3 down = v3(0, -sin(th), -cos(th));
    const struct vec3 a = v3_add(v3_scale(axis[0], right), v3_scale(axis[1], down));
    for (int k = 0; k < t->n; k++) {
        // Algorithm 2: the half vector is (h, 0, 1 + sqrt(1 - h^2)) along a and r; wi = h - r.
        const double u = (double)t->h[k];
        const struct vec3 wi = v3_add(v3_scale(u, a), v3_scale(sqrt(1 - u * u), r));
        double col, row;
        latlong_pixel(wi, w, h, &col, &row);
        const double x = col - (.5 * w - .5) + w; // from this pixel's own column
        const int y0 = (int)floor(row), x0 = (int)floor(x);
        const double fy = row - y0, fx = x - x0;
        const float *rgb = t->rgb + 3 * k;
        add_cell(&cell[4 * k], y0, x0 % w, rgb, (1 - fy) * (1 - fx));
        add_cell(&cell[4 * k + 1], y0, (x0 + 1) % w, rgb, (1 - fy) * fx);
        add_cell(&cell[4 * k + 2], y0 + 1, x0 % w, rgb, fy * (1 - fx));
        add_cell(&cell[4 * k + 3], y0 + 1, (x0 + 1) % w, rgb, fy * fx);
    }
    qsort(cell, (size_t)t->n * 4, sizeof *cell, by_place);
    int n = 0;
    for (int k = 0; k < 4 * t->n; k++)
        if (n && !by_place(&cell[n - 1], &cell[k]))
            for (int c = 0; c < 3; c++)
                cell[n - 1].weight[c] += cell[k].weight[c];
        else
            cell[n++] = cell[k];
    return n;
}

// Vectors written out: the compiler's own unrolling of the loop over cells goes through memory.
typedef float lanes __attribute__((vector_size(64)));
typedef float loose __attribute__((vector_size(64), aligned(4))); // the same anywhere in a row
enum { LANES = sizeof(lanes) / sizeof(float), VECTORS = BLOCK / LANES };

__attribute__((target_clones("avx512f", "avx2", "default"))) static void
blur_block(const struct wide *m, const struct cell *cell, int n, int c, int i, float *sum)
{
    const float *plane = wide_row(m, c, 0) + i;
    lanes acc[VECTORS] = {0};
    for (int k = 0; k < n; k++) {
        const loose *a = (const loose *)(plane + (ptrdiff_t)m->line * cell[k].row + cell[k].shift);
        for (int x = 0; x < VECTORS; x++)
            acc[x] += cell[k].weight[c] * a[x];
    }
    memcpy(sum, acc, sizeof acc);
}

static void blur_tile(const struct wide *in, struct cell *const *cell, const int *count, int j0,
                      int rows, bool add, const struct wide *out)
{
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < in->w; i += BLOCK)
            for (int j = 0; j < rows; j++) {
                float sum[BLOCK], *to = wide_row(out, c, j0 + j) + i;
                blur_block(in, cell[j], count[j], c, i, sum);
                const int used = in->w - i < BLOCK ? in->w - i : BLOCK;
                for (int x = 0; x < used; x++)
                    to[x] = add ? to[x] + sum[x] : sum[x];
            }
}

bool env_blur(const struct wide *in, const struct env_taps *t, const double axis[2], bool add,
              struct wide *out, struct err *e)
{
    bool ok = true;
#pragma omp parallel
    {
        struct err mine = {0};
        const size_t room = 4 * (size_t)t->n + 1;
        struct cell *cells = sample_alloc(TILE * room, sizeof *cells, "filter", &mine);
#pragma omp for schedule(dynamic)
        for (int j = 0; j < in->h; j += TILE) {
            struct cell *cell[TILE];
            int count[TILE];
            const int rows = in->h - j < TILE ? in->h - j : TILE;
            for (int k = 0; k < rows && cells; k++) {
                cell[k] = cells + (size_t)k * room;
                count[k] = row_cells(t, axis, in->w, in->h, j + k, cell[k]);
            }
            if (cells)
                blur_tile(in, cell, count, j, rows, add, out);
        }
        if (!cells) {
#pragma omp critical
            {
                ok = false;
                *e = mine;
            }
        }
        free(cells);
    }
    if (ok)
        wide_close(out);
    return ok;
}
