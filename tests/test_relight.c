// test_relight.c - a new spectrum while pictures are drawn: the same as a scene read with it.
#include "tests/test.h"

#include "core/imgfile.h"
#include "render/relight.h"
#include "tests/render_fixture.h"
#include "tests/run.h"

static const char pattern[] = "pattern.exr", scene[] = "light.yaml";

// Lobes of a crossed grating at 530 nm, 0.002 a pixel.
static void write_pattern(void)
{
    enter_scratch("relight");
    struct image im;
    struct err e;
    assert_true(image_init(&im, 301, 301, 1, &e));
    for (int k = 0; k < 301 * 301; k++) {
        const double u = (k % 301 - 150) * 2e-3, v = (k / 301 - 150) * 2e-3;
        const double x = u - 0.06 * round(u / 0.06), y = v - 0.06 * round(v / 0.06);
        im.px[k] = (float)exp(-(x * x + y * y) / 7.2e-5 - 20 * (u * u + v * v));
    }
    assert_true(image_write(&im, pattern, &e));
    image_finish(&im);
}

static bool read_with(const char *illuminant, const char *sample, struct scene *s, struct err *e)
{
    FILE *f = fopen(scene, "w");
    assert_non_null(f);
    fprintf(f,
            "camera: {eye: [0, 0, 0.5m]}\nlights: [{at: [20mm, 0, 0.5m]}]\n"
            "environment: {map: studio, nodes: 64}\nsample:\n  %s\nobjects:\n"
            "  - {shape: disc, slits: {pitch: 2um, width: 0.5um, count: 9}, at: [0, 0, -10mm]}\n",
            sample);
    fclose(f);
    const struct scene_options o = {.exposure_ev = NAN, .illuminant = illuminant, .w = 64, .h = 48};
    return scene_read(s, scene, &o, e);
}

static const char photo[] = "photo: {file: pattern.exr, lambda: 530nm, h-per-pixel: 2e-3,"
                            " f0: 0.2, range: 0.3, nodes: 65}";

static struct image drawn(const struct scene *s)
{
    struct image im;
    struct err e;
    assert_true(cpu_render(s, false, &im, &e));
    return im;
}

TEST(a_scene_under_another_light_is_the_scene_read_with_it)
{
    struct scene live, right;
    struct relight *r;
    struct err e;
    write_pattern();
    if (!read_with(NULL, photo, &live, &e) || !read_with("A", photo, &right, &e))
        fail_msg("%s", e.msg);
    struct image want = drawn(&right), before = drawn(&live);
    assert_true(rel_rmse(&before, &want) > 0.05); // there is something to see
    assert_true(relight_open(&r, &live, "A", &e));
    int took = 0;
    while (!relight_done(r, &e)) {
        took += relight_take(r, &live);
        usleep(1000);
    }
    assert_int_equal(e.code, ERR_NONE);
    relight_close(r);
    assert_true(took > 0);
    struct image now = drawn(&live);
    assert_near(rel_rmse(&now, &want), 0, 1e-6);
    image_finish(&now);
    image_finish(&want);
    image_finish(&before);
    scene_finish(&live);
    scene_finish(&right);
}

TEST(closing_early_leaves_the_scene_whole)
{
    struct scene s;
    struct relight *r;
    struct err e;
    write_pattern();
    assert_true(read_with("E", photo, &s, &e));
    for (int k = 0; k < 5; k++) {
        assert_true(relight_open(&r, &s, k % 2 ? "A" : "F1", &e));
        relight_take(r, &s);
        relight_close(r);
    }
    struct image im = drawn(&s);
    image_finish(&im);
    scene_finish(&s);
}

TEST(lights_that_cannot_be_are_refused)
{
    struct scene s;
    struct relight *r;
    struct err e;
    write_pattern();
    assert_true(read_with(NULL, photo, &s, &e));
    assert_false(relight_open(&r, &s, "moonshine", &e));
    assert_int_equal(e.code, ERR_DATA);
    scene_finish(&s);
    assert_false(read_with("moonshine", photo, &s, &e));
    assert_int_equal(e.code, ERR_DATA);

    struct table t; // a table holds its light
    assert_true(fixture_lcd(&t, 17, 0.3, 1, &e) && table_write(&t, "lit.exr", &e));
    table_finish(&t);
    assert_false(read_with("A", "table: lit.exr", &s, &e));
    assert_string_equal(e.msg, "light.yaml: the table of sample cannot be lit by A: "
                               "a 'photo' in its place can");
    assert_false(read_with(
        NULL, "photo: {file: none.exr, lambda: 530nm, h-per-pixel: 2e-3, f0: 0.2}", &s, &e));
    assert_string_equal(e.msg, "light.yaml:5: none.exr: cannot open: No such "
                               "file or directory");
}

TEST_MAIN(cmocka_unit_test(a_scene_under_another_light_is_the_scene_read_with_it),
          cmocka_unit_test(closing_early_leaves_the_scene_whole),
          cmocka_unit_test(lights_that_cannot_be_are_refused))
