// lp_ring.h - results of logpolar.h before they are read at nodes: square rings and the middle.
#pragma once
#include "process/lp_source.h"
#include "process/lp_taps.h"

enum { LP_BLOCK = 16 }; // rays that are live or empty together

// Quintic B-spline coefficients over (ln a, t): row r is ln a = ln_first + r step, ray k is slope
// t = (k - middle) / half.
struct lp_ring {
    double a_low, a_high; // px: where it may be read
    bool symmetric;       // sectors +x and +y are the mean of both sides, -x and -y are not there
    double ln_first, step;
    int rows, rays; // rays: a multiple of LP_BLOCK
    int half, middle;
    struct lp_taps taps;
    float *coef;   // [4][rows][3][rays] sectors +x, +y, -x, -y; or [2]..; owned
    uint8_t *live; // [4][rows][rays / LP_BLOCK] 0: all zero, owned
};

// The plain grid inside the last ring: sample (i, j) is at ((i - middle), (j - middle)) / per_px.
struct lp_middle {
    double a_high;
    bool symmetric;
    double per_px;
    int n, middle;
    struct lp_taps taps;
    float *coef; // [n][3][n] owned
};

struct lp_counts {
    double samples, samples_skipped, results, results_skipped;
};

// A ring that can be read for a_high / 2 <= a <= a_high, and the middle for a <= a_high, with
// samples `spacing` px apart: sizes and memory, no values yet.
bool lp_ring_init(struct lp_ring *r, const struct lp_kernel *k, double a_high, double spacing,
                  double tolerance, bool symmetric, struct err *e);
void lp_ring_finish(struct lp_ring *r);
bool lp_middle_init(struct lp_middle *m, const struct lp_kernel *k, double a_high, double spacing,
                    bool symmetric, struct err *e);
void lp_middle_finish(struct lp_middle *m);

// Fills them all.
bool lp_fill(struct lp_ring *rings, int n, struct lp_middle *middle, const struct lp_source *s,
             struct lp_counts *counts, struct err *e);

// Row j of the middle's samples, not yet coefficients.
void lp_middle_row(struct lp_middle *m, const struct lp_source *s, int j);

// Reads rings (rings[q].a_low = rings[q + 1].a_high) and middle at all nodes. Returns the nodes
// without signal, which stay as they are.
long lp_read_nodes(const struct lp_ring *rings, int n_rings, const struct lp_middle *middle,
                   const struct lp_nodes *nodes, bool symmetric, float *out);
