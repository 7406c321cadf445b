// test_lens.c - depth of field: full integration against geometry, pictures' mean and the
// one-picture pass against full integration.
#include "tests/test.h"

#include "render/gl_progress.h"
#include "tests/render_fixture.h"

static const struct light lamp = {.is_far = true, .at = {0, 0, 1}, .power = 1, .tint = {1, 1, 1}};

// A white wall that ends at x = 0, straight ahead at z = 0; the eye half a metre before it.
static struct scene edge(struct object *wall, struct light *l)
{
    *wall = fixture_object(SHAPE_PLANE);
    wall->shape.frame = (struct frame){{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    wall->shape.width_m = wall->shape.height_m = 1;
    wall->shape.at_m = v3(-0.5, 0, 0);
    for (int c = 0; c < 3; c++)
        wall->material.diffuse[c] = 1;
    struct scene s = fixture_scene(wall, l, 1);
    s.camera =
        (struct camera){.eye_m = {0, 0, 0.5}, .up = {0, 1, 0}, .fov_rad = 0.4, .aperture_m = 0.02};
    s.w = s.h = 64;
    return s;
}

static void skip_without_gl(bool ok, const struct err *e)
{
    if (ok)
        return;
    assert_int_equal(e->code, ERR_DEVICE);
    print_message("skipped: %s\n", e->msg);
    skip();
}

TEST(an_edge_out_of_focus_is_the_shadow_of_the_lens)
{
    struct light l = lamp;
    struct object wall;
    struct image im;
    struct err e;
    struct scene s = edge(&wall, &l);
    s.camera.focus_m = 0.3;
    s.camera.aperture_m = 0.08;
    assert_true(cpu_render(&s, true, &im, &e));
    // 40 mm |1/0.3 - 1/0.5| on a film at 1, of 2 tan(0.2) / 64 a pixel
    const double radius_px = 0.04 * (1 / 0.3 - 1 / 0.5) * 64 / (2 * tan(0.2));
    for (int i = 20; i < 44; i++) { // the part of the lens that sees the wall
        const double x = fmax(-1, fmin(1, (31.5 - i) / radius_px));
        const double seen = 0.5 + (x * sqrt(1 - x * x) + asin(x)) / M_PI;
        assert_near(im.px[(32 * 64 + i) * 3] * M_PI, seen,
                    0.04); // 64 points of the lens: 1/32 and some
    }
    image_finish(&im);
}

TEST(what_is_in_focus_stays_as_it_is)
{
    struct light l = lamp;
    struct object wall;
    struct image sharp, through;
    struct err e;
    struct scene s = edge(&wall, &l);
    wall.material.diffraction = DIFFRACTION_STAM; // something to look at
    wall.material.rainbow = (struct rainbow){5e-6, 1, {1, 1, 1}};
    s.background[1] = 0.3;
    s.camera.focus_m = 0.5;
    s.camera.aperture_m = 0;
    skip_without_gl(gl_render(&s, &sharp, NULL, &e), &e);
    s.camera.aperture_m = 0.02;
    assert_true(gl_render(&s, &through, NULL, &e));
    double worst = 0;
    for (int j = 0; j < 64; j++)
        for (int i = 0; i < 30; i++) // right of the edge is infinity, which spreads
            for (int c = 0; c < 3; c++) {
                const size_t k = ((size_t)j * 64 + (size_t)i) * 3 + (size_t)c;
                worst = fmax(worst, fabs((double)sharp.px[k] - (double)through.px[k]));
            }
    assert_near(worst, 0, 1e-5);
    image_finish(&sharp);
    image_finish(&through);
}

TEST(many_pictures_through_the_lens_are_its_integral_and_one_is_near)
{
    struct light lights[2] = {{.at = {0.1, 0.2, 0.4}, .power = 1, .tint = {1, 1, 1}}, lamp};
    struct object o[2];
    struct image truth, many, one;
    struct err e;
    struct scene s = edge(&o[0], lights);
    o[0].shape.at_m.z = -0.4;
    o[1] = fixture_object(SHAPE_SPHERE);
    o[1].shape.radius_m = 0.03;
    o[1].material.diffuse[1] = 0.8;
    s.object = o;
    s.n_objects = s.n_lights = 2;
    s.w = s.h = 128;
    skip_without_gl(gl_render_passes(&s, 8, &many, NULL, &e), &e);
    assert_true(cpu_render(&s, true, &truth, &e) && gl_render(&s, &one, NULL, &e));
    print_message("64 pictures %.3g, one and its pass %.3g from full integration\n",
                  rel_rmse(&many, &truth), rel_rmse(&one, &truth));
    assert_true(rel_rmse(&many, &truth) < 0.02); // 64 points each, not the same ones
    assert_true(rel_rmse(&one, &truth) < 0.1);   // edges of one ray a pixel
    image_finish(&truth);
    image_finish(&many);
    image_finish(&one);
}

TEST_MAIN(cmocka_unit_test(an_edge_out_of_focus_is_the_shadow_of_the_lens),
          cmocka_unit_test(what_is_in_focus_stays_as_it_is),
          cmocka_unit_test(many_pictures_through_the_lens_are_its_integral_and_one_is_near))
