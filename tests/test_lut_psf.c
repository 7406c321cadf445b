// test_lut_psf.c - complex lights, and the table that grows while a bracket is shot.
#include "tests/lobes.h"

#include "process/lut_preview.h"
#include "process/lut_psf.h"

static struct lobes pattern_lobes(const struct spectrum *light)
{
    struct lobes l = lobes_new(60, 2);
    l.exponent = 2;
    l.lambda_m = 520e-9;
    l.h_per_px = 2e-3;
    l.light = light;
    return l;
}

static struct lut_request request(const struct lut_pattern *p, const struct spectrum *s)
{
    return (struct lut_request){.pattern = p,
                                .lambda_m = 520e-9,
                                .light = s,
                                .f0 = 1,
                                .exponent = 2,
                                .n = 65,
                                .range = 0.1,
                                .power = 3,
                                .is_rgb = true,
                                .tolerance = 1e-4};
}

// Two LEDs, the right one red: the table under them is a sum of shifted tables.
TEST(two_leds_give_two_patterns_each_in_its_colours)
{
    enum { W = 25, H = 17 };
    static const double led_x[2] = {6, 18}, led_y[2] = {8, 9},
                        colour[2][3] = {{1, 1, 1}, {1, 0, 0}};
    const double sigma = 1.5, psf_h = 2.5e-3;
    float px[W * H][3];
    for (int k = 0; k < W * H; k++)
        for (int c = 0; c < 3; c++) {
            px[k][c] = 0;
            for (int q = 0; q < 2; q++)
                px[k][c] +=
                    (float)(7 * colour[q][c] *
                            exp(-0.5 * (pow(k % W - led_x[q], 2) + pow(k / W - led_y[q], 2)) /
                                (sigma * sigma)));
        }
    const struct image im = {.w = W, .h = H, .nc = 3, .px = px[0]};
    const struct lut_psf psf = {&im, psf_h, led_x[0], led_y[0]};
    struct spectrum s;
    struct err e = {0};
    assert_true(illuminant_get(&s, "E", &e));
    const struct lobes l = pattern_lobes(&s);
    struct lut_pattern p = lobes_picture(&l, 300, 300, 150, 150);
    struct lut_request r = request(&p, &s);
    struct table t;
    struct lut_report report;
    assert_true(lut_build_psf(&r, &psf, &t, &report, &e));
    double diff = 0, norm = 0;
    for (int j = 5; j < 65; j += 11)
        for (int i = 4; i < 65; i += 7) {
            double truth[3] = {0}, weight[3] = {0};
            for (int q = 0; q < 2; q++)
                for (double y = -4; y <= 4; y += 0.5)
                    for (double x = -4; x <= 4; x += 0.5) {
                        const double g = exp(-0.5 * (x * x + y * y)); // in sigmas
                        double xyz[3], rgb[3];
                        lobes_truth(
                            &l, table_node(&t, i) - (led_x[q] - led_x[0] + sigma * x) * psf_h,
                            table_node(&t, j) - (led_y[q] - led_y[0] + sigma * y) * psf_h, 81, xyz);
                        xyz_to_rgb(xyz, rgb);
                        for (int c = 0; c < 3; c++) {
                            truth[c] += g * colour[q][c] * rgb[c];
                            weight[c] += g * colour[q][c];
                        }
                    }
            for (int c = 0; c < 3; c++) {
                const double d = t.tab[(j * 65 + i) * 3 + c] - truth[c] / weight[c];
                diff += d * d;
                norm += pow(truth[c] / weight[c], 2);
            }
        }
    if (!(sqrt(diff / norm) < 5e-3)) // 81 wavelengths in the judge; the picture's cut tails
        fail_msg("relative L2 error %g", sqrt(diff / norm));
    for (int k = 0; k < 65 * 65; k++)
        assert_int_equal(t.cover[k], 1);
    table_finish(&t);

    memset(px, 0, sizeof px);
    assert_false(lut_build_psf(&r, &psf, &t, &report, &e));
    assert_string_equal(e.msg, "the picture of the light is dark");
    lut_pattern_finish(&p);
    spectrum_finish(&s);
}

TEST(a_preview_starts_coarse_and_ends_as_the_table_itself)
{
    struct spectrum s;
    struct err e = {0};
    assert_true(illuminant_get(&s, "E", &e));
    const struct lobes l = pattern_lobes(&s);
    struct lut_pattern p = lobes_picture(&l, 300, 300, 150, 150);
    struct lut_preview v = {.request = request(NULL, &s)};
    struct table t, whole;
    struct lut_report report;
    lut_preview_frame(&v, &p);
    assert_true(lut_preview_next(&v, &t, &e));
    assert_int_equal(t.n, 8);
    table_finish(&t);
    lut_preview_frame(&v, &p); // the next exposure is in
    for (int n = 8; !lut_preview_done(&v); n = 2 * n == 64 ? 65 : 2 * n) {
        assert_true(lut_preview_next(&v, &t, &e));
        assert_int_equal(t.n, n);
        if (!lut_preview_done(&v))
            table_finish(&t);
    }
    assert_true(lut_build(&v.request, &whole, &report, &e));
    assert_memory_equal(t.tab, whole.tab, 65 * 65 * 3 * sizeof(float));
    table_finish(&t);
    table_finish(&whole);
    lut_pattern_finish(&p);
    spectrum_finish(&s);
}

TEST_MAIN(cmocka_unit_test(two_leds_give_two_patterns_each_in_its_colours),
          cmocka_unit_test(a_preview_starts_coarse_and_ends_as_the_table_itself))
