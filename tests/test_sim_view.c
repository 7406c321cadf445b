// test_sim_view.c - half vectors from positions, where orders fall, and what the lens does.
#include "tests/test.h"

#include "sim/lens.h"
#include "sim/photo.h"

static void open_scene(struct sim_scene *s, const char *text)
{
    struct err e = {0};
    if (!sim_scene_open_text(s, "scene.yaml", text, NULL, &e))
        fail_msg("%s", e.msg);
}

static void photograph(const struct sim_scene *s, struct image *im)
{
    struct band b = {0};
    struct err e = {0};
    if (!band_gaussian(&b, 530e-9, 0.2e-9, 1, false, &e) || !photo_pattern(s, &b, im, &e))
        fail_msg("%s", e.msg);
    band_finish(&b);
}

// Centre of gravity of what is within `r` pixels of (i, j).
static void centroid(const struct image *im, double i0, double j0, int r, double out[2])
{
    double sum = 0;
    out[0] = out[1] = 0;
    for (int j = (int)j0 - r; j <= (int)j0 + r; j++)
        for (int i = (int)i0 - r; i <= (int)i0 + r; i++) {
            assert_in_range(i, 0, im->w - 1);
            assert_in_range(j, 0, im->h - 1);
            const double l = (double)im->px[j * im->w + i];
            sum += l;
            out[0] += l * i;
            out[1] += l * j;
        }
    out[0] /= sum;
    out[1] /= sum;
}

static const char camera_scene[] = "sample: {kind: lcd, pitch: 20um, coherence: 130um}\n"
                                   "view: {kind: camera, width: 800, height: 600, light-diameter: "
                                   "0m, focal: 10.88mm, natural-vignetting: no}\n";

// h.t at (x, y, 0) for the scene above: camera at (0, 0, 0.5), light at (0.03, 0, 0.5).
static double h_t(double x, double y, double along_y)
{
    const double to_c = sqrt(x * x + y * y + 0.25);
    const double to_l = sqrt((0.03 - x) * (0.03 - x) + y * y + 0.25);
    return along_y ? -y / to_l - y / to_c : (0.03 - x) / to_l - x / to_c;
}

TEST(orders_lie_at_m_lambda_over_d_within_a_tenth_of_a_pixel)
{
    struct sim_scene s;
    struct image im;
    open_scene(&s, camera_scene);
    photograph(&s, &im);
    const double step = 530e-9 / 20e-6, focal_px = 10.88e-3 / 5e-6;
    for (int m = -4; m <= 4; m++)
        for (int n = -3; n <= 3; n++) {
            if (m % 3 && n) // these orders are weak: their neighbours' flanks would move them
                continue;
            double x = 0.015,
                   y = 0; // Newton by alternating axes: h.t depends mostly on x, h.b on y
            for (int turn = 0; turn < 200; turn++) {
                x += 0.25 * (h_t(x, y, 0) - m * step);
                y += 0.25 * (h_t(x, y, 1) - n * step);
            }
            double at[2];
            const double i = 399.5 + focal_px * x / 0.5, j = 299.5 - focal_px * y / 0.5;
            centroid(&im, rint(i), rint(j), 14, at);
            assert_near(at[0], i, 0.1);
            assert_near(at[1], j, 0.1);
        }
    image_finish(&im);
    sim_scene_finish(&s);
}

TEST(a_mirror_shows_the_light_where_reflection_puts_it)
{
    struct sim_scene s;
    struct image im;
    double at[2];
    open_scene(&s, "sample: {kind: flat, coherence: 200um}\n"
                   "view: {kind: camera, light: [0.04m, 0.02m, 0.6m], light-diameter: 0m,\n"
                   "       normal: [0.05, -0.02, 1], width: 600, height: 600, focal: 10mm}\n");
    photograph(&s, &im);
    int top = 0;
    for (int k = 0; k < 600 * 600; k++)
        top = im.px[k] > im.px[top] ? k : top;
    centroid(&im, top % 600, top / 600, 8, at);
    // The light's mirror image: where the line to it meets the plane through the origin.
    const struct vec3 n = v3_unit(v3(0.05, -0.02, 1)), l = v3(0.04, 0.02, 0.6), c = v3(0, 0, 0.5);
    const struct vec3 image = v3_sub(l, v3_scale(2 * v3_dot(l, n), n)), d = v3_sub(image, c);
    const struct vec3 x = v3_add(c, v3_scale(-v3_dot(c, n) / v3_dot(d, n), d));
    assert_near(at[0], 299.5 + 2000 * x.x / (0.5 - x.z), 0.1);
    assert_near(at[1], 299.5 - 2000 * x.y / (0.5 - x.z), 0.1);
    image_finish(&im);
    sim_scene_finish(&s);
}

TEST(a_sample_turned_by_30_degrees_turns_the_picture_by_30_degrees)
{
    struct sim_scene s, turned;
    struct image a, b;
    const char *const view = "view: {width: 400, height: 400, h-per-pixel: 1e-3}\n";
    char text[2][300];
    for (int k = 0; k < 2; k++)
        snprintf(text[k], sizeof text[k],
                 "sample: {kind: lcd, pitch: [20um, 14um], turn: %ddeg}\n%s", 30 * k, view);
    open_scene(&s, text[0]);
    open_scene(&turned, text[1]);
    photograph(&s, &a);
    photograph(&turned, &b);
    static const int order[][2] = {{3, 0}, {0, 1}, {0, -3}, {-3, 2}};
    for (size_t k = 0; k < sizeof order / sizeof *order; k++) {
        const double x = order[k][0] * 530e-9 / 20e-6 / 1e-3,
                     y = order[k][1] * 530e-9 / 14e-6 / 1e-3;
        const double c = cos(M_PI / 6), i = sin(M_PI / 6);
        double at[2], at_turned[2];
        centroid(&a, rint(199.5 + x), rint(199.5 + y), 9, at);
        centroid(&b, rint(199.5 + c * x - i * y), rint(199.5 + i * x + c * y), 9, at_turned);
        assert_near(at_turned[0] - 199.5, c * (at[0] - 199.5) - i * (at[1] - 199.5), 0.1);
        assert_near(at_turned[1] - 199.5, i * (at[0] - 199.5) + c * (at[1] - 199.5), 0.1);
    }
    image_finish(&a);
    image_finish(&b);
    sim_scene_finish(&s);
    sim_scene_finish(&turned);
}

static void assert_same_sight(const struct sight *a, const struct sight *b, double tol)
{
    assert_near(a->u, b->u, tol);
    assert_near(a->v, b->v, tol);
    assert_near(a->w, b->w, tol);
    assert_near(a->factor, b->factor, 10 * tol * b->factor);
}

TEST(a_distorted_pixel_sees_what_the_model_says)
{
    struct sim_scene plain, bent;
    open_scene(&plain, "sample: {kind: flat}\nview: {kind: camera}\n");
    open_scene(&bent, "sample: {kind: flat}\n"
                      "view: {kind: camera, distortion: [-0.3, 0.1, 1e-3, -2e-3, 0.05]}\n");
    for (int k = 0; k < 50; k++) {
        const double f = plain.view.focal_px, x = 0.17 * sin(k), y = 0.17 * cos(1.3 * k);
        const double r2 = x * x + y * y, radial = 1 + r2 * (-0.3 + r2 * (0.1 + r2 * 0.05));
        const double xd = x * radial + 2e-3 * x * y - 2e-3 * (r2 + 2 * x * x); // Brown 1966
        const double yd = y * radial + 1e-3 * (r2 + 2 * y * y) - 4e-3 * x * y;
        struct sight a[SIGHTS], b[SIGHTS];
        view_sights(&plain.view, &plain.sample, 499.5 + f * x, 499.5 + f * y, a);
        view_sights(&bent.view, &bent.sample, 499.5 + f * xd, 499.5 + f * yd, b);
        assert_same_sight(b, a, 1e-10);
    }
    sim_scene_finish(&plain);
    sim_scene_finish(&bent);
}

TEST(a_barely_bent_sample_is_a_plane)
{
    struct sim_scene flat, bent;
    open_scene(&flat, "sample: {kind: flat}\nview: {kind: camera}\n");
    open_scene(&bent,
               "sample: {kind: flat, layout: cylinder, bend: 1000m}\nview: {kind: camera}\n");
    for (int k = 0; k < 20; k++) {
        struct sight a[SIGHTS], b[SIGHTS];
        view_sights(&flat.view, &flat.sample, 50 * k, 999 - 37 * k, a);
        view_sights(&bent.view, &bent.sample, 50 * k, 999 - 37 * k, b);
        assert_same_sight(a, b, 3e-4); // 0.1 m of 1000 m is an angle of 1e-4
    }
    sim_scene_finish(&flat);
    sim_scene_finish(&bent);
}

// What is in the geometry record turns radiance into the far field: L / E weight = Lm, and by the
// BRDF Lm = F0^2 D / w^2 (docs/optics.md 2, 3).
TEST(the_geometry_record_undoes_the_geometry)
{
    struct sim_scene s;
    struct image im, record;
    struct err e = {0};
    open_scene(&s, camera_scene);
    photograph(&s, &im);
    assert_true(photo_geometry(&s, &record, &e));
    assert_int_equal(image_channel_index(&record, "weight"), 3);
    double top = 0, worst = 0;
    for (int j = 150; j < 450; j += 7)
        for (int i = 200; i < 600; i += 7) {
            const float *at = record.px + 4 * (j * 800 + i);
            const double w = (double)at[2];
            const double d = farfield_ref(&s.sample, (double)at[0], (double)at[1], w, 530e-9);
            const double lm = (double)im.px[j * 800 + i] * (double)at[3];
            top = fmax(top, s.sample.r0 * d / (w * w));
            worst = fmax(worst, fabs(lm - s.sample.r0 * d / (w * w)));
        }
    assert_true(worst < 2e-4 * top); // u and v are floats, and lobes 1e-3 wide; the band is 0.2 nm
    image_finish(&im);
    image_finish(&record);
    sim_scene_finish(&s);
}

TEST(the_lens_keeps_light_and_spreads_it_as_it_says)
{
    struct image im;
    struct err e = {0};
    assert_true(image_init(&im, 301, 301, 1, &e));
    im.px[150 * 301 + 150] = 1000;
    assert_true(lens_blur(&im, 0, 3, &e));
    double sum = 0, second = 0;
    for (int k = 0; k < 301 * 301; k++) {
        sum += (double)im.px[k];
        second += (double)im.px[k] * pow(k % 301 - 150, 2);
    }
    assert_near(sum, 1000, 1e-3);
    assert_near(second / sum, 9, 1e-3);
    assert_true(lens_glare(&im, 0.1, 20, &e));
    // At r = 100 the veil is 100 * 20 / (2 pi (100^2 + 20^2)^1.5).
    assert_near((double)im.px[150 * 301 + 250], 100 * 20 / (2 * M_PI * pow(10400, 1.5)), 1e-5);
    sum = 0;
    for (int k = 0; k < 301 * 301; k++)
        sum += (double)im.px[k];
    assert_true(sum > 1000 * (1 - 0.1 * 20 / 150) && sum < 1000); // the rest leaves the picture
    image_finish(&im);
}

TEST(a_large_light_blurs_the_pattern_by_its_size)
{
    struct sim_scene s;
    struct sight at[SIGHTS];
    open_scene(&s, "sample: {kind: flat}\nview: {kind: camera, light-diameter: 10mm}\n");
    assert_int_equal(view_sights(&s.view, &s.sample, 499.5, 499.5, at), 7);
    double share = 0, mean = 0, second = 0;
    for (int k = 0; k < 7; k++) {
        share += at[k].share;
        mean += at[k].share * at[k].u;
        second += at[k].share * pow(at[k].u - at[0].u, 2);
    }
    assert_near(share, 1, 1e-15);
    assert_near(mean, at[0].u, 1e-5);
    // A disc of radius a has a mean square of a^2 / 4 along an axis; here it is 0.5 m away.
    assert_near(sqrt(second), 0.5 * 5e-3 / 0.5, 3e-5);
    sim_scene_finish(&s);
}

TEST(a_bokeh_shows_the_grating_turned_and_blue_sharpest)
{
    struct sim_scene s;
    struct image im;
    struct err e = {0};
    open_scene(&s, "sample: {kind: blazed, lines: 300/mm, blaze: 10deg}\n"
                   "bokeh: {width: 400, height: 300, radius: 140px, pixel: 0.1um}\n");
    assert_true(bokeh_photo(&s.bokeh, &s.sample, &im, &e));
    assert_near((double)im.px[0], 0, 1e-6); // outside the disc
    // The grating runs along x; turned counter-clockwise it runs up: a column repeats every 33.3
    // px.
    double contrast[3], drift = 0;
    for (int c = 0; c < 3; c++) {
        double re = 0, im_ = 0, mean = 0;
        for (int j = 100; j < 200; j++) { // three periods
            const double l = (double)im.px[(j * 400 + 200) * 3 + c];
            re += l * cos(2 * M_PI * j * 0.1 / (1e3 / 300));
            im_ += l * sin(2 * M_PI * j * 0.1 / (1e3 / 300));
            mean += l;
        }
        contrast[c] = hypot(re, im_) / mean;
    }
    for (int i = 180; i < 220; i++)
        drift = fmax(
            drift,
            fabs((double)im.px[(150 * 400 + i) * 3] / (double)im.px[(150 * 400 + 200) * 3] - 1));
    assert_true(contrast[0] > 0.1 && contrast[1] > contrast[0] && contrast[2] > contrast[1]);
    assert_true(drift < 0.01); // along the lines only the shade changes
    // Heights rise with x, that is upwards: from one pixel to the one above it grows brighter, save
    // at the step.
    int brighter = 0;
    for (int j = 100; j < 200; j++)
        brighter += im.px[((j - 1) * 400 + 200) * 3 + 2] > im.px[(j * 400 + 200) * 3 + 2];
    assert_true(brighter > 70);
    image_finish(&im);
    sim_scene_finish(&s);
}

TEST(scenes_that_cannot_be_are_refused_with_their_line)
{
    static const struct {
        const char *text, *msg;
    } bad[] = {
        {"sample: {kind: flat}\nview: {h-per-pixel: 0}\n",
         "s.yaml:2: h-per-pixel: 0 is out of range: must be 1e-07 to 1"},
        {"sample: {kind: cd}\n", "s.yaml:1: a disc or a bent sample needs 'kind: camera'"},
        {"sample: {kind: flat}\nview:\n  kind: camera\n  light: [0m, 0m, -1m]\n",
         "s.yaml:3: view: camera and light must be on the side of the sample's normal"},
        {"sample: {kind: flat}\nview: {kind: camera, up: [0, 0, 1]}\n",
         "s.yaml:2: view: the camera looks along 'up', or is at its target"},
        {"sample: {kind: flat}\nsensor:\n  exposure-min: 0s\n",
         "s.yaml:3: exposure-min: 0s is out of range: must be 1 ns to 10 s"},
        {"sample: {kind: flat}\nsensor:\n  bits: 7\n",
         "s.yaml:3: bits: 7 is out of range: must be 8 to 16"},
        {"view: {width: 100}\n", "s.yaml:1: needs the key 'sample'"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        struct sim_scene s = {0};
        struct err e = {0};
        assert_false(sim_scene_open_text(&s, "s.yaml", bad[k].text, NULL, &e));
        assert_string_equal(e.msg, bad[k].msg);
        assert_int_equal(e.code, ERR_DATA);
    }
}

TEST_MAIN(cmocka_unit_test(a_bokeh_shows_the_grating_turned_and_blue_sharpest),
          cmocka_unit_test(scenes_that_cannot_be_are_refused_with_their_line),
          cmocka_unit_test(orders_lie_at_m_lambda_over_d_within_a_tenth_of_a_pixel),
          cmocka_unit_test(a_mirror_shows_the_light_where_reflection_puts_it),
          cmocka_unit_test(a_sample_turned_by_30_degrees_turns_the_picture_by_30_degrees),
          cmocka_unit_test(a_distorted_pixel_sees_what_the_model_says),
          cmocka_unit_test(a_barely_bent_sample_is_a_plane),
          cmocka_unit_test(the_geometry_record_undoes_the_geometry),
          cmocka_unit_test(the_lens_keeps_light_and_spreads_it_as_it_says),
          cmocka_unit_test(a_large_light_blurs_the_pattern_by_its_size))
