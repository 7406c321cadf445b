// test_svd.c - singular values: the whole decomposition and its leading part.
#include "tests/test.h"

#include "core/mem.h"
#include "process/svd.h"

// A matrix with falling singular values and noise; column k of either side is a wave.
static float *matrix(int m, int n)
{
    float *a = xcalloc((size_t)m * (size_t)n, sizeof *a);
    unsigned seed = 1;
    for (int i = 0; i < m; i++)
        for (int j = 0; j < n; j++) {
            double sum = 0;
            for (int k = 1; k <= 15; k++)
                sum += sin(.1 * k * i + k) * cos(.07 * k * j * j / n) / k;
            seed = seed * 1664525 + 1013904223;
            a[i * n + j] = (float)(sum + 1e-3 * seed / 4294967296.);
        }
    return a;
}

static double distance(int m, int n, int r, const float *a, const float *u, const float *s,
                       const float *vt)
{
    double sum = 0;
    for (int i = 0; i < m; i++)
        for (int j = 0; j < n; j++) {
            double x = (double)a[i * n + j];
            for (int k = 0; k < r; k++)
                x -= (double)(u[i * r + k] * s[k] * vt[k * n + j]);
            sum += x * x;
        }
    return sqrt(sum);
}

TEST(leading_triplets_are_within_a_thousandth_of_the_best)
{
    static const int size[][2] = {{300, 220}, {180, 310}, {40, 50}};
    for (int q = 0; q < 3; q++) {
        const int m = size[q][0], n = size[q][1], least = m < n ? m : n;
        float *a = matrix(m, n), *copy = matrix(m, n);
        float *u = xcalloc((size_t)(m * least), sizeof *u), *s = xcalloc((size_t)least, sizeof *s);
        float *vt = xcalloc((size_t)(least * n), sizeof *vt);
        struct err e = {0};
        float all[400];
        assert_true(svdf(m, n, copy, u, all, vt, &e));
        for (int r = 1; r <= 12; r += r == 1 ? 2 : 9) {
            double error, best = 0;
            for (int k = r; k < least; k++)
                best += (double)all[k] * (double)all[k];
            assert_true(svd_leading(m, n, a, r, u, s, vt, &error, &e));
            assert_true(error <= 1.001 * sqrt(best));
            assert_near(distance(m, n, r, a, u, s, vt), sqrt(best), 1e-3 * sqrt(best));
            for (int k = 0; k < r; k++)
                assert_near(s[k], all[k], 1e-3 * all[k]);
        }
        free(a);
        free(copy);
        free(u);
        free(s);
        free(vt);
    }
}

TEST(a_matrix_of_low_rank_is_found_whole)
{
    enum { N = 200 };
    static float a[N * N], u[N * 3], s[3], vt[3 * N];
    double error;
    struct err e = {0};
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++)
            a[i * N + j] = (float)(i * j + 100 * sin(i) * cos(j));
    assert_true(svd_leading(N, N, a, 3, u, s, vt, &error, &e));
    assert_true(distance(N, N, 3, a, u, s, vt) < 1e-5 * (double)s[0]);
    memset(a, 0, sizeof a);
    assert_true(svd_leading(N, N, a, 3, u, s, vt, &error, &e));
    assert_near(error, 0, 0);
    assert_near(s[0], 0, 0);
}

TEST(a_matrix_that_is_not_finite_is_refused)
{
    static float a[100 * 100], u[100], s[1], vt[100];
    struct err e = {0};
    a[17] = NAN;
    assert_false(svd_leading(100, 100, a, 1, u, s, vt, NULL, &e));
    assert_int_equal(e.code, ERR_DATA);
}

TEST_MAIN(cmocka_unit_test(leading_triplets_are_within_a_thousandth_of_the_best),
          cmocka_unit_test(a_matrix_of_low_rank_is_found_whole),
          cmocka_unit_test(a_matrix_that_is_not_finite_is_refused))
