// svd.c - the one file that knows LAPACKE and OpenBLAS.
#include "process/svd.h"
#include <lapacke.h>

extern void openblas_set_num_threads(int n); // its header clashes with lapacke.h

bool svd(int m, int n, double *a, double *u, double *s, double *vt, struct err *e)
{
    openblas_set_num_threads(1);
    const int r = m < n ? m : n;
    const lapack_int info = LAPACKE_dgesdd(LAPACK_ROW_MAJOR, 'S', m, n, a, n, s, u, r, vt, n);
    return !info ||
           err_set(e, ERR_DATA, "no SVD of a %d x %d matrix (LAPACK dgesdd: %d)", m, n, (int)info);
}

bool svdf(int m, int n, float *a, float *u, float *s, float *vt, struct err *e)
{
    openblas_set_num_threads(1);
    const int r = m < n ? m : n;
    const lapack_int info = LAPACKE_sgesdd(LAPACK_ROW_MAJOR, 'S', m, n, a, n, s, u, r, vt, n);
    return !info ||
           err_set(e, ERR_DATA, "no SVD of a %d x %d matrix (LAPACK sgesdd: %d)", m, n, (int)info);
}
