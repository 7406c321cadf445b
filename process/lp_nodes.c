// lp_nodes.c - reads rings and middle at the nodes, a row or column of nodes at a time.
//
// All nodes of a column in sectors +-x lie on one square (a = |x|), so the six rows of coefficients
// around it are blended once into a line, and every node reads six samples of that line. Sectors
// +-y do the same with rows of nodes, and so does the middle.
#define _GNU_SOURCE
#include "core/mem.h"
#include "process/bspline.h"
#include "process/lp_ring.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef float color4 __attribute__((vector_size(16)));

// A line of samples that nodes read: node x reads at position x scale + offset.
struct line {
    color4 *value; // [room] three channels and a spare
    uint8_t *live; // per LP_BLOCK samples
    bool any;      // any live
    double scale, offset;
};

enum {
    COLUMNS = 8
}; // of nodes that go together: their lines fit the cache, their writes a cache line

static struct line line_new(size_t room)
{
    return (struct line){.value = xcalloc(room, sizeof(color4)), .live = xcalloc(room, 1)};
}

static void line_finish(struct line *l)
{
    free(l->value);
    free(l->live);
}

// value[k] = sum over b < 6 of w[b] (r[b][k], r[b][n + k], r[b][2 n + k])
__attribute__((target_clones("avx512f", "avx2", "default"))) static void
blend(const float *const r[6], const float w[6], int n, int from, int to, color4 *value)
{
    for (int k = from; k < to; k++) {
        color4 sum = {0};
        for (int b = 0; b < 6; b++)
            sum += w[b] * (color4){r[b][k], r[b][n + k], r[b][2 * n + k], 0};
        value[k] = sum;
    }
}

// The line of sector `sector` at distance a along its axis.
static void ring_line(const struct lp_ring *r, int sector, double a, struct line *l)
{
    const double at = (log(a) - r->ln_first) / r->step;
    const int i = at < 2 ? 2 : at < r->rows - 4 ? (int)at : r->rows - 4; // a_low may round to 1.99
    const int blocks = r->rays / LP_BLOCK;
    float w[6];
    bspline_weights_5((float)(at - i), w);
    const float *row[6];
    for (int b = 0; b < 6; b++)
        row[b] = r->coef + (size_t)(sector * r->rows + i - 2 + b) * 3 * (size_t)r->rays;
    const uint8_t *live = r->live + (size_t)(sector * r->rows + i - 2) * (size_t)blocks;
    l->any = false;
    for (int k = 0; k < blocks; k++) {
        uint8_t any = 0;
        for (int b = 0; b < 6; b++)
            any |= live[b * blocks + k];
        l->live[k] = any;
        if (any) {
            blend(row, w, r->rays, k * LP_BLOCK, (k + 1) * LP_BLOCK, l->value);
            l->any = true;
        } else
            memset(l->value + k * LP_BLOCK, 0, LP_BLOCK * sizeof *l->value);
    }
    l->scale = r->half / a;
    l->offset = r->middle;
}

static void middle_line(const struct lp_middle *m, double y, struct line *l)
{
    const double at = y * m->per_px + m->middle;
    const int j = (int)at;
    float w[6];
    bspline_weights_5((float)(at - j), w);
    const float *row[6];
    for (int b = 0; b < 6; b++)
        row[b] = m->coef + (size_t)(j - 2 + b) * 3 * (size_t)m->n;
    blend(row, w, m->n, 0, m->n, l->value);
    memset(l->live, 1, (size_t)m->n / LP_BLOCK + 1);
    l->any = true;
    l->scale = m->per_px;
    l->offset = m->middle;
}

// The node at x of a line, into `out` and `twin`; 1 when there is no signal.
static inline long read_node(const struct line *l, double x, float *out, float *twin)
{
    const double at = x * l->scale + l->offset;
    const int i = (int)at;
    if (!(l->live[(i - 2) / LP_BLOCK] | l->live[(i + 3) / LP_BLOCK]))
        return 1;
    float w[6];
    bspline_weights_5((float)(at - i), w);
    const color4 *v = l->value + i - 2;
    const color4 sum =
        w[0] * v[0] + w[1] * v[1] + w[2] * v[2] + w[3] * v[3] + w[4] * v[4] + w[5] * v[5];
    memcpy(out, &sum, 3 * sizeof *out);
    memcpy(twin, &sum, 3 * sizeof *twin);
    return 0;
}

// The ring that holds distance a; n_rings when none does.
static int ring_of(const struct lp_ring *rings, int n_rings, double a)
{
    int q = 0;
    if (n_rings == 0 || a > rings[0].a_high * (1 + 1e-12))
        return n_rings;
    while (q < n_rings && a < rings[q].a_low)
        q++;
    return q;
}

struct job {
    const struct lp_ring *rings;
    int n_rings;
    const struct lp_middle *middle;
    const struct lp_nodes *nodes;
    bool symmetric;
    float *out;
};

static inline float *node_at(const struct job *job, int i, int j)
{
    return job->out + ((size_t)j * (size_t)job->nodes->n + (size_t)i) * 3;
}

// The node opposite to (i, j) where it is its copy, else the node itself.
static inline float *twin_of(const struct job *job, int i, int j)
{
    const int last = job->nodes->n - 1;
    return job->symmetric ? node_at(job, last - i, last - j) : node_at(job, i, j);
}

// Sectors +-x: columns i0 .. i1 - 1, all on one side; node (i, j) with |x_j| <= |x_i|.
static long read_columns(const struct job *job, int i0, int i1, struct line lines[COLUMNS])
{
    const struct lp_nodes *nodes = job->nodes;
    const int n = nodes->n, sector = nodes->x[i0] > 0 ? 0 : 2;
    long empty = 0;
    bool has[COLUMNS];
    for (int i = i0; i < i1; i++) {
        const double a = fabs(nodes->x[i]);
        const int q = ring_of(job->rings, job->n_rings, a);
        has[i - i0] = q < job->n_rings;
        if (has[i - i0])
            ring_line(&job->rings[q], sector, a, &lines[i - i0]);
        has[i - i0] &= lines[i - i0].any;
        const long count = abs(2 * i - (n - 1)) + 1; // nodes of this column in the sector
        empty += has[i - i0] ? 0 : count;
    }
    for (int j = 0; j < n; j++)
        for (int i = i0; i < i1; i++)
            if (has[i - i0] && abs(2 * j - (n - 1)) <= abs(2 * i - (n - 1)))
                empty +=
                    read_node(&lines[i - i0], nodes->x[j], node_at(job, i, j), twin_of(job, i, j));
    return empty;
}

// Sectors +-y: row j, node (i, j) with |x_i| < |x_j|.
static long read_row(const struct job *job, int j, struct line *l)
{
    const struct lp_nodes *nodes = job->nodes;
    const int n = nodes->n, other = n - 1 - j;
    const double a = fabs(nodes->x[j]);
    const int first = (j < other ? j : other) + 1, last = (j > other ? j : other) - 1;
    const int q = ring_of(job->rings, job->n_rings, a);
    if (q == job->n_rings)
        return last - first + 1;
    ring_line(&job->rings[q], nodes->x[j] > 0 ? 1 : 3, a, l);
    if (!l->any)
        return last - first + 1;
    long empty = 0;
    for (int i = first; i <= last; i++)
        empty += read_node(l, nodes->x[i], node_at(job, i, j), twin_of(job, i, j));
    return empty;
}

// Row j of the nodes inside the last ring.
static void read_middle(const struct job *job, int j, int first, int last, struct line *l)
{
    const struct lp_nodes *nodes = job->nodes;
    middle_line(job->middle, nodes->x[j], l);
    for (int i = first; i <= last; i++)
        read_node(l, nodes->x[i], node_at(job, i, j), node_at(job, i, j));
}

long lp_read_nodes(const struct lp_ring *rings, int n_rings, const struct lp_middle *middle,
                   const struct lp_nodes *nodes, bool symmetric, float *out)
{
    const struct job job = {rings, n_rings, middle, nodes, symmetric, out};
    size_t room = (size_t)middle->n + LP_BLOCK;
    for (int q = 0; q < n_rings; q++)
        room = (size_t)rings[q].rays > room ? (size_t)rings[q].rays : room;
    const int n = nodes->n;
    int side = 0; // nodes side .. n - 1 - side of a row are inside the last ring
    while (side < n / 2 && fabs(nodes->x[side]) > middle->a_high)
        side++;
    const int blocks = (side + COLUMNS - 1) / COLUMNS, halves = symmetric ? 1 : 2;
    long empty = 0;
#pragma omp parallel reduction(+ : empty)
    {
        struct line lines[COLUMNS];
        for (int k = 0; k < COLUMNS; k++)
            lines[k] = line_new(room);
#pragma omp for schedule(dynamic) nowait
        for (int b = 0; b < halves * blocks; b++) {
            const int i0 = b / halves * COLUMNS, i1 = i0 + COLUMNS < side ? i0 + COLUMNS : side;
            empty += b % halves ? read_columns(&job, i0, i1, lines)
                                : read_columns(&job, n - i1, n - i0, lines);
        }
#pragma omp for schedule(dynamic, 8) nowait
        for (int j = 0; j < halves * side; j++)
            empty += read_row(&job, j < side ? n - 1 - j : j - side, lines);
#pragma omp for schedule(dynamic, 8)
        for (int j = side; j < n - side; j++)
            read_middle(&job, j, side, n - 1 - side, lines);
        for (int k = 0; k < COLUMNS; k++)
            line_finish(&lines[k]);
    }
    return symmetric ? 2 * empty : empty;
}
