// logpolar.h - sums over scalings of a picture, S(x, y) = sum over q of weight[q] L(x e^s[q], y
// e^s[q]).
//
// A scaling moves a point along its ray, so over the logarithm of the radius the sum is a
// one-dimensional correlation: resample the picture once to rays, correlate every ray, resample the
// result to the nodes. The radius is the larger of |x| and |y| and the angle the ratio of the two:
// then the rings are squares, a ring crosses whole rows and columns of picture and table, and
// every interpolation runs along one axis at a time. Four sectors (+x, +y, -x, -y) make a ring, and
// rings halve inwards, each with rays and steps as fine as its size needs; inside the last is a
// small plain grid.
#pragma once
#include "core/err.h"
#include <stdbool.h>

struct lp_picture {
    const float *px; // [h][w], finite; 0 beyond its frame
    int w, h;
    double cx, cy;         // px, where x = y = 0
    const float *variance; // [h][w] of px; NULL: not known
};

struct lp_kernel {
    int n;
    double *s;           // [n]
    double (*weight)[3]; // [n] three channels
};

struct lp_nodes {
    int n;
    const double
        *x; // [n] px from the centre, rising, x[n-1-i] = -x[i]: node (i, j) is (x[i], x[j])
};

// Shares of the work that was not there, 0..1.
struct lp_stats {
    double rays, radii, nodes;
    bool symmetric; // L(-x, -y) = L(x, y) within noise or tolerance: half was computed
};

// Samples a pixel that represent the picture within `tolerance` (relative): 0.7 to 2.
double lp_density(const struct lp_picture *p, double tolerance);

// out[n][n][3] must be zero. Quintic splines everywhere. The same bytes for any number of threads.
bool lp_correlate(const struct lp_picture *p, const struct lp_kernel *k,
                  const struct lp_nodes *nodes, double density, double tolerance, float *out,
                  struct lp_stats *stats, struct err *e);
