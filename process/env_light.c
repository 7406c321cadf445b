// env_light.c - parts of light shared out to the nodes, weighted by the pre functions, transformed.
#define _GNU_SOURCE
#include "process/env_light.h"
#include "core/mem.h"
#include "process/bspline.h"
#include "process/fft.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Power at each node of the mirrored grid (-i_t, -i_b): LANE values, of which the first three are
// the sums of power R, G, B, the next three those of power times i_n.
enum { LANE = 8, STRIPS = 16, ROWS = 16 };

static void add_part(const struct env_light *l, const struct env_part *p, int from, int to,
                     double *nodes)
{
    const struct env_grid *g = &l->grid;
    double wx[4], wy[4];
    const double x = (-p->t - l->t0) / g->step, y = (-p->b - l->b0) / g->step;
    const int i = (int)floor(x), j = (int)floor(y);
    if (j + 3 <= from || j > to || i < 1 || i + 2 >= g->side || j < 1 || j + 2 >= g->side)
        return;
    bspline_weights(x - i, wx);
    bspline_weights(y - j, wy);
    double v[LANE] = {0};
    for (int c = 0; c < 3; c++) {
        v[c] = p->power[c];
        v[c + 3] = p->power[c] * p->n;
    }
    for (int q = 0; q < 4; q++) {
        if (j + q - 1 < from || j + q - 1 >= to)
            continue;
        double *node = nodes + ((size_t)(j + q - 1) * (size_t)g->side + (size_t)(i - 1)) * LANE;
        for (int r = 0; r < 4; r++, node += LANE)
            for (int c = 0; c < LANE; c++)
                node[c] += wy[q] * wx[r] * v[c];
    }
}

// Light further off the window than the table reaches misses it.
static int within_reach(const struct env_light *l, struct env_part *part, int count)
{
    const double far = .5 * l->grid.span + l->grid.reach * l->grid.step;
    int n = 0;
    for (int k = 0; k < count; k++)
        if (fabs(part[k].t + l->t) <= far && fabs(part[k].b + l->b) <= far)
            part[n++] = part[k];
    return n;
}

// Whatever the number of threads, each node sums its parts in the order of the map: a thread owns
// a strip of nodes and reads all parts.
static void gather(struct env_light *l, const struct env_parts *parts, struct env_part *part,
                   double *nodes)
{
    const int h = parts->env->map.h, side = l->grid.side;
    const size_t room = env_parts_room(parts);
    for (int row = 0; row < h; row += ROWS) {
        const int rows = h - row < ROWS ? h - row : ROWS;
        int count[ROWS];
#pragma omp parallel for schedule(dynamic)
        for (int r = 0; r < rows; r++) {
            struct env_part *of_row = part + room * (size_t)r;
            count[r] = within_reach(l, of_row, env_parts_row(parts, row + r, of_row));
        }
        for (int r = 0; r < rows; r++)
            l->used += (double)count[r] / (double)room / h;
#pragma omp parallel for schedule(dynamic)
        for (int s = 0; s < STRIPS; s++)
            for (int r = 0; r < rows; r++)
                for (int k = 0; k < count[r]; k++)
                    add_part(l, part + room * (size_t)r + k, side * s / STRIPS,
                             side * (s + 1) / STRIPS, nodes);
    }
}

static void interpolating(const struct env_grid *g, double *nodes)
{
    const size_t line = (size_t)g->side * LANE;
#pragma omp parallel for
    for (int j = 0; j < g->side; j++)
        bspline_fit_vectors(nodes + (size_t)j * line, g->side, LANE, LANE);
#pragma omp parallel for
    for (int i = 0; i < g->side; i += STRIPS)
        bspline_fit_vectors(nodes + (size_t)i * LANE, g->side, line,
                            (size_t)(g->side - i < STRIPS ? g->side - i : STRIPS) * LANE);
}

// Light of one channel times a pre function. Its polynomials in t and b are taken at the nodes
// (also just outside the disk); what has a factor i_n has that of the parts. The grid is mirrored.
static void transform(const struct env_light *l, const struct fft *fft, const double *nodes, int c,
                      const struct direction_poly *pre, double *spec)
{
    const struct env_grid *g = &l->grid;
    const size_t line = 2 * ((size_t)g->period / 2 + 1);
    double even[POLY_MOST + 1], odd[POLY_MOST + 1];
    for (int j = 0; j < g->side; j++) {
        const double *from = nodes + (size_t)j * (size_t)g->side * LANE + c;
        double *to = spec + (size_t)j * line;
        direction_poly_row(pre, -(l->b0 + j * g->step), even, odd);
        for (int i = 0; i < g->side; i++, from += LANE) {
            const double t = -(l->t0 + i * g->step);
            double p = 0, q = 0;
            for (int k = pre->degree; k >= 0; k--) {
                p = p * t + even[k];
                q = q * t + odd[k];
            }
            to[i] = p * from[0] + q * from[3];
        }
    }
    fft_run(fft, spec, spec);
}

static bool transform_all(struct env_light *l, const struct env_kernel *k, const double *nodes,
                          struct err *e)
{
    const size_t period = (size_t)l->grid.period, size = period * 2 * (period / 2 + 1);
    struct fft *fft = fft_new(FFT_R2C, FFT_DOUBLE, l->grid.period, l->grid.period, 1, true, e);
    bool ok = fft != NULL;
    for (int job = 0; job < 3 * l->n && ok; job++)
        ok = (l->spec[job / l->n][job % l->n] =
                  sample_alloc(size, sizeof(double), "light on the grid", e));
#pragma omp parallel for schedule(dynamic)
    for (int job = 0; job < 3 * l->n; job++)
        if (ok)
            transform(l, fft, nodes, job / l->n, &k->terms.pre[job % l->n],
                      l->spec[job / l->n][job % l->n]);
    fft_free(fft);
    return ok;
}

// The first node of a run that covers the window around x and what the table reaches around it;
// nodes are whole steps whatever the window, so that its result is that of the whole.
static double first_node(const struct env_grid *g, double x)
{
    const double wide = .5 * (g->side - 1) * g->step;
    const double most = fmax(0, (ceil(1 / g->step) + ENV_RIM) * g->step - wide);
    return round((fmax(-most, fmin(most, x)) - wide) / g->step) * g->step;
}

bool env_light_init(struct env_light *l, const struct env_kernel *k, const struct environment *env,
                    const struct frame *f, double t, double b, struct err *e)
{
    const struct env_grid *g = &k->grid;
    *l = (struct env_light){.grid = *g, .frame = *f, .n = k->terms.n_pre};
    const double most = fmax(0, 1 - .5 * g->span); // a window that hangs out of [-1, 1] moves in
    l->t = fmax(-most, fmin(most, t));
    l->b = fmax(-most, fmin(most, b));
    l->t0 = first_node(g, l->t);
    l->b0 = first_node(g, l->b);
    const int cut = (int)fmax(1, ceil(M_PI / env->map.h / g->step));
    struct env_parts parts;
    if (!env_parts_init(&parts, env, f, cut, e))
        return false;
    struct env_part *part = sample_alloc(env_parts_room(&parts) * ROWS, sizeof *part, "light", e);
    double *nodes = sample_alloc((size_t)g->side * (size_t)g->side * LANE, sizeof *nodes,
                                 "light on the grid", e);
    bool ok = part && nodes;
    if (ok) {
        gather(l, &parts, part, nodes);
        interpolating(g, nodes);
        ok = transform_all(l, k, nodes, e);
    }
    free(part);
    free(nodes);
    env_parts_finish(&parts);
    if (!ok)
        env_light_finish(l);
    return ok;
}

void env_light_finish(struct env_light *l)
{
    if (!l)
        return;
    for (int c = 0; c < 3; c++)
        for (int p = 0; p < TERMS_MOST; p++)
            free(l->spec[c][p]);
    *l = (struct env_light){0};
}
