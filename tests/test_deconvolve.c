// test_deconvolve.c - blurs and their adjoints, and Richardson-Lucy against a plain loop in double.
#include "process/deconvolve.h"
#include "tests/noise.h"
#include "tests/test.h"

#include <omp.h>

enum { W = 96, H = 80, N = W * H };

static int mirror(int i, int n)
{
    while (i < 0 || i >= n)
        i = i < 0 ? -1 - i : 2 * n - 1 - i;
    return i;
}

// Plain: every output sample is the double sum over a square PSF of reflected samples.
static void plain_blur(int w, int h, const double *psf, int r, const double *in, double *out)
{
    for (int j = 0; j < h; j++)
        for (int i = 0; i < w; i++) {
            double sum = 0;
            for (int q = -r; q <= r; q++)
                for (int p = -r; p <= r; p++)
                    sum += psf[(q + r) * (2 * r + 1) + p + r] *
                           in[mirror(j - q, h) * w + mirror(i - p, w)];
            out[j * w + i] = sum;
        }
}

static void gauss_psf(double sigma, int r, double *psf)
{
    double sum = 0;
    for (int q = -r; q <= r; q++)
        for (int p = -r; p <= r; p++)
            sum += psf[(q + r) * (2 * r + 1) + p + r] =
                exp(-0.5 * (p * p + q * q) / (sigma * sigma));
    for (int k = 0; k < (2 * r + 1) * (2 * r + 1); k++)
        psf[k] /= sum;
}

// Dots, bars up to the border, and a soft ramp.
static void make_scene(int w, int h, float *u)
{
    for (int j = 0; j < h; j++)
        for (int i = 0; i < w; i++)
            u[j * w + i] = 20 + (i / 6 % 2 ? 60.0f : 0) +
                           (hypot(i - w / 2, j - h / 2) < 9 ? 200.0f : 0) +
                           (i % 17 == 3 && j % 13 == 5 ? 400.0f : 0);
}

TEST(a_gaussian_blur_is_the_plain_sum)
{
    static float in[N], out[N];
    static double din[N], dout[N];
    static const double sigmas[] = {0.4, 1.9, 5};
    make_scene(W, H, in);
    for (int k = 0; k < N; k++)
        din[k] = (double)in[k];
    for (int s = 0; s < 3; s++) {
        const int r = (int)ceil(4 * sigmas[s]);
        static double psf[101 * 101];
        gauss_psf(sigmas[s], r, psf);
        struct err e = {0};
        struct blur *b = blur_gauss(W, H, sigmas[s], &e);
        assert_non_null(b);
        blur_apply(b, in, out);
        plain_blur(W, H, psf, r, din, dout);
        for (int k = 0; k < N; k++)
            assert_near((double)out[k], dout[k], 3e-5 * 100);
        blur_free(b);
    }
}

TEST(a_measured_psf_blurs_as_the_plain_sum_and_has_its_adjoint)
{
    enum { R = 4, P = 2 * R + 1 };
    static float in[N], other[N], out[N], back[N], psf[P * P];
    static double dpsf[P * P], din[N], dout[N];
    uint64_t seed = 7;
    double sum = 0;
    for (int k = 0; k < P * P; k++) // lopsided: more weight to one side
        sum += dpsf[k] = noise_uniform(&seed) * (k % P);
    for (int k = 0; k < P * P; k++)
        psf[k] = (float)(dpsf[k] /= sum);
    for (int k = 0; k < N; k++) {
        din[k] = (double)(in[k] = (float)noise_uniform(&seed));
        other[k] = (float)noise_uniform(&seed);
    }
    struct err e = {0};
    struct blur *b = blur_psf(W, H, psf, P, P, &e);
    assert_non_null(b);
    blur_apply(b, in, out);
    plain_blur(W, H, dpsf, R, din, dout);
    for (int k = 0; k < N; k++)
        assert_near((double)out[k], dout[k], 2e-6);
    blur_adjoint(b, other, back);
    double left = 0, right = 0;
    for (int k = 0; k < N; k++) {
        left += (double)out[k] * (double)other[k];
        right += (double)in[k] * (double)back[k];
    }
    assert_near(left / right, 1, 1e-6);
    blur_free(b);
}

struct middle {
    size_t stride;
    const float *factor; // [h][stride]
    float *out;          // [h][stride]
};

static void multiply(void *ctx, const struct blur_run *run)
{
    const struct middle *m = ctx;
    for (int k = 0; k < run->n; k++)
        run->px[k] *= m->factor[(size_t)run->j * m->stride + (size_t)(run->i + k)];
}

static void keep_run(void *ctx, const struct blur_run *run)
{
    const struct middle *m = ctx;
    memcpy(m->out + (size_t)run->j * m->stride + run->i, run->px, (size_t)run->n * sizeof(float));
}

TEST(a_round_is_blur_factor_and_adjoint_one_after_the_other_on_any_number_of_threads)
{
    static const struct {
        int w, h;
        double sigma; // 0: a lopsided PSF
    } cases[] = {
        {320, 41, 1},  // rows in lanes
        {333, 150, 1}, // with padding
        {257, 3, 0.2}, // the most padding, one row short of a turn
        {96, 80, 2},   // too narrow for lanes
        {7000, 40, 2}, // too wide for the cache
        {130, 70, 0},
    };
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        const int w = cases[c].w, h = cases[c].h;
        const size_t n = (size_t)(w * h);
        struct err e = {0};
        static const float psf[9] = {1, 2, 3, 0, 1, 5, 0, 0, 1};
        struct blur *b = cases[c].sigma > 0 ? blur_gauss(w, h, cases[c].sigma, &e)
                                            : blur_psf(w, h, psf, 3, 3, &e);
        if (!b)
            fail_msg("%s", e.msg);
        const size_t stride = blur_stride(b), many = stride * (size_t)h;
        assert_true(stride >= (size_t)w);
        float *in = calloc(5 * n + 5 * many, sizeof *in), *mid = in + n, *want = mid + n,
              *got = want + n, *factor = got + n, *u = factor + n, *f = u + many, *next = f + many,
              *again = next + many;
        uint64_t seed = 3;
        for (size_t k = 0; k < n; k++) {
            in[k] = (float)noise_uniform(&seed);
            factor[k] = (float)noise_uniform(&seed);
        }
        blur_apply(b, in, mid);
        for (size_t k = 0; k < n; k++)
            mid[k] *= factor[k];
        blur_adjoint(b, mid, want);
        blur_order(b, in, u);
        blur_order(b, factor, f);
        omp_set_num_threads(1);
        blur_round(b, u, multiply, keep_run, &(struct middle){stride, f, next});
        blur_unorder(b, next, got);
        for (size_t k = 0; k < n; k++)
            if (!(fabsf(got[k] - want[k]) < 1e-6f))
                fail_msg("case %zu at (%zu, %zu): %g, not %g", c, k % (size_t)w, k / (size_t)w,
                         (double)got[k], (double)want[k]);
        omp_set_num_threads(3);
        blur_round(b, u, multiply, keep_run, &(struct middle){stride, f, again});
        blur_unorder(b, again, want);
        assert_memory_equal(got, want, n * sizeof *got);
        free(in);
        blur_free(b);
    }
}

TEST(richardson_lucy_is_the_plain_loop_in_double_and_keeps_the_flux)
{
    enum { R = 8 };
    static float scene[N], data[N], out[N];
    static double psf[(2 * R + 1) * (2 * R + 1)], d[N], u[N], model[N], back[N];
    make_scene(W, H, scene);
    scene[0] = 0;
    gauss_psf(2, R, psf);
    for (int k = 0; k < N; k++)
        u[k] = (double)scene[k];
    plain_blur(W, H, psf, R, u, d);
    double mean = 0;
    for (int k = 0; k < N; k++) {
        data[k] = (float)d[k];
        mean += d[k] / N;
    }
    for (int k = 0; k < N; k++)
        u[k] = mean;
    for (int it = 0; it < 30; it++) {
        plain_blur(W, H, psf, R, u, model);
        for (int k = 0; k < N; k++)
            model[k] = d[k] / model[k];
        plain_blur(W, H, psf, R, model, back);
        for (int k = 0; k < N; k++)
            u[k] *= back[k];
    }
    struct err e = {0};
    struct blur *b = blur_gauss(W, H, 2, &e);
    struct deconvolve_result res;
    if (!deconvolve(b, W, H, data, &(struct deconvolve_options){.iterations = 30}, out, &res, &e))
        fail_msg("%s", e.msg);
    double worst = 0, flux = 0;
    for (int k = 0; k < N; k++) {
        worst = fmax(worst, fabs((double)out[k] - u[k]));
        flux += (double)out[k];
        assert_true(out[k] >= 0);
    }
    assert_near(worst, 0, 2e-3 * mean); // rounding grows as the picture sharpens
    assert_near(flux / (mean * N), 1, 1e-6);
    blur_free(b);
}

static double rmse(const float *a, const float *b, int n)
{
    double sum = 0;
    for (int k = 0; k < n; k++)
        sum += ((double)a[k] - (double)b[k]) * ((double)a[k] - (double)b[k]);
    return sqrt(sum / n);
}

TEST(the_automatic_stop_is_near_the_best_of_the_path)
{
    static float scene[N], data[N], out[N];
    static const struct {
        double sigma, gain;
        bool accelerate;
    } cases[] = {
        {1.5, 1, false}, {2, 1, false}, {2, 0.05, false},
        {2, 20, false},  {3, 1, false}, {2, 1, true},
    };
    make_scene(W, H, scene);
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        struct err e = {0};
        struct blur *b = blur_gauss(W, H, cases[c].sigma, &e);
        blur_apply(b, scene, data);
        uint64_t seed = 11 + c;
        for (int k = 0; k < N; k++) // shot noise: variance gain * signal
            data[k] += (float)(sqrt(cases[c].gain * (double)data[k]) * noise_gauss(&seed));
        struct deconvolve_result res;
        double best = INFINITY;
        for (int n = 1; n <= 300; n += 1 + n / 4) {
            assert_true(deconvolve(
                b, W, H, data,
                &(struct deconvolve_options){.iterations = n, .accelerate = cases[c].accelerate},
                out, &res, &e));
            best = fmin(best, rmse(out, scene, N));
        }
        assert_true(deconvolve(b, W, H, data,
                               &(struct deconvolve_options){.accelerate = cases[c].accelerate}, out,
                               &res, &e));
        const double ours = rmse(out, scene, N);
        print_message(
            "sigma %.1f gain %.2f%s: %d iterations, RMSE %.3f, best of the path %.3f, ratio %.3f\n",
            cases[c].sigma, cases[c].gain, cases[c].accelerate ? " accelerated" : "",
            res.iterations, ours, best, ours / best);
        assert_true(ours <= 1.1 * best);
        blur_free(b);
    }
}

TEST(acceleration_reaches_the_same_residual_in_fewer_steps)
{
    static float scene[N], data[N], out[N];
    make_scene(W, H, scene);
    struct err e = {0};
    struct blur *b = blur_gauss(W, H, 2, &e);
    blur_apply(b, scene, data);
    struct deconvolve_result plain, fast;
    assert_true(deconvolve(b, W, H, data, &(struct deconvolve_options){.iterations = 200}, out,
                           &plain, &e));
    assert_true(deconvolve(b, W, H, data,
                           &(struct deconvolve_options){.iterations = 60, .accelerate = true}, out,
                           &fast, &e));
    assert_true(fast.residual < plain.residual);
    assert_near(fast.flux / fast.flux_in, 1, 1e-6);
    blur_free(b);
}

TEST(total_variation_flattens_noise_and_keeps_flux)
{
    static float scene[N], data[N], plain[N], smooth[N];
    make_scene(W, H, scene);
    struct err e = {0};
    struct blur *b = blur_gauss(W, H, 1.5, &e);
    blur_apply(b, scene, data);
    uint64_t seed = 3;
    for (int k = 0; k < N; k++)
        data[k] += (float)(3 * sqrt((double)data[k]) * noise_gauss(&seed));
    struct deconvolve_result res;
    assert_true(
        deconvolve(b, W, H, data, &(struct deconvolve_options){.iterations = 60}, plain, &res, &e));
    assert_true(deconvolve(b, W, H, data,
                           &(struct deconvolve_options){.iterations = 60, .tv = 0.03}, smooth, &res,
                           &e));
    assert_true(rmse(smooth, scene, N) < 0.9 * rmse(plain, scene, N));
    assert_near(res.flux / res.flux_in, 1, 1e-6);
    blur_free(b);
}

TEST(zeros_negatives_and_one_huge_sample_do_not_blow_up)
{
    static float data[N], out[N];
    data[5 * W + 7] = 1e30f;
    data[6 * W + 7] = -3;
    struct err e = {0};
    struct blur *b = blur_gauss(W, H, 2, &e);
    struct deconvolve_result res;
    assert_true(
        deconvolve(b, W, H, data, &(struct deconvolve_options){.iterations = 50}, out, &res, &e));
    assert_int_equal(res.negative, 1);
    for (int k = 0; k < N; k++)
        assert_true(isfinite(out[k]) && out[k] >= 0);
    assert_near(res.flux / 1e30, 1, 1e-6);
    blur_free(b);
}

TEST(what_cannot_be_done_is_refused)
{
    static float data[N], out[N];
    struct err e = {0};
    assert_null(blur_gauss(W, H, 0, &e));
    assert_string_equal(
        e.msg, "sigma 0 px: must be positive and at most a quarter of the smaller side (80 px)");
    assert_null(blur_gauss(W, H, 21, &e));
    assert_null(blur_psf(W, H, (float[]){1, -1}, 2, 1, &e));
    assert_string_equal(e.msg, "PSF sample (1, 0) is -1: must not be negative");
    assert_null(blur_psf(W, H, (float[]){0, 0}, 2, 1, &e));
    struct blur *b = blur_gauss(W, H, 2, &e);
    struct deconvolve_result res;
    assert_false(
        deconvolve(b, W, H, data, &(struct deconvolve_options){.iterations = 5}, out, &res, &e));
    assert_string_equal(e.msg, "the picture is black: nothing to deconvolve");
    data[W + 3] = NAN;
    assert_false(
        deconvolve(b, W, H, data, &(struct deconvolve_options){.iterations = 5}, out, &res, &e));
    assert_string_equal(e.msg, "pixel (3, 1) is not finite");
    blur_free(b);
}

TEST_MAIN(cmocka_unit_test(
              a_round_is_blur_factor_and_adjoint_one_after_the_other_on_any_number_of_threads),
          cmocka_unit_test(a_gaussian_blur_is_the_plain_sum),
          cmocka_unit_test(a_measured_psf_blurs_as_the_plain_sum_and_has_its_adjoint),
          cmocka_unit_test(richardson_lucy_is_the_plain_loop_in_double_and_keeps_the_flux),
          cmocka_unit_test(the_automatic_stop_is_near_the_best_of_the_path),
          cmocka_unit_test(acceleration_reaches_the_same_residual_in_fewer_steps),
          cmocka_unit_test(total_variation_flattens_noise_and_keeps_flux),
          cmocka_unit_test(zeros_negatives_and_one_huge_sample_do_not_blow_up),
          cmocka_unit_test(what_cannot_be_done_is_refused))
