// test_env_keep.c - kernels between frames: kept while they hold, never longer.
#include "tests/env_case.h"

#include "process/env_keep.h"

enum { N = 33 };

static const struct fresnel constant = {false, 1}, schlick = {true, .04};
static const struct env_how how = {.tolerance = 1e-3, .detail_rad = M_PI / 64};

static void same_as_new(struct env_keep *keep, const struct table *t, const struct fresnel *f,
                        const struct environment *env, const struct frame *frame, int made)
{
    struct env_kernel k;
    struct image kept, new;
    struct err e = {0};
    const double middle[2] = {0, 0};
    assert_true(env_keep_map(keep, t, f, &how, env, frame, middle, N, &kept, &e));
    assert_true(env_kernel_init(&k, t, f, &how, &e));
    assert_true(env_exact(&k, env, frame, N, &new, &e));
    assert_memory_equal(kept.px, new.px, N * N * 3 * sizeof(float));
    if (keep)
        assert_int_equal(env_keep_made(keep), made);
    env_kernel_finish(&k);
    image_finish(&kept);
    image_finish(&new);
}

TEST(a_kernel_outlives_frames_and_skies_but_not_its_table)
{
    const struct frame frames[2] = {case_frame(.3, .8, -.2, -.1, .4, .9),
                                    case_frame(1, .1, .2, .5, -.4, .3)};
    struct environment sky[2] = {case_environment(64, &case_axes),
                                 case_environment(64, &frames[1])};
    struct table t = case_table(61, .4, 1);
    struct env_keep *keep = env_keep_new();
    same_as_new(keep, &t, &constant, &sky[0], &frames[0], 1);
    same_as_new(keep, &t, &constant, &sky[0], &frames[1], 1);
    same_as_new(keep, &t, &constant, &sky[1], &frames[1], 1);
    t.tab[3 * (30 * 61 + 30)] += 1; // in place, nobody says so
    same_as_new(keep, &t, &constant, &sky[1], &frames[1], 2);
    same_as_new(keep, &t, &schlick, &sky[1], &frames[1], 3);
    t.range = .3;
    same_as_new(keep, &t, &schlick, &sky[1], &frames[1], 4);
    same_as_new(NULL, &t, &schlick, &sky[1], &frames[1], 0);
    env_keep_free(keep);
    for (int k = 0; k < 2; k++)
        environment_finish(&sky[k]);
    table_finish(&t);
}

TEST(a_kernel_that_cannot_be_made_leaves_none_behind)
{
    const struct frame frame = case_frame(.3, .8, -.2, -.1, .4, .9);
    struct environment sky = case_environment(64, &case_axes);
    struct table t = case_table(61, .4, 1);
    struct env_keep *keep = env_keep_new();
    struct env_how strict = how;
    struct image map;
    struct err e = {0};
    const double middle[2] = {0, 0};
    strict.tolerance = 1e-30;
    assert_false(env_keep_map(keep, &t, &schlick, &strict, &sky, &frame, middle, N, &map, &e));
    assert_int_equal(e.code, ERR_DATA);
    same_as_new(keep, &t, &schlick, &sky, &frame, 1);
    env_keep_free(keep);
    environment_finish(&sky);
    table_finish(&t);
}

TEST_MAIN(cmocka_unit_test(a_kernel_outlives_frames_and_skies_but_not_its_table),
          cmocka_unit_test(a_kernel_that_cannot_be_made_leaves_none_behind))
