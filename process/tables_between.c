// tables_between.c - the error of bilinear look-up between nodes.
#include "process/tables_between.h"
#include "core/mem.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum {
    SIDE = 40,       // points along an axis; their grid is the set of points
    GRID = 3 * SIDE, // of each: itself, the node below, the node above
    W_NODES = 4,
};

struct axis {
    double at[GRID];                 // [SIDE] points, [SIDE] nodes below, [SIDE] nodes above
    double part[SIDE], weight[SIDE]; // place in the cell; area that the point stands for
};

// Half of the points even in u, half crowded to the middle as nodes of power 5 are; each stands for
// the inverse of the density of both (balance heuristic).
static void axis_init(struct axis *a, const struct table *nodes, uint32_t seed)
{
    const double range = nodes->range;
    for (int k = 0; k < SIDE; k++) {
        seed = seed * 1664525u + 1013904223u;
        const double jitter = (seed >> 8) / 16777216.0;
        const double s = 2 * (k / 2 + jitter) / (SIDE / 2) - 1;
        const double u = range * (k % 2 ? s * s * s * s * s : s), x = fabs(u) / range;
        const double density = SIDE / 2 * (1 + 0.2 * pow(x, -0.8)) / (2 * range);
        const double index = table_index(nodes, u);
        const int i = index < nodes->n - 1 ? (int)index : nodes->n - 2;
        a->at[k] = u;
        a->at[SIDE + k] = table_node(nodes, i);
        a->at[2 * SIDE + k] = table_node(nodes, i + 1);
        a->part[k] = index - i;
        a->weight[k] = 1 / density;
    }
}

struct grid {
    float *xyz; // [GRID columns][GRID rows][3][stride]
    size_t column;
};

static void keep(void *ctx, int iu, const void *plus, const void *minus)
{
    (void)minus;
    const struct grid *g = ctx;
    memcpy(g->xyz + (size_t)iu * g->column, plus, g->column * sizeof *g->xyz);
}

struct sums {
    double apart, square, light;
};

// One point: adds its error and value, averaged over w, to `all` and to `away`.
static void add_point(const struct grid *g, const struct axis *x, const struct axis *y, int i,
                      int j, const struct wnodes *q, bool is_away, struct sums *all,
                      struct sums *away)
{
    const size_t stride = (size_t)at_w_stride(W_NODES);
    const double area = x->weight[i] * y->weight[j], fx = x->part[i], fy = y->part[j];
    for (size_t c = 0; c < 3; c++)
        for (size_t w = 0; w < W_NODES; w++) {
            double v[3][3]; // [column: point, below, above][row]
            for (int a = 0; a < 3; a++)
                for (int b = 0; b < 3; b++)
                    v[a][b] = g->xyz[(size_t)(a * SIDE + i) * g->column +
                                     ((size_t)(b * SIDE + j) * 3 + c) * stride + w];
            const double between = (1 - fx) * ((1 - fy) * v[1][1] + fy * v[1][2]) +
                                   fx * ((1 - fy) * v[2][1] + fy * v[2][2]);
            const double share = area * q->weight[w], apart = between - v[0][0];
            struct sums *to[2] = {all, is_away ? away : NULL};
            for (int k = 0; k < 2 && to[k]; k++) {
                to[k]->apart += share * apart * apart;
                to[k]->square += share * v[0][0] * v[0][0];
                to[k]->light += share * v[0][0];
            }
        }
}

static struct between compare(const struct grid *g, const struct axis *x, const struct axis *y,
                              const struct wnodes *q, double lobe)
{
    struct sums all = {0}, away = {0};
    for (int i = 0; i < SIDE; i++)
        for (int j = 0; j < SIDE; j++)
            add_point(g, x, y, i, j, q, hypot(x->at[i], y->at[j]) > lobe, &all, &away);
    return (struct between){
        .all = all.square > 0 ? sqrt(all.apart / all.square) : 0,
        .away = away.square > 0 ? sqrt(away.apart / away.square) : 0,
        .light_away = all.light > 0 ? away.light / all.light : 0,
    };
}

bool tables_between(const struct tables_pass *p, int n, int power, struct between *out,
                    struct err *e)
{
    const struct table nodes = {.n = n, .range = p->spec->range, .power = power};
    struct axis x, y;
    struct wnodes q;
    axis_init(&x, &nodes, 1);
    axis_init(&y, &nodes, 2);
    wnodes_init(&q, W_NODES, p->spec->w_min, p->spec->w_max);
    struct grid g = {.column = GRID * 3 * (size_t)at_w_stride(W_NODES)};
    g.xyz = sample_alloc(GRID, g.column * sizeof *g.xyz, "points between nodes", e);
    struct diffraction_use *use = g.xyz ? at_w_new(&p->patch, &p->light, q.w, W_NODES, e) : NULL;
    const struct diffraction d = {.patch = &p->patch,
                                  .light = &p->light,
                                  .u = x.at,
                                  .v = y.at,
                                  .nu = GRID,
                                  .nv = GRID,
                                  .repeat = {p->spec->repeat[0], p->spec->repeat[1]},
                                  .absolute = p->spec->absolute,
                                  .memory = p->spec->memory};
    const bool ok = use && diffraction_run(&d, use, keep, &g, e);
    if (ok) {
        // A mirror's lobe is a Gaussian of lambda / (2 pi sigma), its square narrower by sqrt(2).
        const double sigma_m = sqrt(patch_area(&p->patch) / 12.566370614359172);
        const double lobe = 5 * p->light.lambda_m[p->light.n - 1] / (6.283185307179586 * sigma_m);
        *out = compare(&g, &x, &y, &q, lobe);
    }
    at_w_free(use);
    free(g.xyz);
    wnodes_finish(&q);
    return ok;
}

bool tables_size(const struct tables_pass *p, double error, int most, int *n, int *power,
                 struct err *e)
{
    double best = INFINITY;
    for (int at_power = 1; at_power <= 7; at_power += 2) {
        double size = 101;
        for (int step = 0; step < 12 && size < best && size <= most; step++) {
            struct between b;
            const int odd = (int)size / 2 * 2 + 1;
            if (!tables_between(p, odd, at_power, &b, e))
                return false;
            const double worst = b.light_away > error ? fmax(b.all, b.away) : b.all;
            if (worst <= error) {
                best = odd;
                *power = at_power;
                break;
            }
            // second order in the step once nodes resolve the lobes; careful before that
            size = odd * fmin(3, fmax(1.05, 1.02 * sqrt(worst / error)));
        }
        if (size > most && size < best) { // what it would take, if nothing else is found
            best = size;
            *power = at_power;
        }
    }
    *n = best < 1e9 ? (int)best : 1000000000;
    return true;
}
