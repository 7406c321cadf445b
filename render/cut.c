// cut.c - rectangles over a summed-area table, so that a cut costs a bisection.
#include "render/cut.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

struct cutter {
    const struct cut_grid *grid;
    double *sum; // [h + 1][w + 1] power above and left of each corner
};

static double power_of(const struct cutter *c, int i, int j, int w, int h)
{
    const size_t row = (size_t)c->grid->w + 1, top = (size_t)j * row, low = (size_t)(j + h) * row;
    const double all = c->sum[low + (size_t)(i + w)] - c->sum[low + (size_t)i] -
                       c->sum[top + (size_t)(i + w)] + c->sum[top + (size_t)i];
    return fmax(0, all);
}

static void extent_of(const struct cut_grid *g, const struct cut_part *p, double *across,
                      double *down)
{
    *across = (g->x[p->i + p->w] - g->x[p->i]) * (g->slant ? g->slant[p->j + p->h / 2] : 1);
    *down = g->y[p->j + p->h] - g->y[p->j];
}

// Cuts off the first `part` of the power, across the longer side.
static void cut(const struct cutter *c, struct cut_part *p, struct cut_part *rest, double part)
{
    double wide, high;
    extent_of(c->grid, p, &wide, &high);
    const bool across = p->h < 2 || (p->w > 1 && wide > high);
    int lo = 1, hi = (across ? p->w : p->h) - 1;
    while (lo < hi) { // the first k at which that much lies before it
        const int k = (lo + hi) / 2;
        const double before =
            across ? power_of(c, p->i, p->j, k, p->h) : power_of(c, p->i, p->j, p->w, k);
        if (before < part * p->power)
            lo = k + 1;
        else
            hi = k;
    }
    *rest = *p;
    if (across) {
        rest->i += lo;
        rest->w -= lo;
        p->w = lo;
    } else {
        rest->j += lo;
        rest->h -= lo;
        p->h = lo;
    }
    p->power = power_of(c, p->i, p->j, p->w, p->h);
    rest->power = power_of(c, rest->i, rest->j, rest->w, rest->h);
}

static void divide(const struct cutter *c, struct cut_part p, int parts, struct cut_part *out)
{
    if (parts == 1 || p.w * p.h == 1) {
        p.share = 1.0 / parts;
        for (int k = 0; k < parts; k++)
            out[k] = p;
        return;
    }
    struct cut_part rest;
    const int first = parts / 2;
    cut(c, &p, &rest, (double)first / parts);
    divide(c, p, first, out);
    divide(c, rest, parts - first, out + first);
}

static double urgency(const struct cut_grid *g, const struct cut_part *p)
{
    double across, down;
    extent_of(g, p, &across, &down);
    return p->w * p->h > 1 ? p->power * fmax(across, down) : 0;
}

static int cut_all(const struct cutter *c, int most, struct cut_part *cell)
{
    const struct cut_grid *g = c->grid;
    double *urgent = xcalloc((size_t)most, sizeof *urgent);
    int n = 1;
    cell[0] = (struct cut_part){0, 0, g->w, g->h, power_of(c, 0, 0, g->w, g->h), 1};
    urgent[0] = urgency(g, &cell[0]);
    while (n < most) {
        int next = 0;
        for (int k = 1; k < n; k++)
            if (urgent[k] > urgent[next])
                next = k;
        if (!(urgent[next] > 0))
            break;
        cut(c, &cell[next], &cell[n], 0.5);
        urgent[next] = urgency(g, &cell[next]);
        urgent[n] = urgency(g, &cell[n]);
        n++;
    }
    free(urgent);
    return n;
}

int cut_cells(const struct cut_grid *g, int n, int parts, struct cut_part *out, struct err *e)
{
    const size_t row = (size_t)g->w + 1;
    struct cutter c = {g, sample_alloc(row * ((size_t)g->h + 1), sizeof *c.sum, "sums", e)};
    if (!c.sum)
        return -1;
    for (int j = 0; j < g->h; j++) {
        double sum = 0;
        for (int i = 0; i < g->w; i++) {
            sum += g->power[(size_t)j * (size_t)g->w + (size_t)i];
            c.sum[(size_t)(j + 1) * row + (size_t)i + 1] =
                c.sum[(size_t)j * row + (size_t)i + 1] + sum;
        }
    }
    struct cut_part *cell = xcalloc((size_t)n, sizeof *cell);
    const int cells = cut_all(&c, n, cell);
    for (int k = 0; k < cells; k++)
        divide(&c, cell[k], parts, out + (size_t)k * (size_t)parts);
    free(cell);
    free(c.sum);
    return cells;
}
