// test_surround.c - environments as the renderers use them.
#include "tests/test.h"

#include "tests/render_fixture.h"

// A dim sky with a bright patch, 64 x 32.
static void fixture_sky(struct surround *s, bool patch)
{
    struct environment env = {0};
    struct err e;
    assert_true(image_init(&env.map, 64, 32, 3, &e));
    for (int k = 0; k < 64 * 32 * 3; k++) {
        const int i = k / 3 % 64, j = k / 3 / 64;
        const double at = patch && hypot(i - 52, j - 13) < 3 ? 40 : 0;
        env.map.px[k] = (float)(at + (patch ? 0.2 + 0.1 * (k % 3) * sin(0.2 * i) : 1));
    }
    struct err e2;
    assert_true(surround_init(s, &env, 1, 0, &e2));
}

TEST(an_even_sky_lights_every_side_with_pi)
{
    struct surround s;
    double rgb[3];
    fixture_sky(&s, false);
    surround_irradiance(&s, v3_unit(v3(1, 2, -3)), rgb);
    assert_near(rgb[1], M_PI, 1e-3);
    double sum = 0;
    for (int k = 0; k < s.n_lights; k++)
        sum += s.light[k].irradiance[0];
    assert_int_equal(s.n_lights, SURROUND_LIGHTS);
    assert_near(sum, 4 * M_PI, 1e-9);
    surround_radiance(&s, v3(0, 1, 0), rgb);
    assert_near(rgb[2], 1, 1e-12);
    surround_finish(&s);
}

TEST(spots_and_the_rest_hold_all_of_the_light)
{
    struct surround s;
    struct environment env = {0};
    struct err e;
    double all = 0, spots = 0, rest[3] = {0};
    assert_true(image_init(&env.map, 200, 100, 3, &e)); // not a power of two
    for (int k = 0; k < 200 * 100 * 3; k++)
        env.map.px[k] = (float)(k / 3 == 50 * 200 + 31 ? 3000 : 1 + 0.5 * sin(0.01 * k));
    assert_true(surround_init(&s, &env, 1, 0, &e));
    for (int k = 0; k < 200 * 100; k++)
        all += surround_row_angle(&s.env.map, k / 200) * (double)s.env.map.px[3 * k + 1];
    for (int k = 0; k < s.n_spots; k++)
        spots += s.spot[k].irradiance[1];
    for (int level = 0; level < s.n_levels; level++) {
        const struct image *im = &s.rest[level];
        double sum = 0;
        for (int k = 0; k < im->w * im->h; k++)
            sum += surround_row_angle(im, k / im->w) * (double)im->px[3 * k + 1];
        assert_near((spots + sum) / all, 1, 1e-5);
    }
    assert_true(spots > 0.1 * all);
    surround_rest(&s, v3(0, 1, 0), 10, rest); // the last level: nearly the mean
    assert_true(rest[1] > 0.2 && rest[1] < 10);
    surround_finish(&s);
}

TEST(turning_the_sky_turns_what_is_seen)
{
    struct surround a, b;
    struct environment env = {0};
    struct err e;
    double x[3], y[3];
    fixture_sky(&a, true);
    assert_true(image_init(&env.map, 64, 32, 3, &e));
    memcpy(env.map.px, a.env.map.px, 64 * 32 * 3 * sizeof(float));
    assert_true(surround_init(&b, &env, 2, M_PI / 2, &e)); // about +y: z goes to x
    for (int k = 0; k < 50; k++) {
        const struct vec3 d = v3_unit(v3(sin(k), cos(2 * k), sin(3 * k + 1)));
        surround_radiance(&a, d, x);
        surround_radiance(&b, v3(d.z, d.y, -d.x), y);
        for (int c = 0; c < 3; c++)
            assert_near(y[c], 2 * x[c], 1e-4 * x[c]);
    }
    surround_finish(&a);
    surround_finish(&b);
}

// A wide smooth table, so that 2,048 pixels as point lights are an integral.
static void wide_table(struct material *m)
{
    struct table t;
    struct err e;
    assert_true(table_init(&t, 65, 1.2, 1, 1, &e));
    t.is_rgb = true;
    for (int k = 0; k < 65 * 65; k++) {
        const double u = table_node(&t, k % 65), v = table_node(&t, k / 65);
        for (int c = 0; c < 3; c++)
            t.tab[3 * k + c] = (float)exp(-(u * u + 2 * v * v) / 0.09);
    }
    material_take_table(m, &t, 0.04);
}

TEST(a_prefiltered_map_is_the_sum_over_the_sky)
{
    struct surround around;
    struct image map, sum;
    struct err e;
    fixture_sky(&around, true);
    struct object o = fixture_object(SHAPE_PLANE);
    wide_table(&o.material);
    struct scene s = fixture_scene(&o, NULL, 0);
    s.w = 40;
    s.h = 30;
    s.surround = &around;
    s.seen_size = 256;
    assert_true(cpu_render(&s, true, &sum, &e)); // no map yet: every pixel of the sky is a light
    assert_true(scene_prefilter(&s, &e));
    assert_true(cpu_render(&s, true, &map, &e));
    assert_near(rel_rmse(&map, &sum), 0, 0.02); // the light's share: the rest is the same backdrop
    image_finish(&map);
    image_finish(&sum);
    image_finish(&o.seen);
    material_finish(&o.material);
    surround_finish(&around);
}

TEST(a_still_camera_sees_the_same_of_a_smaller_map)
{
    struct surround around;
    struct image whole, part;
    struct err e;
    fixture_sky(&around, true);
    struct object o = fixture_object(SHAPE_PLANE);
    wide_table(&o.material);
    struct scene s = fixture_scene(&o, NULL, 0);
    s.surround = &around;
    s.seen_size = 256;
    assert_true(scene_prefilter(&s, &e));
    assert_true(cpu_render(&s, false, &whole, &e));
    const struct image all = o.seen;
    o.seen = (struct image){0};
    s.still = true;
    assert_true(scene_prefilter(&s, &e));
    assert_true(cpu_render(&s, false, &part, &e));
    int missing = 0;
    for (int k = 0; k < 3 * 256 * 256; k++)
        missing += all.px[k] > 0 && !(o.seen.px[k] > 0);
    assert_true(missing > 100000); // nodes that this camera does not see
    assert_near(rel_rmse(&part, &whole), 0, 1e-5);
    image_finish(&whole);
    image_finish(&part);
    image_finish(&o.seen);
    o.seen = all;
    image_finish(&o.seen);
    material_finish(&o.material);
    surround_finish(&around);
}

TEST(gl_shows_environments_as_the_cpu_does)
{
    struct surround around;
    struct light light = {.at = {0.03, 0.05, 0.45}, .power = 0.1, .tint = {1, 1, 1}};
    struct err e;
    fixture_sky(&around, true);
    for (enum shape_kind k = SHAPE_PLANE; k <= SHAPE_SPHERE; k++) {
        struct object o = fixture_object(k);
        wide_table(&o.material);
        o.material.diffuse[0] = 0.5;
        o.material.specular[1] = 0.3;
        o.material.roughness = 0.3;
        o.material.coat_ior = 1.5;
        struct scene s = fixture_scene(&o, &light, 1);
        s.surround = &around;
        s.seen_size = 128;
        assert_true(scene_prefilter(&s, &e));
        assert_int_equal(o.seen.px != NULL, k == SHAPE_PLANE);
        compare_backends(&s);
        image_finish(&o.seen);
        lobes_finish(&o.lobes[DIFFRACTION_TABLE]);
        material_finish(&o.material);
    }
    surround_finish(&around);
}

TEST_MAIN(cmocka_unit_test(an_even_sky_lights_every_side_with_pi),
          cmocka_unit_test(spots_and_the_rest_hold_all_of_the_light),
          cmocka_unit_test(turning_the_sky_turns_what_is_seen),
          cmocka_unit_test(a_prefiltered_map_is_the_sum_over_the_sky),
          cmocka_unit_test(a_still_camera_sees_the_same_of_a_smaller_map),
          cmocka_unit_test(gl_shows_environments_as_the_cpu_does))
