// test_view_inspect.c - what the inspector says of places whose truth is known.
#include "tests/test.h"

#include "core/spectrum.h"
#include "ui/pitch.h"
#include "ui/view_inspect.h"

static const double white[3] = {1.2048, 0.9484, 0.9087}; // of illuminant E

TEST(a_spectral_colour_over_white_has_its_wavelength)
{
    for (int nm = 440; nm <= 640; nm += 20) {
        double xyz[3], rgb[3], purity;
        cie_xyz(nm * 1e-9, xyz);
        for (int c = 0; c < 3; c++)
            xyz[c] = xyz[c] + 0.1; // E is equal in X, Y and Z
        xyz_to_rgb(xyz, rgb);
        assert_near(1e9 * dominant_wavelength(rgb, white, &purity), nm, 1);
        assert_true(purity > 0 && purity < 1);
    }
}

TEST(white_and_purple_have_no_wavelength)
{
    double purity;
    assert_true(isnan(dominant_wavelength(white, white, &purity)));
    const double purple[3] = {1, 0.05, 0.8};
    assert_true(isnan(dominant_wavelength(purple, white, &purity)));
    const double black[3] = {0};
    assert_true(isnan(dominant_wavelength(black, white, &purity)));
}

TEST(a_place_and_a_pitch_tell_the_orders_that_meet_there)
{
    struct spot s = {.u = 3 * 500e-9 / 25e-6, .v = 0, .rgb = {1.2048, 0.9484, 0.9087}};
    spot_conclude(&s, white, 530e-9, 25e-6);
    assert_int_equal(s.n_orders, 2); // 750 nm in second, 500 nm in third order
    assert_int_equal(s.order[0].m, 2);
    assert_near(1e9 * s.order[0].lambda_m, 750, 1e-6);
    assert_int_equal(s.order[1].m, 3);
    assert_near(1e9 * s.order[1].lambda_m, 500, 1e-6);
    assert_near(s.pitch_m, 530e-9 / 0.06, 1e-12);
    assert_near(s.angle_rad, asin(0.06), 1e-12);
}

TEST(a_place_between_the_rows_of_a_crossed_grating_is_of_no_order)
{
    struct spot s = {.u = 500e-9 / 25e-6, .v = 0.5 * 500e-9 / 25e-6};
    spot_conclude(&s, white, 530e-9, 25e-6);
    assert_int_equal(s.n_orders, 0);
}

// Order 1 of 25 um in both axes, blue inside, red outside; sigma a tenth of the value.
static void make_table(struct table *t)
{
    struct err e;
    assert_true(table_init(t, 401, 0.1, 1, 1, &e));
    t->is_rgb = true;
    t->sigma = calloc((size_t)t->n * (size_t)t->n * 3, sizeof *t->sigma);
    for (int j = 0; j < t->n; j++)
        for (int i = 0; i < t->n; i++) {
            const double u = table_node(t, i), v = table_node(t, j), lambda = fabs(u) * 25e-6;
            double xyz[3], rgb[3];
            cie_xyz(lambda, xyz);
            xyz_to_rgb(xyz, rgb);
            float *px = t->tab + 3 * (j * t->n + i);
            for (int c = 0; c < 3; c++) {
                px[c] = (float)(exp(-v * v / 2e-6) * rgb[c] + 4 * exp(-(u * u + v * v) / 2e-6));
                t->sigma[3 * (j * t->n + i) + c] = 0.1f * px[c];
            }
        }
}

TEST(a_table_shows_value_sigma_and_pitch)
{
    struct table t;
    struct spot s;
    make_table(&t);
    assert_true(spot_of_table(&s, &t, 555e-9 / 25e-6, 0));
    spot_conclude(&s, white, NAN, 25e-6);
    assert_near(s.sigma[1], 0.1 * s.rgb[1], 1e-6);
    assert_near(1e9 * s.lambda_m, 555, 3);
    assert_near(1e6 * s.pitch_m, 25, 0.2);
    assert_int_equal(s.order[0].m, 1);
    assert_false(spot_of_table(&s, &t, 0.11, 0));
    assert_near(1e6 * pitch_of_table(&t), 25, 0.5);
    table_finish(&t);
}

// Orders of 25 um at 530 nm whose strengths differ a thousandfold, every third one strong.
TEST(a_photographs_pattern_tells_its_pitch)
{
    struct lut_pattern p = {.w = 400, .h = 300, .h_per_px = 7.2e-4, .cx = 199.5, .cy = 150};
    p.px = calloc((size_t)p.w * (size_t)p.h, sizeof *p.px);
    const double step = 530e-9 / 25e-6 / p.h_per_px;
    for (int j = 0; j < p.h; j++)
        for (int i = 0; i < p.w; i++) {
            const double m = round((i - p.cx) / step), x = i - p.cx - m * step, y = j - p.cy;
            const double strength = (int)fabs(m) % 3 ? 1e-3 : 1;
            p.px[j * p.w + i] = (float)(strength * exp(-(x * x + y * y) / 20 - fabs(m)));
        }
    assert_near(1e6 * pitch_of_pattern(&p, 530e-9), 25, 0.3);
    free(p.px);
}

TEST(a_pixel_of_a_scene_has_the_half_vector_of_its_strongest_light)
{
    struct light lights[2] = {{.at = {0.02, 0, 0.5}, .power = 1}, {.at = {1, 0, 3}, .power = 1}};
    struct object o = {.name = (char *)"plate",
                       .shape = {.kind = SHAPE_PLANE,
                                 .frame = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                 .width_m = 0.2,
                                 .height_m = 0.2}};
    const struct scene scene = {.camera = {{0, 0, 0.5}, {0, 0, 0}, {0, 1, 0}, 0.4},
                                .light = lights,
                                .n_lights = 2,
                                .object = &o,
                                .n_objects = 1};
    struct spot s;
    material_init(&o.material);
    assert_true(spot_of_scene(&s, &scene, 50, 50, 101, 101));
    assert_near(s.u, 0.02 / hypot(0.02, 0.5), 1e-9);
    assert_near(s.v, 0, 1e-9);
    assert_near(s.in_rad, atan2(0.02, 0.5), 1e-9);
    assert_near(s.out_rad, 0, 1e-6);
    assert_string_equal(s.object, "plate");
    assert_false(spot_of_scene(&s, &scene, 0, 0, 1001, 101));
}

TEST_MAIN(cmocka_unit_test(a_spectral_colour_over_white_has_its_wavelength),
          cmocka_unit_test(white_and_purple_have_no_wavelength),
          cmocka_unit_test(a_place_and_a_pitch_tell_the_orders_that_meet_there),
          cmocka_unit_test(a_place_between_the_rows_of_a_crossed_grating_is_of_no_order),
          cmocka_unit_test(a_table_shows_value_sigma_and_pitch),
          cmocka_unit_test(a_photographs_pattern_tells_its_pitch),
          cmocka_unit_test(a_pixel_of_a_scene_has_the_half_vector_of_its_strongest_light))
