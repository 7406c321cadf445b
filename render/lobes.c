// lobes.c - integrals of a pattern around its nodes, and the cells that share them.
#define _GNU_SOURCE
#include "render/lobes.h"
#include "core/mem.h"
#include "render/cut.h"
#include <stdlib.h>
#include <string.h>

enum { SLIT_NODES = 513, BINS_MOST = 1024 };

// The pattern at n x n nodes, and what a node stands for along each side.
struct nodes {
    int n, count;
    const float *tab;          // [count][n][n][3]
    double *at, *width, *edge; // [n], [n], [n + 1]
};

// The integral of the hat that linear interpolation between nodes makes of one: exact for what
// material_diffraction() reads, up to Simpson's rule over u = R s^p.
static double hat(const struct table *t, int i)
{
    enum { STEPS = 8 };
    double sum = 0;
    for (int side = -1; side < 2; side += 2)
        for (int k = 0; k <= STEPS && i + side >= 0 && i + side < t->n; k++) {
            const double x = (double)k / STEPS, s = 2 * (i + side * x) / (t->n - 1) - 1;
            const double slope = t->range * t->power * pow(fabs(s), t->power - 1) * 2 / (t->n - 1);
            sum += (k == 0 || k == STEPS ? 1 : k % 2 ? 4 : 2) * (1 - x) * slope / (3 * STEPS);
        }
    return sum;
}

static void nodes_init(struct nodes *s, const struct table *t)
{
    *s = (struct nodes){.n = t->n, .count = t->count, .tab = t->tab};
    s->at = xcalloc((size_t)t->n, sizeof *s->at);
    s->width = xcalloc((size_t)t->n, sizeof *s->width);
    s->edge = xcalloc((size_t)t->n + 1, sizeof *s->edge);
    for (int i = 0; i < t->n; i++) {
        s->at[i] = table_node(t, i);
        s->width[i] = hat(t, i);
        s->edge[i + 1] = i < t->n - 1 ? (s->at[i] + table_node(t, i + 1)) / 2 : t->range;
    }
    s->edge[0] = -t->range;
}

static void nodes_finish(struct nodes *s)
{
    free(s->at);
    free(s->width);
    free(s->edge);
}

static const float *node(const struct nodes *s, int m, int i, int j)
{
    const size_t n = (size_t)s->n;
    return s->tab + (((size_t)m * n + (size_t)j) * n + (size_t)i) * 3;
}

// How much depends on a node: of L tables, whose weights change over w, the sum of all sizes.
static double power_at(const struct nodes *s, int i, int j)
{
    double sum = 0;
    for (int m = 0; m < s->count; m++) {
        const float *px = node(s, m, i, j);
        sum += fabs((double)px[0]) + fabs((double)px[1]) + fabs((double)px[2]);
    }
    return sum * s->width[i] * s->width[j];
}

static void describe(const struct nodes *s, const struct cut_part *p, float *cell)
{
    double all = 0, u = 0, v = 0, square = 0;
    double *sum = xcalloc((size_t)s->count * 3, sizeof *sum);
    for (int j = p->j; j < p->j + p->h; j++)
        for (int i = p->i; i < p->i + p->w; i++) {
            const double power = power_at(s, i, j) + 1e-300, x = s->at[i], y = s->at[j];
            all += power;
            u += power * x;
            v += power * y;
            square += power *
                      (x * x + y * y + (s->width[i] * s->width[i] + s->width[j] * s->width[j]) / 6);
            for (int c = 0; c < 3 * s->count; c++)
                sum[c] += (double)node(s, c / 3, i, j)[c % 3] * s->width[i] * s->width[j];
        }
    u /= all;
    v /= all;
    cell[0] = (float)u;
    cell[1] = (float)v;
    cell[2] = (float)sqrt(fmax(0, square / all - u * u - v * v) / 2);
    for (int c = 0; c < 3 * s->count; c++)
        cell[3 + c] = (float)(p->share * sum[c]);
    free(sum);
}

// Tables of many nodes are cut by blocks of `step` of them.
static void bin(const struct nodes *s, int step, struct cut_grid *g, double *power, double *edge)
{
    const int n = (s->n + step - 1) / step;
    for (int j = 0; j < s->n; j++)
        for (int i = 0; i < s->n; i++)
            power[(size_t)(j / step) * (size_t)n + (size_t)(i / step)] += power_at(s, i, j);
    for (int k = 0; k <= n; k++)
        edge[k] = s->edge[k * step < s->n ? k * step : s->n];
    *g = (struct cut_grid){.w = n, .h = n, .power = power, .x = edge, .y = edge};
}

static bool cut_nodes(struct lobes *l, const struct nodes *s, int n, int parts, struct err *e)
{
    const int step = (s->n + BINS_MOST - 1) / BINS_MOST, side = (s->n + step - 1) / step;
    const size_t rows = (size_t)n * (size_t)parts, row = (size_t)(1 + s->count) * 3;
    struct cut_grid g;
    struct cut_part *part = sample_alloc(rows, sizeof *part, "cells", e);
    double *power = sample_alloc((size_t)side * (size_t)side, sizeof *power, "cells", e);
    double *edge = xcalloc((size_t)s->n + 1, sizeof *edge);
    l->count = s->count;
    l->cell = sample_alloc(rows * row, sizeof *l->cell, "cells", e);
    int cells = -1;
    if (part && power && l->cell) {
        bin(s, step, &g, power, edge);
        cells = cut_cells(&g, n, parts, part, e);
    }
    l->n = cells < 0 ? 0 : cells * parts;
#pragma omp parallel for schedule(dynamic, 16)
    for (int k = 0; k < l->n; k++) {
        struct cut_part p = part[k];
        p.i *= step;
        p.j *= step;
        p.w = (p.i + p.w * step < s->n ? p.i + p.w * step : s->n) - p.i;
        p.h = (p.j + p.h * step < s->n ? p.j + p.h * step : s->n) - p.j;
        describe(s, &p, l->cell + (size_t)k * row);
    }
    free(power);
    free(edge);
    free(part);
    return cells >= 0;
}

// Slits have no nodes: some that are dense where orders are. A single row is summed once for all v.
static bool tabulate(const struct slits *s, struct table *t, struct err *e)
{
    if (!table_init(t, SLIT_NODES, 2, 3, 1, e))
        return false;
    const bool alone = !slits_are_crossed(s) && !s->row[0].radial;
#pragma omp parallel for schedule(dynamic, 8)
    for (int i = 0; i < SLIT_NODES; i++) {
        double rgb[3];
        if (alone)
            slits_row(s, table_node(t, i), rgb);
        for (int j = 0; j < SLIT_NODES; j++) {
            const double v = table_node(t, j) / s->across;
            if (!alone)
                slits_eval(s, table_node(t, i), table_node(t, j), rgb);
            const double across = alone ? exp(-v * v / 2) / (sqrt(2 * M_PI) * s->across) : 1;
            for (int c = 0; c < 3; c++)
                t->tab[((size_t)j * SLIT_NODES + (size_t)i) * 3 + (size_t)c] =
                    (float)(across * rgb[c]);
        }
    }
    return true;
}

bool lobes_init(struct lobes *l, const struct material *m, enum diffraction kind, int n, int parts,
                struct err *e)
{
    struct table slits = {0};
    struct nodes s;
    *l = (struct lobes){0};
    if (kind == DIFFRACTION_SLITS && !tabulate(&m->slits, &slits, e))
        return false;
    nodes_init(&s, slits.n ? &slits : &m->table);
    const bool ok = cut_nodes(l, &s, n, parts, e);
    nodes_finish(&s);
    table_finish(&slits);
    if (!ok)
        lobes_finish(l);
    return ok;
}

void lobes_finish(struct lobes *l)
{
    free(l->cell);
    *l = (struct lobes){0};
}

bool lobes_pick(const struct lobes *all, int parts, int which, struct lobes *l, struct err *e)
{
    const int n = all->n / parts;
    const size_t row = (size_t)(1 + all->count) * 3;
    float *cell = sample_alloc((size_t)n * row, sizeof *cell, "cells", e);
    if (!cell)
        return false;
    for (int k = 0; k < n; k++) {
        float *to = cell + (size_t)k * row;
        memcpy(to, lobes_cell(all, k * parts + (which + 29 * k) % parts), row * sizeof *to);
        for (size_t c = 3; c < row; c++)
            to[c] *= (float)parts;
    }
    *l = (struct lobes){n, all->count, cell};
    return true;
}
