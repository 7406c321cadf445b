// test_view_orbit.c - camera and lights as the mouse drags them, pictures in their panes.
#include "tests/test.h"

#include "ui/view_layout.h"
#include "ui/view_orbit.h"

static const struct camera base = {
    .eye_m = {0.1, -0.2, 0.5}, .target_m = {0.02, 0.01, 0}, .up = {0, 1, 0}, .fov_rad = 0.4};

static double distance(struct vec3 a, struct vec3 b)
{
    return v3_norm(v3_sub(a, b));
}

TEST(without_a_drag_the_camera_is_the_scenes)
{
    const struct params p = params_start();
    const struct camera c = orbit_camera(&base, &p);
    assert_near(distance(c.eye_m, base.eye_m), 0, 1e-15);
    assert_near(distance(c.target_m, base.target_m), 0, 1e-15);
}

TEST(a_turn_keeps_the_distance_and_the_target)
{
    struct params p = params_start();
    for (int k = 0; k < 40; k++) {
        orbit_drag(&p, 0.13, 0.07 * (k % 7 - 3));
        const struct camera c = orbit_camera(&base, &p);
        assert_near(distance(c.eye_m, c.target_m), distance(base.eye_m, base.target_m), 1e-12);
        assert_near(distance(c.target_m, base.target_m), 0, 1e-12);
        assert_near(v3_dot(v3_unit(c.up), v3_unit(v3_sub(c.eye_m, c.target_m))), 0, 1e-12);
    }
}

TEST(a_drag_to_the_right_brings_the_samples_left_side_nearer)
{
    struct params p = params_start();
    orbit_drag(&p, 0.1, 0);
    const struct camera c = orbit_camera(&base, &p);
    assert_true(c.eye_m.x < base.eye_m.x);
}

TEST(going_nearer_and_back_again_ends_where_it_began)
{
    struct params p = params_start();
    orbit_zoom(&p, 5);
    assert_true(p.v[PARAM_DISTANCE] < 0.6);
    orbit_zoom(&p, -5);
    assert_near(p.v[PARAM_DISTANCE], 1, 1e-12);
}

TEST(lights_turn_about_the_target_and_far_ones_as_directions)
{
    struct params p = params_start();
    const struct light near = {.at = {0, 0.1, 0.4}, .power = 2},
                       far = {.is_far = true, .at = {0, 0, 1}, .power = 1};
    orbit_drag_light(&p, 0.3, -0.2);
    param_set(&p, PARAM_LIGHT_EV, 1);
    const struct light a = orbit_light(&near, &base, &p), b = orbit_light(&far, &base, &p);
    assert_near(distance(a.at, base.target_m), distance(near.at, base.target_m), 1e-12);
    assert_true(distance(a.at, near.at) > 0.05);
    assert_near(a.power, 4, 1e-12);
    assert_near(v3_norm(b.at), 1, 1e-12);
}

TEST(a_point_of_the_window_and_of_the_picture_are_each_others_image)
{
    const struct gui_rect pane = {210, 0, 740, 772};
    struct placing p = placing_fit(pane, 512, 512);
    double i, j, x, y;
    placing_to_picture(&p, pane, 210, 0, &i, &j);
    assert_near(i, 0, 1e-9); // the width decides
    placing_zoom(&p, pane, 400, 300, 3);
    double i2, j2;
    placing_to_picture(&p, pane, 400, 300, &i, &j);
    placing_zoom(&p, pane, 400, 300, -5);
    placing_to_picture(&p, pane, 400, 300, &i2, &j2);
    assert_near(i, i2, 1e-9);
    assert_near(j, j2, 1e-9);
    placing_to_window(&p, pane, i2, j2, &x, &y);
    assert_near(x, 400, 1e-9);
    assert_near(y, 300, 1e-9);
}

TEST(panes_fill_the_middle_and_do_not_overlap)
{
    static const double scales[] = {1, 2};
    for (int s = 0; s < 2; s++)
        for (int n = 1; n <= PANES; n++) {
            struct layout l;
            layout_make(&l, 1280 * scales[s], 800 * scales[s], scales[s], true, n);
            double area = 0;
            for (int k = 0; k < n; k++) {
                const struct gui_rect r = l.pane[k];
                area += r.w * r.h;
                assert_int_equal(layout_pane_at(&l, r.x + r.w / 2, r.y + r.h / 2), k);
            }
            assert_true(area > 0.98 * (1280 - 210 - 330) * (800 - 28) * scales[s] * scales[s]);
            assert_int_equal(layout_pane_at(&l, 5, 5), -1);
        }
}

TEST_MAIN(cmocka_unit_test(without_a_drag_the_camera_is_the_scenes),
          cmocka_unit_test(a_turn_keeps_the_distance_and_the_target),
          cmocka_unit_test(a_drag_to_the_right_brings_the_samples_left_side_nearer),
          cmocka_unit_test(going_nearer_and_back_again_ends_where_it_began),
          cmocka_unit_test(lights_turn_about_the_target_and_far_ones_as_directions),
          cmocka_unit_test(a_point_of_the_window_and_of_the_picture_are_each_others_image),
          cmocka_unit_test(panes_fill_the_middle_and_do_not_overlap))
