// test_render.c - the reflectance, the two renderers against each other, scene files.
#include "tests/test.h"

#include "render/display.h"
#include "tests/render_fixture.h"

TEST(a_plain_table_is_the_brdf_of_t17)
{
    struct material m;
    struct table t;
    struct err e;
    material_init(&m);
    assert_true(table_init(&t, 3, 1, 1, 1, &e));
    t.is_rgb = true;
    for (int k = 0; k < 27; k++)
        t.tab[k] = 2;
    material_take_table(&m, &t, 0.04);
    const struct vec3 wi = v3_unit(v3(0.3, 0.1, 1)), wo = v3_unit(v3(-0.1, 0.2, 1));
    double out[3];
    material_eval(&m, wi, wo, white, 1, out);
    const double x = 1 + v3_dot(wi, wo), g = x * x / (wi.z * wo.z);
    const double fresnel = 0.04 + 0.96 * pow(1 - v3_norm(v3_add(wi, wo)) / 2, 5);
    assert_near(out[1], 4 * M_PI * M_PI * fresnel * g * 2 * wi.z, 1e-12 * out[1]);

    const struct vec3 steep = v3_unit(v3(3, 0.7, 1));
    m.table.range = 0.8; // h.t is above
    material_eval(&m, steep, wo, white, 1, out);
    assert_near(out[1], 0, 0);
    material_finish(&m);
}

TEST(tables_from_heights_leave_w_to_the_renderer)
{
    struct material m;
    struct table t;
    struct err e;
    material_init(&m);
    assert_true(table_init(&t, 3, 1, 1, 2, &e));
    t.is_rgb = true;
    t.basis = TABLE_CHEBYSHEV;
    t.w_max = 2;
    for (int k = 0; k < 27; k++) {
        t.tab[k] = 1;
        t.tab[27 + k] = 0.5;
    }
    material_take_table(&m, &t, 0.04);
    double out[3];
    material_eval(&m, v3(0, 0, 1), v3(0, 0, 1), white, 1, out);
    assert_near(out[0], (1 + 0.5 * 1) * 4 / (2 * 2), 1e-12); // F^2 / F0^2 G / w^2, w = 2
    m.tables_used = 1;
    material_eval(&m, v3(0, 0, 1), v3(0, 0, 1), white, 1, out);
    assert_near(out[0], 1, 1e-12);
    material_finish(&m);
}

TEST(no_layer_but_the_table_returns_more_than_it_gets)
{
    struct material m;
    material_init(&m);
    for (int layer = 0; layer < 3; layer++) {
        m.coat_ior = layer == 2 ? 1.5 : 1;
        for (int c = 0; c < 3; c++) {
            m.diffuse[c] = layer == 1 ? 0 : 1;
            m.specular[c] = layer == 1;
        }
        m.roughness = 0.3;
        for (int tilt = 0; tilt < 4; tilt++) {
            const struct vec3 wo = v3(sin(0.4 * tilt), 0, cos(0.4 * tilt));
            double sum = 0;
            enum { N = 200 };
            for (int j = 0; j < N; j++)
                for (int i = 0; i < 2 * N; i++) { // equal solid angles
                    const double z = (j + .5) / N, r = sqrt(1 - z * z), a = M_PI * (i + .5) / N;
                    double out[3];
                    material_eval(&m, v3(r * cos(a), r * sin(a), z), wo, white, 1, out);
                    sum += out[1] * M_PI / (N * N);
                }
            assert_true(sum < 1.001); // the sum over directions itself is good to 1e-4
            assert_true(sum > (layer == 1 && tilt == 3 ? 0.6 : 0.75)); // V-grooves lose some light
        }
    }
}

TEST(gl_draws_every_shape_as_the_cpu_does)
{
    struct light lights[] = {
        {.at = {0.03, 0.05, 0.45}, .power = 1, .tint = {1, 1, 1}},
        {.is_far = true, .at = {-0.1, 0.0, 0.99498743710662}, .power = 0.5, .tint = {1, 1, 1}}};
    struct err e;
    for (enum shape_kind k = SHAPE_PLANE; k <= SHAPE_SPHERE; k++) {
        struct object o = fixture_object(k);
        struct table t;
        assert_true(fixture_lcd(&t, 65, 0.35, k == SHAPE_DISC ? 1 : 5, &e));
        material_take_table(&o.material, &t, 0.04);
        o.material.diffuse[0] = o.material.diffuse[1] = 0.1;
        o.material.specular[2] = 0.5;
        o.material.coat_ior = 1.5;
        struct scene s = fixture_scene(&o, lights, 2);
        compare_backends(&s);
        material_finish(&o.material);
    }
}

TEST(gl_sums_tables_as_the_cpu_does)
{
    struct light light = {.at = {0.03, 0.05, 0.45}, .power = 1, .tint = {1, 1, 1}};
    struct err e;
    for (enum table_basis b = TABLE_TAYLOR; b <= TABLE_POD; b++) {
        struct object o = fixture_object(SHAPE_CYLINDER);
        struct table t;
        assert_true(table_init(&t, 33, 1.5, 3, 5, &e));
        for (int k = 0; k < 5 * 33 * 33 * 3; k++)
            t.tab[k] = (float)(1 + sin(0.7 * k) * cos(0.13 * k));
        t.basis = b;
        t.w_max = 2;
        t.nw = 9;
        t.curve = malloc(sizeof(double) * 5 * 9);
        for (int k = 0; k < 45; k++)
            t.curve[k] = 1 + sin(1.7 * k);
        material_take_table(&o.material, &t, 0.04);
        o.material.tables_used = b == TABLE_POD ? 3 : 0;
        struct scene s = fixture_scene(&o, &light, 1);
        compare_backends(&s);
        material_finish(&o.material);
    }
}

TEST(a_far_lamp_is_a_near_one_taken_far)
{
    struct light lights[2] = {{.at = {3e4, 0, 1e5}, .power = 1e10 + 9e8, .tint = {1, 1, 1}},
                              {.is_far = true, .power = 1, .tint = {1, 1, 1}}};
    lights[1].at = v3_unit(lights[0].at);
    struct image im[2];
    struct err e;
    struct object o = fixture_object(SHAPE_PLANE);
    o.material.diffuse[1] = 0.5;
    for (int k = 0; k < 2; k++) {
        struct scene s = fixture_scene(&o, &lights[k], 1);
        assert_true(cpu_render(&s, false, &im[k], &e));
    }
    assert_near(rel_rmse(&im[0], &im[1]), 0, 1e-5);
    image_finish(&im[0]);
    image_finish(&im[1]);
}

TEST(the_display_keeps_what_it_can_show)
{
    struct image im;
    struct err e;
    assert_true(image_init(&im, 4, 1, 3, &e));
    const float in[12] = {0.25f, 0.5f, 0.75f, 40, 40, 20, -0.2f, 0.5f, 0.1f, NAN, 0, 0};
    memcpy(im.px, in, sizeof in);
    display_map(&im, 0);
    for (int c = 0; c < 3; c++)
        assert_near(im.px[c], in[c], 1e-6);
    for (int k = 3; k < 12; k++)
        assert_true(im.px[k] >= 0 && im.px[k] <= 1);
    assert_true(im.px[3] > 0.99f && im.px[5] > 0.9f); // far above white: nearly white
    assert_near(im.px[6], 0, 1e-6);                   // out of gamut: on its edge, same luminance
    assert_near(0.2126 * (double)im.px[6] + 0.7152 * (double)im.px[7] + 0.0722 * (double)im.px[8],
                0.2126 * -0.2 + 0.7152 * 0.5 + 0.0722 * 0.1, 1e-6);
    assert_near(im.px[9], 0, 0);
    image_finish(&im);
}

static const char good[] = "camera: {eye: [0, 0, 0.5m]}\n"
                           "lights: [{at: [0, 0, 1m]}]\n"
                           "sample: {shape: plane, size: [10mm, 20mm], diffuse: 0.5}\n";

static bool read_text(const char *text, struct err *e)
{
    char path[] = "/tmp/nacre_scene_XXXXXX";
    const int fd = mkstemp(path);
    assert_true(fd >= 0 && write(fd, text, strlen(text)) == (ssize_t)strlen(text));
    close(fd);
    const struct scene_options o = {.exposure_ev = NAN};
    struct scene s = {0};
    const bool ok = scene_read(&s, path, &o, e);
    if (ok) {
        assert_near(s.object[0].shape.height_m, 0.02, 1e-15);
        assert_near(s.light_color[1], 1, 0.1);
        scene_finish(&s);
    } else { // without the random name
        memmove(e->msg, strstr(e->msg, path) + strlen(path), strlen(strstr(e->msg, path)));
    }
    unlink(path);
    return ok;
}

TEST(bad_scenes_name_the_line_and_what_would_be_right)
{
    static const struct {
        const char *text, *says;
    } bad[] = {
        {"lights: []\nsample: {}\n", ":1: needs the key 'camera'"},
        {"camera: {eye: [0, 0, 0]}\n",
         ":1: camera: eye and target must differ, and up must not lie along the view"},
        {"camera: {eye: [0, 0, 1m]}\nlights: [{at: [0, 0, 1m], towards: [0, 0, 1]}]\n",
         ":2: a light needs one of 'at' (a near point) and 'towards' (the direction of a far "
         "light)"},
        {"camera: {eye: [0, 0, 1m]}\nlights: []\n", ":2: lights: needs at least one light"},
        {"camera: {eye: [0, 0, 1m]}\nlights: [{at: [0, 0, 1m]}]\nsample:\n  shape: cube\n",
         ":4: shape: 'cube' is not one of plane|disc|cylinder|sphere|mesh"},
        {"camera: {eye: [0, 0, 1m]}\nlights: [{at: [0, 0, 1m]}]\nsample:\n  radius: -1mm\n"
         "  shape: sphere\n",
         ":4: radius: -1mm is out of range: must be 1 nm to 1e+06 m"},
        {"camera: {eye: [0, 0, 1m]}\nlights: [{at: [0, 0, 1m]}]\nsample:\n  roughnes: 1\n",
         ":4: roughnes: unknown key, did you mean 'roughness'?"},
        {"camera: {eye: [0, 0, 1m]}\nlights: [{at: [0, 0, 1m]}]\nsample:\n  normal: [1, 0, 0]\n",
         ":4: sample: normal and tangent must not be zero or parallel"},
        {"camera: {eye: [0, 0]}\n", ":1: eye: has 2 values, not 3"},
        {"camera: {eye: [0, 0, 3kg]}\n", ":1: '3kg' is not a length such as 530nm or 0.25um"},
    };
    struct err e;
    assert_true(read_text(good, &e));
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        assert_false(read_text(bad[k].text, &e));
        assert_string_equal(e.msg, bad[k].says);
        assert_int_equal(e.code, ERR_DATA);
    }
}

TEST(a_missing_file_names_scene_line_and_file)
{
    static const char *const wants[] = {
        "sample:\n  table: /nowhere/x.exr\n", "sample:\n  factors: /nowhere/x.exr\n",
        "sample:\n  mask: /nowhere/x.png\n", "sample: {shape: mesh,\n  file: /nowhere/x.gltf}\n",
        "environment:\n  map: /nowhere/x.hdr\nsample: {}\n"};
    struct err e;
    for (size_t k = 0; k < sizeof wants / sizeof *wants; k++) {
        char text[300];
        snprintf(text, sizeof text, "camera: {eye: [0, 0, 1m]}\nlights: [{at: [0, 0, 1m]}]\n%s",
                 wants[k]);
        assert_false(read_text(text, &e));
        if (strncmp(e.msg, ":4: /nowhere/x", 14) || !strstr(e.msg, "No such file or directory"))
            fail_msg("%s says '%s'", wants[k], e.msg);
        assert_int_equal(e.code, ERR_FILE);
    }
}

TEST_MAIN(cmocka_unit_test(a_plain_table_is_the_brdf_of_t17),
          cmocka_unit_test(tables_from_heights_leave_w_to_the_renderer),
          cmocka_unit_test(no_layer_but_the_table_returns_more_than_it_gets),
          cmocka_unit_test(gl_draws_every_shape_as_the_cpu_does),
          cmocka_unit_test(gl_sums_tables_as_the_cpu_does),
          cmocka_unit_test(a_far_lamp_is_a_near_one_taken_far),
          cmocka_unit_test(the_display_keeps_what_it_can_show),
          cmocka_unit_test(bad_scenes_name_the_line_and_what_would_be_right),
          cmocka_unit_test(a_missing_file_names_scene_line_and_file))
