// svd.h - singular values by LAPACK: the same bytes on every run and any number of threads.
#pragma once
#include "core/err.h"

// a[m][n] (destroyed) = sum over k < min(m, n) of s[k] u[.][k] vt[k][.], s falling.
// u[m][r], s[r], vt[r][n] with r = min(m, n), all the caller's. ERR_DATA when a holds NaN or LAPACK
// does not converge.
bool svd(int m, int n, double *a, double *u, double *s, double *vt, struct err *e);
bool svdf(int m, int n, float *a, float *u, float *s, float *vt, struct err *e);

// The r leading triplets of a[m][n] (kept): u[m][r], s[r], vt[r][n]. Randomised, with as many power
// iterations as the error needs to settle: within 1.001 of the best of rank r; `error` (may be
// NULL) gets it, |a - u s vt| in Frobenius norm. The whole SVD is taken where that is no more work.
bool svd_leading(int m, int n, const float *a, int r, float *u, float *s, float *vt, double *error,
                 struct err *e);
