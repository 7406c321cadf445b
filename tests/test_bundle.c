// test_bundle.c - lens, boards and light in one adjustment, against made corners and glints.
#include "tests/test.h"

#include "calib/bundle.h"
#include "core/mem.h"
#include "tests/noise.h"

enum { LOBES = 5, VIEWS = 10 };
static const struct vec3 truth = {0.3, -0.25, -0.6}; // camera coordinates, as all here

static void pose_of(struct view_fit *v, struct vec3 middle, struct vec3 towards)
{
    struct frame f;
    assert_true(frame_from(v3(1, 0, 0), v3_scale(-1, towards), &f));
    const struct vec3 o =
        v3_sub(middle, v3_add(v3_scale(4 * 0.018, f.t), v3_scale(2.5 * 0.018, f.b)));
    const double r[9] = {f.t.x, f.b.x, f.n.x, f.t.y, f.b.y, f.n.y, f.t.z, f.b.z, f.n.z};
    memcpy(v->rotation, r, sizeof r);
    memcpy(v->origin_m, &o, sizeof v->origin_m);
}

// A lens of 800 px that saw ten boards; the first five lay where a mirror shows the light.
static struct lens made_lens(void)
{
    static const double at[VIEWS][3] = {
        {0, 0, .5},   {.1, .05, .48}, {-.1, -.03, .5}, {.06, -.08, .52}, {-.05, .08, .47},
        {.02, 0, .5}, {0, 0, .48},    {0, -.02, .47},  {.02, 0, .45},    {-.05, 0, .43}};
    static const double tilt[VIEWS][3] = {
        [5] = {.4, -.1, -1}, {-.1, -.4, -1}, {.3, .4, -1}, {-.4, .2, -1}, {.5, -.3, -1}};
    struct lens l = {.n = VIEWS, .view = xcalloc(VIEWS, sizeof *l.view)};
    l.board = (struct board){.cols = 9, .rows = 6, .square_m = 0.018};
    l.camera = (struct camera_fit){.focal_px = {800, 800},
                                   .center_px = {319.5, 239.5},
                                   .distortion = {-0.08, 0.02, 0.0003, -0.0002, 0}};
    for (int v = 0; v < VIEWS; v++) {
        struct lens_view *view = &l.view[v];
        view->image = xstrdup("board.png");
        const struct vec3 x = v3(at[v][0], at[v][1], at[v][2]);
        const struct vec3 half = v3_add(v3_unit(v3_sub(truth, x)), v3_unit(v3_scale(-1, x)));
        pose_of(&view->fit, x, v < LOBES ? half : v3(tilt[v][0], tilt[v][1], tilt[v][2]));
        view->seen = (struct corners){54, xcalloc(54, sizeof(int)), xcalloc(54, sizeof(double[2]))};
        for (int k = 0; k < 54; k++)
            view->seen.id[k] = k;
        for (int k = 0; k < 54; k++)
            lens_project(&l, lens_corner(&l, v, k), &view->seen.px[k][0], &view->seen.px[k][1]);
    }
    return l;
}

TEST(corners_and_glints_together_tell_the_light_and_how_well)
{
    enum { ROUNDS = 20 };
    uint64_t seed = 3;
    double chi2 = 0, square = 0;
    for (int round = 0; round < ROUNDS; round++) {
        struct lens l = made_lens(), held = lens_copy(&l);
        struct glint glint[LOBES];
        struct vec3 at = truth;
        double sigma_m[3], rms_h;
        struct err e;
        for (int k = 0; k < LOBES; k++) {
            const struct plane p = lens_plane(&l, k);
            glint[k] = (struct glint){.view = k, .sigma_h = 1e-5};
            lens_project(&l, p.origin_m, &glint[k].i, &glint[k].j);
        }
        for (int v = 0; v < VIEWS; v++)
            for (int k = 0; k < 54; k++)
                for (int q = 0; q < 2; q++)
                    l.view[v].seen.px[k][q] += 0.004 * noise_gauss(&seed);
        assert_true(bundle_adjust(&l, glint, LOBES, &at, sigma_m, &rms_h, &e));
        assert_true(rms_h < 1e-5);
        const double off[3] = {at.x - truth.x, at.y - truth.y, at.z - truth.z};
        square += v3_dot(v3_sub(at, truth), v3_sub(at, truth)) / ROUNDS;
        for (int k = 0; k < 3; k++)
            chi2 += off[k] * off[k] / (sigma_m[k] * sigma_m[k]) / (3 * ROUNDS);

        // without their corners the poses are believed
        for (int v = 0; v < VIEWS; v++)
            held.view[v].seen.n = 0;
        at.x += 0.01;
        assert_true(bundle_adjust(&held, glint, LOBES, &at, sigma_m, &rms_h, &e));
        assert_near(held.camera.focal_px[0], 800, 1e-9);
        assert_near(v3_norm(v3_sub(at, truth)), 0, 1e-9);
        lens_finish(&l);
        lens_finish(&held);
    }
    print_message("light %.3g mm, chi^2 %.2f\n", 1e3 * sqrt(square), chi2);
    assert_true(sqrt(square) < 2e-3); // boards of 16 cm, seen to 0.004 px, tell no more
    assert_true(chi2 > 0.4 && chi2 < 2);
}

TEST(glints_that_tell_no_light_are_refused)
{
    struct lens l = made_lens();
    const struct glint one = {.view = 0, .i = 319.5, .j = 239.5, .sigma_h = 1e-5};
    struct vec3 at = truth;
    double sigma_m[3], rms_h;
    struct err e;
    assert_false(bundle_adjust(&l, &one, 1, &at, sigma_m, &rms_h, &e));
    assert_int_equal(e.code, ERR_DATA);
    assert_near(at.x, truth.x, 0);
    lens_finish(&l);
}

TEST_MAIN(cmocka_unit_test(corners_and_glints_together_tell_the_light_and_how_well),
          cmocka_unit_test(glints_that_tell_no_light_are_refused))
