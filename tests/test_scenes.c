// test_scenes.c - every shipped scene by both renderers, and against a small picture from before.
//
// The tables are the samples' truth on few nodes: the scenes are tested, not the way to measure.
// NACRE_GOLDEN=write makes the small pictures anew (tests/cases/scenes); look at them then.
#include "tests/test.h"

#include "core/imgfile.h"
#include "core/spectrum.h"
#include "render/display.h"
#include "render/gl_progress.h"
#include "render/studio.h"
#include "tests/render_fixture.h"
#include "ui/coil.h"
#include <dirent.h>

static char folder[] = "/tmp/nacre_scenes_XXXXXX";

static const char *in_folder(const char *file)
{
    static char path[300];
    snprintf(path, sizeof path, "%s/%s", folder, file);
    return path;
}

static void nacre(const char *words, const char *file)
{
    char command[1000];
    snprintf(command, sizeof command, "%s/nacre %s -o %s/%s --quiet >%s/log 2>&1", BIN_DIR, words,
             folder, file, folder);
    if (system(command))
        fail_msg("failed: %s", command);
}

static void make_truth(const char *sample, int n, double range, int power, const char *file)
{
    char words[600];
    snprintf(words, sizeof words,
             "simulate %s/rigs/samples/%s.yaml --what truth --illuminant D65 --size %d --range %g "
             "--power %d",
             SOURCE_DIR, sample, n, range, power);
    nacre(words, file);
}

static void make_snake(void)
{
    struct err e;
    char words[600];
    snprintf(words, sizeof words, "simulate %s/rigs/samples/quasi-periodic.yaml --what height",
             SOURCE_DIR);
    nacre(words, "snake.gsf");
    snprintf(words, sizeof words,
             "tables %s --illuminant D65 --absolute --range 0.7 --size 65 --power 1 --count 3",
             in_folder("snake.gsf"));
    nacre(words, "snake.exr");
    assert_true(coil_write(in_folder("snake.obj"), &e));
}

static int make_tables(void **state)
{
    (void)state;
    if (!mkdtemp(folder))
        return -1;
    make_truth("lcd", 65, 0.3, 3, "phone.exr");
    make_truth("phone-fine", 65, 0.3, 3, "phone-fine.exr");
    char words[600];
    snprintf(words, sizeof words,
             "simulate %s/rigs/samples/laptop.yaml --what pattern --filter green", SOURCE_DIR);
    nacre(words, "laptop-photo.exr");
    make_truth("holographic", 45, 1.2, 1, "holographic.exr");
    make_truth("tv", 65, 0.1, 3, "tv.exr");
    make_truth("blazed", 65, 1.6, 1, "blazed.exr");
    make_truth("cd", 65, 1.8, 1, "cd.exr");
    make_snake();
    return 0;
}

static int drop_tables(void **state)
{
    (void)state;
    char command[100];
    snprintf(command, sizeof command, "rm -r %s", folder);
    return system(command);
}

static void compare_golden(struct image *im, const struct scene *s, const char *name)
{
    char path[500];
    struct image before;
    struct err e;
    snprintf(path, sizeof path, "%s/tests/cases/scenes/%s.png", SOURCE_DIR, name);
    display_map(im, isnan(s->exposure_ev) ? display_exposure(im) : s->exposure_ev);
    if (getenv("NACRE_GOLDEN")) {
        assert_true(image_write(im, path, &e));
        return;
    }
    if (!image_read(&before, path, &e))
        fail_msg("%s", e.msg);
    assert_int_equal(before.w, im->w);
    double sum = 0;
    for (int k = 0; k < im->w * im->h * 3; k++) {
        const double d = srgb_encode((double)im->px[k]) - (double)before.px[k];
        sum += d * d / (im->w * im->h * 3);
    }
    if (!(sqrt(sum) < 0.01)) // 2.5 of 255: eight bits round to 0.3
        fail_msg("%s: differs by %g from %s", name, sqrt(sum), path);
    image_finish(&before);
}

// One picture by GL against one by the CPU: both take lights as points, a pixel as its middle.
static void check_scene(const char *name)
{
    char path[500];
    struct scene s;
    struct image im[2] = {0};
    struct err e;
    snprintf(path, sizeof path, "%s/rigs/scenes/%s.yaml", SOURCE_DIR, name);
    const struct scene_options o = {
        .tables = folder, .exposure_ev = NAN, .w = 96, .h = 72, .nodes = 128};
    if (!scene_read(&s, path, &o, &e) || !cpu_render(&s, false, &im[0], &e))
        fail_msg("%s: %s", name, e.msg);
    if (gl_render(&s, &im[1], NULL, &e)) {
        const double difference = rel_rmse(&im[1], &im[0]);
        print_message("%-20s GL against the CPU: %.2g\n", name, difference);
        if (!(difference < 0.01))
            fail_msg("%s: GL differs from the CPU by %g", name, difference);
    } else if (e.code != ERR_DEVICE) {
        fail_msg("%s: %s", name, e.msg);
    } else {
        print_message("%s: the CPU alone: %s\n", name, e.msg);
    }
    compare_golden(&im[0], &s, name);
    image_finish(&im[0]);
    image_finish(&im[1]);
    scene_finish(&s);
}

// 64 pictures by GL against full integration: 64 rays a pixel, areas of lights, 8,192 lights and
// 8,192 cells of lobes under a room.
static void check_integral(const char *name)
{
    char path[500];
    struct scene s;
    struct image im[2] = {0}, room;
    struct err e;
    assert_true(studio_map(&room, 128, &e) && image_write(&room, in_folder("room.exr"), &e));
    image_finish(&room);
    snprintf(path, sizeof path, "%s/rigs/scenes/%s.yaml", SOURCE_DIR, name);
    const struct scene_options o = {.tables = folder,
                                    .environment = in_folder("room.exr"),
                                    .exposure_ev = NAN,
                                    .w = 160,
                                    .h = 120,
                                    .nodes = 128};
    if (!scene_read(&s, path, &o, &e))
        fail_msg("%s: %s", name, e.msg);
    if (s.object[0].material.slits.n || s.surround) { // dear
        s.w = 64;
        s.h = 48;
    }
    if (!gl_render_passes(&s, 8, &im[1], NULL, &e)) {
        print_message("%s: %s\n", name, e.msg);
        skip();
    }
    assert_true(cpu_render(&s, true, &im[0], &e));
    const double difference = rel_rmse(&im[1], &im[0]);
    print_message("%-20s GL, 64 pictures, against full integration: %.2g\n", name, difference);
    if (!(difference < 0.01))
        fail_msg("%s: GL differs from full integration by %g", name, difference);
    image_finish(&im[0]);
    image_finish(&im[1]);
    scene_finish(&s);
}

static void check_all(void (*check)(const char *name))
{
    char path[500];
    snprintf(path, sizeof path, "%s/rigs/scenes", SOURCE_DIR);
    DIR *d = opendir(path);
    assert_non_null(d);
    int n = 0;
    for (struct dirent *f; (f = readdir(d));) {
        char *dot = strstr(f->d_name, ".yaml");
        if (!dot)
            continue;
        *dot = 0;
        check(f->d_name);
        n++;
    }
    closedir(d);
    assert_true(n > 15);
}

TEST(every_scene_is_drawn_alike_by_both_and_as_before)
{
    check_all(check_scene);
}

TEST(every_scene_drawn_many_times_is_its_integral)
{
    if (!getenv("NACRE_INTEGRALS")) // minutes of full integration: ctest -L slow
        skip();
    check_all(check_integral);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_scene_is_drawn_alike_by_both_and_as_before),
        cmocka_unit_test(every_scene_drawn_many_times_is_its_integral)};
    return cmocka_run_group_tests(tests, make_tables, drop_tables);
}
