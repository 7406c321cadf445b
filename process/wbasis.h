// wbasis.h - which few curves in w stand for a table: Chebyshev polynomials, or the best there are.
//
// X[w][node] are samples of a table at Gauss-Legendre nodes in w, known here only by their Gram
// matrix G = X X^T: enough for the optimal curves (POD: the eigenvectors of G weighted for the mean
// over w are the left singular vectors of X, so by Eckart and Young no tables do better in L2) and
// for the exact error of any choice at every count.
#pragma once
#include "core/err.h"
#include "process/wnodes.h"

struct wbasis {
    int nw, max;     // samples in w, tables considered
    double *project; // [max][nw] table m = sum of project[m][k] X[k], owned
    double *curve;   // [max][nw] its weight at the nodes, owned
    double *error;   // [max + 1] relative L2 error with 0, 1, .. max tables, owned
    double *worst_w; // [max + 1] the same at the w where it is largest, owned
};

// gram[nw][nw], symmetric. ERR_DATA when it holds NaN.
bool wbasis_pod(struct wbasis *b, const struct wnodes *q, const double *gram, int max,
                struct err *e);
bool wbasis_chebyshev(struct wbasis *b, const struct wnodes *q, const double *gram, int max,
                      struct err *e);
void wbasis_finish(struct wbasis *b); // accepts a zeroed struct

// The least number of tables whose error over all w is within `tolerance`; one more when that
// brings the worst w under it too. 0: not even max tables are enough.
int wbasis_count(const struct wbasis *b, double tolerance);
