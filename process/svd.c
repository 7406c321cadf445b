// svd.c - the one file that knows LAPACKE and OpenBLAS.
#include "process/svd.h"
#include "core/mem.h"
#include <lapacke.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

extern void openblas_set_num_threads(int n); // its header clashes with lapacke.h
extern void sgemm_(const char *ta, const char *tb, const int *m, const int *n, const int *k,
                   const float *alpha, const float *a, const int *lda, const float *b,
                   const int *ldb, const float *beta, float *c, const int *ldc);

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

// Leading triplets: N. Halko, P. G. Martinsson, J. A. Tropp, "Finding structure with randomness",
// SIAM Review 2011, algorithms 4.4 and 5.1. A tall matrix is kept column by column, [l][rows].

enum { OVERSAMPLE = 10, EIGHT = 8 /* floats are taken at once */, MOST_ITERATIONS = 12, CUTS = 8 };

static void signs(float *x, size_t count) // splitmix64: one bit a sample
{
    uint64_t state = 1;
    for (size_t k = 0; k < count; k++) {
        uint64_t z = state += 0x9e3779b97f4a7c15;
        z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9;
        z = (z ^ z >> 27) * 0x94d049bb133111eb;
        x[k] = (z ^ z >> 31) & 1 ? 1 : -1;
    }
}

// to[l][rows of op(a)] = op(a) from; a[m][n] row by row is its transpose to Fortran. Cut into the
// same pieces whatever the number of threads.
static void apply(bool transposed, int m, int n, int l, const float *a, const float *from,
                  float *to)
{
    const float one = 1, zero = 0;
    const int rows = transposed ? n : m, inner = transposed ? m : n;
    const size_t step = transposed ? 1 : (size_t)n;
#pragma omp parallel for schedule(static)
    for (int k = 0; k < CUTS; k++) {
        const int first = rows / CUTS * k,
                  count = (k < CUTS - 1 ? first + rows / CUTS : rows) - first;
        sgemm_(transposed ? "N" : "T", "N", &count, &l, &inner, &one, a + (size_t)first * step, &n,
               from, &inner, &zero, to + first, &rows);
    }
}

// Orthonormal columns in place of q; r[l][l] (may be NULL), column by column, with q_old = q r.
static bool orthonormalise(int rows, int l, float *q, float *r, struct err *e)
{
    float *tau = xcalloc((size_t)l, sizeof *tau);
    lapack_int info = LAPACKE_sgeqrf(LAPACK_COL_MAJOR, rows, l, q, rows, tau);
    for (int j = 0; r && j < l; j++)
        for (int i = 0; i < l; i++)
            r[j * l + i] = i <= j ? q[(size_t)j * (size_t)rows + (size_t)i] : 0;
    if (!info)
        info = LAPACKE_sorgqr(LAPACK_COL_MAJOR, rows, l, l, q, rows, tau);
    free(tau);
    return !info || err_set(e, ERR_DATA, "no QR of a %d x %d matrix (LAPACK: %d)", rows, l, info);
}

static double squares(const float *a, size_t count)
{
    double lane[EIGHT] = {0}, sum = 0;
    size_t k = 0;
    for (; k + EIGHT <= count; k += EIGHT)
        for (size_t q = 0; q < EIGHT; q++)
            lane[q] += (double)a[k + q] * (double)a[k + q];
    for (; k < count; k++)
        sum += (double)a[k] * (double)a[k];
    for (int q = 0; q < EIGHT; q++)
        sum += lane[q];
    return sum;
}

static double squares_by_rows(int m, int n, const float *a)
{
    double *row = xcalloc((size_t)m, sizeof *row), sum = 0;
#pragma omp parallel for schedule(static)
    for (int i = 0; i < m; i++)
        row[i] = squares(a + (size_t)i * (size_t)n, (size_t)n);
    for (int i = 0; i < m; i++)
        sum += row[i];
    free(row);
    return sum;
}

struct sketch {
    int l;
    float *y, *z;               // [l][m] orthonormal; [l][n] = a^T y, then orthonormal
    float *core, *cu, *s, *cvt; // of z = q core, core = cu s cvt
};

static bool sketch_alloc(struct sketch *k, int m, int n, int l, struct err *e)
{
    const size_t ll = (size_t)l * (size_t)l;
    *k = (struct sketch){.l = l};
    k->y = sample_alloc((size_t)l * (size_t)m, sizeof *k->y, "SVD", e);
    k->z = sample_alloc((size_t)l * (size_t)n, sizeof *k->z, "SVD", e);
    k->core = xcalloc(ll, sizeof *k->core);
    k->cu = xcalloc(ll, sizeof *k->cu);
    k->cvt = xcalloc(ll, sizeof *k->cvt);
    k->s = xcalloc((size_t)l, sizeof *k->s);
    return k->y && k->z;
}

static void sketch_free(struct sketch *k)
{
    free(k->y);
    free(k->z);
    free(k->core);
    free(k->cu);
    free(k->cvt);
    free(k->s);
}

// Power iterations until |a|^2 - sum of s^2 of the r leading has come down to its least, to a part
// in 1e4. A pass brings what is over the least down by (s of the sketch's last / s of the r-th)^4.
static bool sketch_run(struct sketch *k, int m, int n, const float *a, int r, double all,
                       struct err *e)
{
    double left = INFINITY;
    signs(k->z, (size_t)k->l * (size_t)n);
    for (int pass = 0; pass < MOST_ITERATIONS; pass++) {
        apply(false, m, n, k->l, a, k->z, k->y);
        if (!orthonormalise(m, k->l, k->y, NULL, e))
            return false;
        apply(true, m, n, k->l, a, k->y, k->z);
        if (!orthonormalise(n, k->l, k->z, k->core, e) ||
            !svdf(k->l, k->l, k->core, k->cu, k->s, k->cvt, e))
            return false;
        const double before = left, last = (double)k->s[k->l - 1], least = (double)k->s[r - 1];
        const double fall = least > 0 ? pow(last / least, 4) : 0;
        left = fmax(0, all - squares(k->s, (size_t)r));
        if ((before - left) * fall <= 1e-4 * left * (1 - fall))
            break;
    }
    return true;
}

static bool leading_of_whole(int m, int n, const float *a, int r, float *u, float *s, float *vt,
                             struct err *e)
{
    const int least = m < n ? m : n;
    const size_t count = (size_t)m * (size_t)n;
    float *copy = sample_alloc(count, sizeof *copy, "SVD", e);
    float *all_u = sample_alloc((size_t)m * (size_t)least, sizeof *all_u, "SVD", e);
    float *all_vt = sample_alloc((size_t)least * (size_t)n, sizeof *all_vt, "SVD", e);
    float *all_s = xcalloc((size_t)least, sizeof *all_s);
    bool ok = copy && all_u && all_vt;
    if (ok) {
        memcpy(copy, a, count * sizeof *a);
        ok = svdf(m, n, copy, all_u, all_s, all_vt, e);
    }
    for (int k = 0; k < r && ok; k++) {
        s[k] = all_s[k];
        for (int i = 0; i < m; i++)
            u[(size_t)i * (size_t)r + (size_t)k] = all_u[(size_t)i * (size_t)least + (size_t)k];
    }
    if (ok)
        memcpy(vt, all_vt, (size_t)r * (size_t)n * sizeof *vt);
    free(copy);
    free(all_u);
    free(all_vt);
    free(all_s);
    return ok;
}

// a = y z^T = y (q core)^T, and core^T = cu s cvt, for core was kept column by column.
static void sketch_read(const struct sketch *k, int m, int n, int r, float *u, float *s, float *vt)
{
    const float one = 1, zero = 0;
    memcpy(s, k->s, (size_t)r * sizeof *s);
    sgemm_("N", "T", &r, &m, &k->l, &one, k->cu, &k->l, k->y, &m, &zero, u, &r);
    sgemm_("N", "N", &n, &r, &k->l, &one, k->z, &n, k->cvt, &k->l, &zero, vt, &n);
}

// Taken from the samples themselves: |a|^2 - sum of s^2 in float ends at 3e-4 of |a|.
static double residual(int m, int n, int r, const float *a, const float *u, const float *s,
                       const float *vt)
{
    float *row = xcalloc((size_t)n, sizeof *row);
    double sum = 0;
    for (int i = 0; i < m; i++) {
        memcpy(row, a + (size_t)i * (size_t)n, (size_t)n * sizeof *row);
        for (int k = 0; k < r; k++) {
            const float weight = u[(size_t)i * (size_t)r + (size_t)k] * s[k];
            for (int j = 0; j < n; j++)
                row[j] -= weight * vt[(size_t)k * (size_t)n + (size_t)j];
        }
        sum += squares(row, (size_t)n);
    }
    free(row);
    return sqrt(sum);
}

bool svd_leading(int m, int n, const float *a, int r, float *u, float *s, float *vt, double *error,
                 struct err *e)
{
    openblas_set_num_threads(1);
    const int least = m < n ? m : n, l = (r + OVERSAMPLE + EIGHT - 1) / EIGHT * EIGHT;
    bool ok;
    if (4 * l >= least) {
        ok = leading_of_whole(m, n, a, r, u, s, vt, e);
    } else {
        struct sketch k;
        const double all = squares_by_rows(m, n, a);
        if (!isfinite(all))
            return err_set(e, ERR_DATA, "no SVD of a %d x %d matrix: it is not finite", m, n);
        ok = sketch_alloc(&k, m, n, l, e) && sketch_run(&k, m, n, a, r, all, e);
        if (ok)
            sketch_read(&k, m, n, r, u, s, vt);
        sketch_free(&k);
    }
    if (ok && error)
        *error = residual(m, n, r, a, u, s, vt);
    return ok;
}
