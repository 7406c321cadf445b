// normal.h - normal equations of a linear least-squares problem, and their solution by Cholesky.
//
// Made for fits with up to some thousand unknowns and any number of observations: only the matrix
// of the unknowns is kept. Sums run in the order of the calls: the same bytes on every run.
#pragma once
#include "core/err.h"

struct normal {
    int n;            // unknowns
    double *a;        // [n][n] sum of w x x^T; the lower triangle is used
    double *b;        // [n] sum of w x y
    double yy;        // sum of w y^2
    long count;       // observations
    double condition; // set by normal_solve(): how much the largest pivot loses to those before, an
                      // estimate of the condition of the matrix scaled to a unit diagonal
};

#define NORMAL_LIMIT 1e13 // three of double's sixteen digits are left

void normal_init(struct normal *s, int n);
void normal_finish(struct normal *s); // accepts a zeroed struct

// One observation: the `k` unknowns at[] enter with the factors x[]; their sum should be y.
void normal_add(struct normal *s, int k, const int at[], const double x[], double y, double w);

// The unknowns into out[n], and (when not NULL) the diagonal of the inverse, for standard errors.
// ERR_DATA when the observations do not determine every unknown: a condition above NORMAL_LIMIT.
// Destroys s->a.
bool normal_solve(struct normal *s, double *out, double *inverse_diagonal, struct err *e);
