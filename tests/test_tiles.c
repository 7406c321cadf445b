// test_tiles.c - nothing that is left out would have been seen.
#include "tests/test.h"

#include "render/tiles.h"
#include "tests/render_fixture.h"

static bool inside(const struct tile *t, int n, int i, int j)
{
    for (int k = 0; k < n; k++)
        if (i >= t[k].x0 && i < t[k].x1 && j >= t[k].y0 && j < t[k].y1)
            return true;
    return false;
}

static double uniform(unsigned *seed, double lo, double hi)
{
    return lo + (hi - lo) * rand_r(seed) / RAND_MAX;
}

// Every pixel: hit pixels are in some tile, pixels that diffract in a diffracting one. Adds up what
// was left out.
static void check(const struct scene *s, double skipped[2])
{
    const struct object *o = &s->object[0];
    struct tiles t = {0};
    tiles_find(&t, s, o, s->w, s->h);
    for (int k = 0; k < s->w * s->h; k++) {
        const int i = k % s->w, j = k / s->w;
        struct vec3 dir, wi;
        struct hit hit;
        const bool full = inside(t.diffracting, t.n_diffracting, i, j);
        const bool any = full || inside(t.plain, t.n_plain, i, j);
        skipped[0] += !any / (double)(s->w * s->h);
        skipped[1] += !full / (double)(s->w * s->h);
        camera_ray(&s->camera, i, j, s->w, s->h, &dir);
        if (!shape_hit(&o->shape, s->camera.eye_m, dir, &hit))
            continue;
        if (!any)
            fail_msg("pixel %d,%d of a %d is in no tile", i, j, (int)o->shape.kind);
        light_at(&s->light[0], hit.at_m, &wi);
        double out[3];
        material_diffraction(&o->material, frame_local(&hit.frame, wi),
                             frame_local(&hit.frame, v3_scale(-1, v3_unit(dir))), out);
        if (!full && fabs(out[1]) > 1e-6)
            fail_msg("pixel %d,%d of a %d diffracts %g", i, j, (int)o->shape.kind, out[1]);
    }
    tiles_finish(&t);
}

TEST(nothing_that_is_left_out_would_have_been_seen)
{
    unsigned seed = 3;
    double skipped[2] = {0};
    enum { TRIALS = 160 };
    for (int trial = 0; trial < TRIALS; trial++) {
        struct light light = {.power = 1, .tint = {1, 1, 1}};
        struct object o = fixture_object((enum shape_kind)(trial % 4));
        light.is_far = trial % 3 == 0;
        light.at = v3(uniform(&seed, -.3, .3), uniform(&seed, -.3, .3), uniform(&seed, .1, .6));
        if (light.is_far)
            light.at = v3_unit(light.at);
        struct table t;
        struct err e;
        assert_true(table_init(&t, 5, uniform(&seed, .02, .3), 1, 1, &e));
        for (int k = 0; k < 75; k++)
            t.tab[k] = 1;
        t.is_rgb = true;
        material_take_table(&o.material, &t, 0.04);
        o.shape.fixed_tangent = trial % 8 == 1;
        struct scene s = fixture_scene(&o, &light, 1);
        s.w = 320;
        s.h = 240;
        s.camera.eye_m =
            v3(uniform(&seed, -.3, .3), uniform(&seed, -.3, .3), uniform(&seed, .2, .6));
        s.camera.target_m = v3(uniform(&seed, -.1, .1), uniform(&seed, -.1, .1), 0);
        check(&s, skipped);
        material_finish(&o.material);
    }
    const double shaded = TRIALS - skipped[0], looked_up = TRIALS - skipped[1];
    assert_true(shaded < 0.5 * TRIALS); // there is something to gain
    assert_true(looked_up < 0.8 * shaded);
}

TEST(a_sample_seen_from_behind_costs_nothing)
{
    struct light light = {.at = {0, 0, 1}, .power = 1, .tint = {1, 1, 1}};
    struct object o = fixture_object(SHAPE_PLANE);
    struct scene s = fixture_scene(&o, &light, 1);
    struct tiles t = {0};
    s.camera.eye_m = v3(0, 0, -0.5);
    tiles_find(&t, &s, &o, s.w, s.h);
    assert_int_equal(t.n_plain + t.n_diffracting, 0);
    tiles_finish(&t);
}

TEST_MAIN(cmocka_unit_test(nothing_that_is_left_out_would_have_been_seen),
          cmocka_unit_test(a_sample_seen_from_behind_costs_nothing))
