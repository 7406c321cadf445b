// test_disc.c - the disc of a bokeh photograph: found to a tenth of a pixel, or refused by reason.
#include "tests/test.h"

#include "calib/bokeh_record.h"
#include "calib/disc.h"
#include "core/mem.h"
#include "tests/noise.h"

enum { W = 400, H = 300 };

static double uneven(double x, double y) // light over the disc, in radii
{
    return 1.05 - 0.1 * (x * x + y * y) + 0.04 * x;
}

// A blurred disc with dark lines every 9 px.
static void paint(float *px, double cx, double cy, double radius, double depth)
{
    for (int j = 0; j < H; j++)
        for (int i = 0; i < W; i++) {
            const double x = (i - cx) / radius, y = (j - cy) / radius;
            const double edge = 0.5 * erfc((hypot(i - cx, j - cy) - radius) / 1.5);
            const double lines = 1 - depth * (0.5 + 0.5 * sin(2 * M_PI * (j + 0.2 * i) / 9));
            px[j * W + i] += (float)(0.5 * edge * uneven(x, y) * lines);
        }
}

TEST(a_disc_with_dark_lines_is_found_to_a_few_tenths_of_a_pixel)
{
    static const double depths[] = {0, 0.4, 0.8};
    for (int k = 0; k < 3; k++) {
        float *px = xcalloc(W * H, sizeof *px);
        struct disc d;
        struct err e = {0};
        paint(px, 180.3, 149.6, 110.4, depths[k]);
        if (!disc_find(&d, px, W, H, &e))
            fail_msg("%s", e.msg);
        assert_near(d.cx_px, 180.3, 0.3);
        assert_near(d.cy_px, 149.6, 0.3);
        assert_near(d.radius_px, 110.4, 1); // deep lines at the rim look like dark outside
        free(px);
    }
}

TEST(flattening_leaves_the_lines_and_takes_the_light)
{
    float *px = xcalloc(W * H, sizeof *px);
    struct disc d;
    struct disc_light l;
    struct err e;
    paint(px, 180.3, 149.6, 110.4, 0.4);
    assert_true(disc_find(&d, px, W, H, &e));
    assert_true(disc_light_fit(&l, &d, px, NULL, W, H, &e));
    disc_flatten(&l, px, W, H, px);
    for (int j = 60; j < 240; j += 7) // against the lines over their own mean
        for (int i = 120; i < 240; i += 7) {
            const double lines = 1 - 0.4 * (0.5 + 0.5 * sin(2 * M_PI * (j + 0.2 * i) / 9));
            if (hypot(i - 180.3, j - 149.6) < 90)
                assert_near(px[j * W + i], lines / 0.8, 0.01);
        }
    assert_int_equal(px[0], 1);
    free(px);
}

TEST(what_is_no_disc_is_refused_with_the_numbers)
{
    static const struct {
        double cx, cy, r, cx2, r2, level;
        const char *sentence;
    } cases[] = {
        {0, 0, 0, 0, 0, 0, "no disc"},
        {100, 150, 60, 290, 55, 0, "two discs: bright areas of"},
        {120, 150, 90, 330, 25, 0,
         "two discs: bright areas of"}, // of a twelfth of the other's area
        {60, 150, 90, 0, 0, 0, "cut by the frame"},
        {180, 150, 100, 0, 0, 0.3, "the disc is saturated"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        float *px = xcalloc(W * H, sizeof *px);
        struct disc d;
        struct err e = {0};
        if (cases[k].r > 0)
            paint(px, cases[k].cx, cases[k].cy, cases[k].r, 0.2);
        if (cases[k].r2 > 0)
            paint(px, cases[k].cx2, cases[k].cy, cases[k].r2, 0.2);
        for (int i = 0; i < W * H && cases[k].level > 0; i++)
            px[i] = fminf(px[i], (float)cases[k].level);
        assert_false(disc_find(&d, px, W, H, &e));
        assert_int_equal(e.code, ERR_DATA);
        if (!strstr(e.msg, cases[k].sentence))
            fail_msg("'%s' lacks '%s'", e.msg, cases[k].sentence);
        free(px);
    }
}

TEST(an_even_or_noisy_picture_has_no_disc)
{
    float *px = xcalloc(W * H, sizeof *px);
    struct disc d;
    struct err e;
    uint64_t seed = 1;
    for (int kind = 0; kind < 3; kind++) { // black, even, noise
        for (int i = 0; i < W * H; i++)
            px[i] = kind == 0 ? 0 : kind == 1 ? 0.3f : (float)(0.3 + 0.1 * noise_uniform(&seed));
        assert_false(disc_find(&d, px, W, H, &e));
        assert_non_null(strstr(e.msg, "no disc: the picture's bright parts"));
    }
    free(px);
}

TEST(a_square_is_not_a_disc)
{
    float *px = xcalloc(W * H, sizeof *px);
    struct disc d;
    struct err e;
    for (int j = 80; j < 220; j++)
        for (int i = 100; i < 240; i++)
            px[j * W + i] = (float)(0.5 + 1e-6 * i);
    assert_false(disc_find(&d, px, W, H, &e));
    assert_non_null(strstr(e.msg, "off a circle"));
    free(px);
}

TEST(a_bokeh_record_reads_back_and_refuses_what_it_cannot_be)
{
    char path[] = "/tmp/nacre-bokeh-XXXXXX";
    struct bokeh_record b = {.channel = "B",
                             .lines_per_m = 6e5,
                             .blaze_rad = 0.2269,
                             .cx_px = 800,
                             .cy_px = 606,
                             .radius_px = 471,
                             .turn_rad = M_PI / 2,
                             .lines = 43.5,
                             .m_per_px = 7.7e-8,
                             .m_per_px_sigma = 1e-11,
                             .sigma_px = 1.87,
                             .iterations = 30,
                             .gain_m = 9e-7,
                             .offset = 0.7,
                             .level = 0.36,
                             .exposure_s = NAN,
                             .rmse = 0.04};
    struct bokeh_record back;
    struct err e = {0};
    close(mkstemp(path));
    record_init(&b.head, "bokeh", "test", b.rmse, "of the height");
    assert_true(bokeh_record_write(&b, "test", path, &e));
    if (!bokeh_record_read(&back, path, &e))
        fail_msg("%s", e.msg);
    assert_near(back.m_per_px, 7.7e-8, 1e-15);
    assert_int_equal(back.iterations, 30);
    assert_string_equal(back.channel, "B");
    b.m_per_px = -1;
    assert_true(bokeh_record_write(&b, "test", path, &e));
    assert_false(bokeh_record_read(&back, path, &e));
    assert_non_null(strstr(e.msg, "m_per_px"));
    unlink(path);
}

TEST_MAIN(cmocka_unit_test(a_disc_with_dark_lines_is_found_to_a_few_tenths_of_a_pixel),
          cmocka_unit_test(flattening_leaves_the_lines_and_takes_the_light),
          cmocka_unit_test(what_is_no_disc_is_refused_with_the_numbers),
          cmocka_unit_test(an_even_or_noisy_picture_has_no_disc),
          cmocka_unit_test(a_square_is_not_a_disc),
          cmocka_unit_test(a_bokeh_record_reads_back_and_refuses_what_it_cannot_be))
