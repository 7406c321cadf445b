// test_lut_rig.c - tables from simulated photographs: geometry records, and the exponent.
#include "tests/test.h"

#include "process/lut.h"
#include "process/lut_geometry.h"
#include "sim/photo.h"
#include "sim/truth.h"

// Lm of the scene at one wavelength (a band of 1 nm), as a geometry record turns L/E into it.
static struct lut_pattern photograph(const struct sim_scene *s, double lambda_m, double reach)
{
    struct band b;
    struct image photo, geometry;
    struct lut_pattern p;
    struct err e = {0};
    if (!band_gaussian(&b, lambda_m, 1e-9, 1, false, &e) || !photo_pattern(s, &b, &photo, &e) ||
        !photo_geometry(s, &geometry, &e) || !lut_geometry(&photo, 0, &geometry, 1, reach, &p, &e))
        fail_msg("%s", e.msg);
    band_finish(&b);
    image_finish(&photo);
    image_finish(&geometry);
    return p;
}

static struct sim_scene scene(const char *text)
{
    struct sim_scene s;
    struct err e = {0};
    if (!sim_scene_open_text(&s, "test", text, NULL, &e))
        fail_msg("%s", e.msg);
    s.sensor.bayer = false;
    return s;
}

// An amplitude grating (exponent 2) and a shallow phase grating (nearly 4).
static const struct {
    const char *text;
    double exponent;
} kinds[] = {
    {"sample: {kind: lcd, pitch: 20um}\n"
     "view: {width: 200, height: 200, h-per-pixel: 1.5e-3}\n",
     2},
    {"sample: {kind: shapes, period: [20um, 20um], ground: 1, shapes: [{x: [0, 0.5], y: [0, 0.4], "
     "amplitude: 1, height: 12nm}]}\n"
     "view: {width: 200, height: 200, h-per-pixel: 1.5e-3}\n",
     4},
};

// A band around 450 nm: the colour that neither filter shows.
static struct spectrum blue(void)
{
    struct spectrum s = {4, calloc(4, sizeof(double)), calloc(4, sizeof(double))};
    static const double nm[4] = {440, 445, 455, 460}, power[4] = {0, 1, 1, 0};
    for (int k = 0; k < 4; k++) {
        s.lambda_m[k] = nm[k] * 1e-9;
        s.value[k] = power[k];
    }
    return s;
}

// Relative L2 error of the orders (|h| > 0.017: order 0 is a mirror, and a mirror has exponent 2)
// in the table that a red photograph predicts.
static double prediction_error(const struct lut_pattern *red, double exponent, double f0,
                               const struct spectrum *light, const struct table *truth)
{
    struct table t;
    struct lut_report report;
    struct err e = {0};
    const struct lut_request r = {.pattern = red,
                                  .lambda_m = 650e-9,
                                  .light = light,
                                  .f0 = f0,
                                  .exponent = exponent,
                                  .n = truth->n,
                                  .range = truth->range,
                                  .power = 1,
                                  .tolerance = 1e-4};
    if (!lut_build(&r, &t, &report, &e))
        fail_msg("%s", e.msg);
    double diff = 0, norm = 0;
    for (int j = 0; j < t.n; j++)
        for (int i = 0; i < t.n; i++) {
            const size_t k = 3 * ((size_t)j * (size_t)t.n + (size_t)i) + 2;
            if (hypot(table_node(&t, i), table_node(&t, j)) < 0.017)
                continue;
            diff += (t.tab[k] - truth->tab[k]) * (t.tab[k] - truth->tab[k]);
            norm += truth->tab[k] * truth->tab[k];
        }
    table_finish(&t);
    return sqrt(diff / norm);
}

TEST(two_filters_tell_the_exponent_and_so_the_third_colour)
{
    struct spectrum light = blue();
    for (int k = 0; k < 2; k++) {
        struct sim_scene s = scene(kinds[k].text);
        struct lut_pattern red = photograph(&s, 650e-9, 0.15), green = photograph(&s, 530e-9, 0.15);
        struct err e = {0};
        double exponent, sigma;
        if (!lut_exponent(&red, 650e-9, &green, 530e-9, &exponent, &sigma, &e))
            fail_msg("%s", e.msg);
        assert_near(exponent, kinds[k].exponent, 0.05);
        assert_true(sigma < 0.05);
        struct table truth;
        assert_true(table_init(&truth, 121, 0.08, 1, 1, &e));
        assert_true(truth_table(&s.sample, &s.view, &light, &truth, &e));
        const double f0 = sqrt(s.sample.r0);
        const double told = prediction_error(&red, exponent, f0, &light, &truth);
        const double two = prediction_error(&red, 2, f0, &light, &truth);
        const double four = prediction_error(&red, 4, f0, &light, &truth);
        print_message("exponent %.3f +- %.3f; error of blue %.3f, with 2 %.3f, with 4 %.3f\n",
                      exponent, sigma, told, two, four);
        assert_true(told < 0.05);
        assert_true(told < 0.2 * (k ? two : four));
        table_finish(&truth);
        sim_scene_finish(&s);
        lut_pattern_finish(&red);
        lut_pattern_finish(&green);
    }
    spectrum_finish(&light);
}

// The same photograph placed by its record, and by a number and a centre.
TEST(a_geometry_record_of_an_even_view_changes_nothing)
{
    struct sim_scene s = scene(kinds[0].text);
    struct band b;
    struct image photo, geometry;
    struct lut_pattern even = {0}, placed = {0};
    struct err e = {0};
    assert_true(band_gaussian(&b, 550e-9, 1e-9, 1, false, &e));
    assert_true(photo_pattern(&s, &b, &photo, &e));
    assert_true(photo_geometry(&s, &geometry, &e));
    assert_true(lut_geometry(&photo, 0, &geometry, 3, 0.15, &placed, &e));
    const int weight = image_channel_index(&geometry, "weight");
    for (int k = 0; k < 200 * 200; k++)
        photo.px[k] *= geometry.px[4 * k + weight];
    assert_true(lut_pattern_init(&even, &photo, 0, 3, &e));
    even.h_per_px = s.view.h_per_pixel;
    even.cx = s.view.center_x;
    even.cy = s.view.center_y;
    struct spectrum light = {0};
    assert_true(illuminant_get(&light, "E", &e));
    struct table t[2];
    struct lut_report report;
    const struct lut_pattern *p[2] = {&even, &placed};
    for (int k = 0; k < 2; k++) {
        const struct lut_request r = {.pattern = p[k],
                                      .lambda_m = 550e-9,
                                      .light = &light,
                                      .f0 = 1,
                                      .exponent = 2,
                                      .n = 101,
                                      .range = 0.08,
                                      .power = 1,
                                      .tolerance = 1e-4};
        assert_true(lut_build(&r, &t[k], &report, &e));
    }
    double diff = 0, norm = 0;
    for (int k = 0; k < 3 * 101 * 101; k++) {
        diff += (t[0].tab[k] - t[1].tab[k]) * (t[0].tab[k] - t[1].tab[k]);
        norm += t[0].tab[k] * t[0].tab[k];
    }
    print_message("relative L2 difference %.2g\n", sqrt(diff / norm));
    assert_true(sqrt(diff / norm) < 1e-3);
    for (int k = 0; k < 101 * 101; k++)
        assert_int_equal(t[0].cover[k], t[1].cover[k]);
    table_finish(&t[0]);
    table_finish(&t[1]);
    spectrum_finish(&light);
    lut_pattern_finish(&even);
    lut_pattern_finish(&placed);
    image_finish(&photo);
    image_finish(&geometry);
    band_finish(&b);
    sim_scene_finish(&s);
}

// A relief too deep for any exponent: photographs at three wavelengths tell what one cannot.
TEST(three_filters_follow_a_deep_relief)
{
    static const double lambda_m[] = {450e-9, 530e-9, 650e-9};
    struct sim_scene s =
        scene("sample: {kind: shapes, period: [20um, 20um], ground: 1, shapes: [{x: [0, 0.5], y: "
              "[0, 0.4], amplitude: 1, height: 130nm}]}\n"
              "view: {width: 200, height: 200, h-per-pixel: 1.5e-3}\n");
    struct spectrum light = {0};
    struct table truth, sum = {0};
    struct lut_report report;
    struct err e = {0};
    assert_true(illuminant_get(&light, "E", &e));
    assert_true(table_init(&truth, 121, 0.08, 1, 1, &e));
    assert_true(truth_table(&s.sample, &s.view, &light, &truth, &e));
    double error[2];
    for (int several = 0; several < 2; several++) {
        const struct lut_filters filters = {3, {lambda_m[0], lambda_m[1], lambda_m[2]}};
        for (int k = several ? 0 : 1; k < (several ? 3 : 2); k++) {
            struct lut_pattern p = photograph(&s, lambda_m[k], 0.15);
            struct table t;
            const struct lut_request r = {.pattern = &p,
                                          .lambda_m = lambda_m[k],
                                          .light = &light,
                                          .f0 = sqrt(s.sample.r0),
                                          .exponent = 2,
                                          .n = truth.n,
                                          .range = truth.range,
                                          .power = 1,
                                          .tolerance = 1e-4,
                                          .filters = several ? &filters : NULL,
                                          .filter = k};
            if (!lut_build(&r, &t, &report, &e))
                fail_msg("%s", e.msg);
            if (sum.tab) {
                lut_filters_add(&sum, &t);
                table_finish(&t);
            } else {
                sum = t;
            }
            lut_pattern_finish(&p);
        }
        double diff = 0, norm = 0;
        for (int k = 0; k < 3 * truth.n * truth.n; k++) {
            diff += (sum.tab[k] - truth.tab[k]) * (sum.tab[k] - truth.tab[k]);
            norm += truth.tab[k] * truth.tab[k];
        }
        error[several] = sqrt(diff / norm);
        table_finish(&sum);
    }
    print_message("error from one filter %.3f, from three %.4f\n", error[0], error[1]);
    assert_true(error[0] > 0.05);
    assert_true(error[1] < 0.01);
    table_finish(&truth);
    spectrum_finish(&light);
    sim_scene_finish(&s);
}

TEST(photographs_that_are_not_in_order_are_refused)
{
    struct err e;
    assert_false(lut_filters_check(&(struct lut_filters){2, {530e-9, 450e-9}}, &e));
    assert_non_null(strstr(e.msg, "from short to long wavelengths, 5 nm apart or more"));
    assert_false(lut_filters_check(&(struct lut_filters){2, {530e-9, 531e-9}}, &e));
    assert_true(lut_filters_check(&(struct lut_filters){2, {450e-9, 530e-9}}, &e));
}

TEST_MAIN(cmocka_unit_test(two_filters_tell_the_exponent_and_so_the_third_colour),
          cmocka_unit_test(a_geometry_record_of_an_even_view_changes_nothing),
          cmocka_unit_test(three_filters_follow_a_deep_relief),
          cmocka_unit_test(photographs_that_are_not_in_order_are_refused))
