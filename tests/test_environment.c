// test_environment.c - lat-long maps: what is refused, radiance between pixels, light in parts.
#include "tests/env_case.h"

static struct environment flat(int h, float value)
{
    struct image im;
    struct err e = {0};
    struct environment env;
    assert_true(image_init(&im, 2 * h, h, 3, &e));
    for (int k = 0; k < 6 * h * h; k++)
        im.px[k] = value;
    assert_true(environment_take(&env, &im, "flat", &e));
    return env;
}

TEST(impossible_maps_are_refused_with_the_reason)
{
    static const struct {
        int w, h, nc, at;
        float value;
        const char *why;
    } bad[] = {
        {6, 4, 3, 0, 0, "m: 6 x 4 pixels: a lat-long map is twice as wide as high, at least 4 x 2"},
        {2, 1, 3, 0, 0, "m: 2 x 1 pixels: a lat-long map is twice as wide as high, at least 4 x 2"},
        {8, 4, 2, 0, 0, "m: 2 channels: must be R,G,B or grey"},
        {8, 4, 3, 3 * 11 + 1, -1,
         "m: pixel (3, 1) has radiance -1: must be finite and not negative"},
        {8, 4, 3, 3 * 31, NAN, "m: pixel (7, 3) has radiance nan: must be finite and not negative"},
        {8, 4, 1, 0, INFINITY, "m: pixel (0, 0) has radiance inf: must be finite and not negative"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        struct image im;
        struct environment env;
        struct err e = {0};
        assert_true(image_init(&im, bad[k].w, bad[k].h, bad[k].nc, &e));
        im.px[bad[k].at] = bad[k].value;
        assert_false(environment_take(&env, &im, "m", &e));
        assert_int_equal(e.code, ERR_DATA);
        assert_string_equal(e.msg, bad[k].why);
        image_finish(&im);
    }
}

TEST(radiance_is_the_pixel_at_its_centre_and_smooth_over_the_seam_and_the_poles)
{
    struct environment env = case_environment(64, &case_axes);
    double rgb[3], sky[3], worst = 0;
    environment_radiance(&env, latlong_dir(37, 11, 128, 64), rgb);
    assert_near(rgb[1], env.map.px[(11 * 128 + 37) * 3 + 1], 1e-5);
    for (int k = 0; k < 4000; k++) { // a spiral over the sphere meets seam and poles
        const double y = 1 - 2 * (k + .5) / 4000, r = sqrt(1 - y * y), a = 2.4 * k;
        const struct vec3 d = v3(r * cos(a), y, r * sin(a));
        environment_radiance(&env, d, rgb);
        case_sky(d, sky);
        worst = fmax(worst, fabs(rgb[0] - sky[0]));
    }
    print_message("worst %g of 40\n", worst);
    assert_true(worst < .1 * 40); // lights with a sigma of one pixel, peak 40
    environment_finish(&env);
}

TEST(parts_add_up_to_the_hemisphere_and_its_projected_area)
{
    struct environment env = flat(32, 1);
    const struct frame f = case_frame(.2, .7, -.4, .5, .3, .6);
    for (int cut = 1; cut <= 4; cut++) {
        struct env_parts parts;
        struct err e = {0};
        assert_true(env_parts_init(&parts, &env, &f, cut, &e));
        struct env_part *p = xcalloc(env_parts_room(&parts), sizeof *p);
        double sr = 0, area = 0, skew = 0;
        for (int row = 0; row < 32; row++)
            for (int k = env_parts_row(&parts, row, p) - 1; k >= 0; k--) {
                sr += p[k].power[0];
                area += p[k].power[0] * p[k].n;
                skew += p[k].power[0] * p[k].t;
            }
        assert_near(sr, 2 * M_PI, 2e-3 / cut);
        assert_near(area, M_PI, 1e-2 / cut / cut);
        assert_near(skew, 0, 1e-2 / cut / cut);
        free(p);
        env_parts_finish(&parts);
    }
    environment_finish(&env);
}

TEST(dark_pixels_have_no_parts)
{
    struct environment env = flat(32, 0);
    env.map.px[(10 * 64 + 20) * 3 + 2] = 1;
    struct frame f;
    struct env_parts parts;
    struct err e = {0};
    const struct vec3 d = latlong_dir(20, 10, 64, 32);
    assert_true(frame_from(v3(d.y, -d.x, d.z + 1), d, &f));
    assert_true(env_parts_init(&parts, &env, &f, 2, &e));
    struct env_part *p = xcalloc(env_parts_room(&parts), sizeof *p);
    int n = 0;
    for (int row = 0; row < 32; row++)
        n += env_parts_row(&parts, row, p);
    assert_true(n > 0 && n <= 64); // the pixel's own and those that its cubic reaches
    free(p);
    env_parts_finish(&parts);
    environment_finish(&env);
}

TEST_MAIN(
    cmocka_unit_test(impossible_maps_are_refused_with_the_reason),
    cmocka_unit_test(radiance_is_the_pixel_at_its_centre_and_smooth_over_the_seam_and_the_poles),
    cmocka_unit_test(parts_add_up_to_the_hemisphere_and_its_projected_area),
    cmocka_unit_test(dark_pixels_have_no_parts))
