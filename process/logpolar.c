// logpolar.c - rings from the outside in, the middle, then all nodes.
#define _GNU_SOURCE
#include "process/logpolar.h"
#include "process/lp_ring.h"
#include <math.h>
#include <stdlib.h>

enum { MAX_RINGS = 32 };

// Where nothing of the picture can be seen any more.
static double farthest(const struct lp_source *s, const struct lp_kernel *k,
                       const struct lp_nodes *nodes)
{
    double reach = 0, shrink = INFINITY;
    for (int q = 0; q < 4; q++)
        reach = fmax(reach, s->reach[q]);
    for (int q = 0; q < k->n; q++)
        shrink = fmin(shrink, exp(k->s[q]));
    return fmin(reach / shrink, nodes->x[nodes->n - 1]);
}

// Whether L(-x, -y) = L(x, y): by the noise where it is known (the differences are what two
// variances make), else within the tolerance. Only asked where the picture holds all that the nodes
// look at.
static bool is_symmetric(const struct lp_picture *p, const struct lp_source *s,
                         const struct lp_kernel *k, const struct lp_nodes *nodes, double tolerance)
{
    enum { PROBES = 64 }; // a side, over one half
    double difference = 0, size = 0, noise = 0;
    const double reach = nodes->x[nodes->n - 1] * lp_kernel_growth(k);
    for (int q = 0; q < 4; q++)
        if (reach > s->reach[q] - 2)
            return false;
    for (int j = 0; j <= PROBES / 2; j++)
        for (int i = 0; i <= PROBES; i++) {
            // whole pixels on one side, where samples have the variance that the picture states
            const double x = round(p->cx + reach * (2.0 * i / PROBES - 1));
            const double y = round(p->cy + reach * 2.0 * j / PROBES);
            const double here = lp_source_at(s, x - p->cx, y - p->cy);
            const double there = lp_source_at(s, p->cx - x, p->cy - y);
            difference += (here - there) * (here - there);
            size += here * here;
            if (p->variance)
                noise += 2 * (double)p->variance[(size_t)y * (size_t)p->w + (size_t)x];
        }
    return difference <= fmax(tolerance * tolerance * size, 1.1 * noise);
}

bool lp_correlate(const struct lp_picture *p, const struct lp_kernel *k,
                  const struct lp_nodes *nodes, double density, double tolerance, float *out,
                  struct lp_stats *stats, struct err *e)
{
    *stats = (struct lp_stats){0};
    struct lp_source source;
    if (!lp_source_init(&source, p, e))
        return false;
    struct lp_ring ring[MAX_RINGS];
    struct lp_counts counts = {0};
    struct lp_middle middle = {0};
    int n = 0;
    bool ok = true;
    double a = farthest(&source, k, nodes);
    stats->symmetric = is_symmetric(p, &source, k, nodes, tolerance);
    for (; ok && a > 2 && n < MAX_RINGS; a *= 0.5) {
        const double spacing = (n < 2 ? 1 : 0.5) / density; // fine rings are cheap further in
        ok = lp_ring_init(&ring[n], k, a, spacing, tolerance, stats->symmetric, e);
        n += ok;
    }
    ok = ok && lp_middle_init(&middle, k, a, 0.5 / density, stats->symmetric, e) &&
         lp_fill(ring, n, &middle, &source, &counts, e);
    if (ok) {
        const double empty = (double)lp_read_nodes(ring, n, &middle, nodes, stats->symmetric, out);
        stats->nodes = empty / ((double)nodes->n * nodes->n);
        stats->rays = counts.samples > 0 ? counts.samples_skipped / counts.samples : 0;
        stats->radii = counts.results > 0 ? counts.results_skipped / counts.results : 0;
    }
    while (n > 0)
        lp_ring_finish(&ring[--n]);
    lp_middle_finish(&middle);
    lp_source_finish(&source);
    return ok;
}

// Mean size of sixth differences along rows (of every fourth row) and columns against the mean size
// of the samples: what a quintic spline cannot follow (its error is C6 a^6 |d6 L| at spacing a,
// C6 = sqrt(2 zeta(12)) / (2 pi)^6, Unser 1999).
double lp_density(const struct lp_picture *p, double tolerance)
{
    double differences = 0, size = 0;
    long n = 0;
    for (int j = 3; j < p->h - 3; j += 4) {
        double row_differences = 0, row_size = 0;
        for (int i = 3; i < p->w - 3; i++) {
            const float *x = p->px + (size_t)j * (size_t)p->w + i;
            const ptrdiff_t w = p->w;
            row_size += fabsf(x[0]);
            row_differences +=
                fabsf(x[-3] + x[3] - 6 * (x[-2] + x[2]) + 15 * (x[-1] + x[1]) - 20 * x[0]) +
                fabsf(x[-3 * w] + x[3 * w] - 6 * (x[-2 * w] + x[2 * w]) + 15 * (x[-w] + x[w]) -
                      20 * x[0]);
        }
        differences += 0.5 * row_differences;
        size += row_size;
        n++;
    }
    if (!(size > 0) || !(differences > 0) || n == 0)
        return 1;
    const double c6 = 2.3e-5, a = pow(tolerance * size / (c6 * differences), 1 / 6.0);
    return fmax(0.5, fmin(2, 1 / a));
}
