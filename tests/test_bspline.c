// test_bspline.c - splines pass through their samples and converge at their order.
#include "tests/test.h"

#include "process/bspline.h"

TEST(weights_are_the_basis_function)
{
    for (int k = 0; k <= 10; k++) {
        const double f = k / 10.0;
        float w3[4], w5[6];
        bspline_weights_3((float)f, w3);
        bspline_weights_5((float)f, w5);
        for (int a = 0; a < 4; a++)
            assert_near(w3[a], bspline_basis(BSPLINE_CUBIC, f + 1 - a), 2e-7);
        for (int a = 0; a < 6; a++)
            assert_near(w5[a], bspline_basis(BSPLINE_QUINTIC, f + 2 - a), 2e-7);
    }
}

TEST(an_image_is_recovered_at_its_samples)
{
    static const int sizes[][2] = {{1, 1}, {2, 5}, {3, 33}, {40, 7}, {64, 65}};
    for (int s = 0; s < 5; s++)
        for (int degree = 3; degree <= 5; degree += 2) {
            const int w = sizes[s][0], h = sizes[s][1];
            float *px = calloc((size_t)(w * h), sizeof *px);
            float *c = calloc((size_t)(w * h), sizeof *c);
            for (int k = 0; k < w * h; k++)
                c[k] = px[k] = (float)((k * 7919) % 101);
            bspline_fit_image(c, w, h, degree);
            for (int j = 0; j < h; j++)
                for (int i = 0; i < w; i++) {
                    double sum = 0;
                    for (int b = -2; b <= 2; b++)
                        for (int a = -2; a <= 2; a++)
                            sum += bspline_basis(degree, a) * bspline_basis(degree, b) *
                                   c[bspline_mirror(j + b, h) * w + bspline_mirror(i + a, w)];
                    assert_near(sum, px[j * w + i], 1e-3);
                }
            free(px);
            free(c);
        }
}

TEST(the_error_falls_with_the_fourth_and_sixth_power_of_the_step)
{
    for (int degree = 3; degree <= 5; degree += 2) {
        double worst[2] = {0};
        for (int fine = 0; fine < 2; fine++) {
            const int n = fine ? 201 : 101;
            double c[201];
            for (int i = 0; i < n; i++)
                c[i] = cos(M_PI * 20 * i / (n - 1)); // mirrored ends are its own
            bspline_fit_line(c, n, degree);
            for (double x = 3; x < n - 4; x += 0.37) {
                double sum = 0;
                for (int i = (int)x - 2; i <= (int)x + 3; i++)
                    sum += c[i] * bspline_basis(degree, x - i);
                worst[fine] = fmax(worst[fine], fabs(sum - cos(M_PI * 20 * x / (n - 1))));
            }
        }
        assert_near(log2(worst[0] / worst[1]), degree + 1, 0.4);
    }
}

TEST_MAIN(cmocka_unit_test(weights_are_the_basis_function),
          cmocka_unit_test(an_image_is_recovered_at_its_samples),
          cmocka_unit_test(the_error_falls_with_the_fourth_and_sixth_power_of_the_step))
