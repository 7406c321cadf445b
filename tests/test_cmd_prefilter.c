// test_cmd_prefilter.c - nacre factor, prefilter and methods at the command line.
#include "tests/env_case.h"

#include "core/imgfile.h"
#include "tests/run.h"

#define SAMPLE "--tangent 1,0.2,0 --normal 0,0.3,1 "

static void refused(const char *words, int status, const char *sentence)
{
    assert_refuses(words, status, sentence);
    assert_int_not_equal(access("out.pfm", F_OK), 0);
}

static void write_case(void)
{
    struct err e = {0};
    struct environment env = case_environment(32, &case_axes);
    struct table t = case_table(61, .4, 1);
    assert_true(image_write(&env.map, "env.pfm", &e) && table_write(&t, "lut.exr", &e));
    table_finish(&t);
    environment_finish(&env);
}

TEST(factors_of_a_file_filter_as_the_table_they_are_of)
{
    enter_scratch("prefilter_factors");
    write_case();
    do_run("factor lut.exr --rank 3 -o factors.exr");
    do_run("prefilter env.pfm --lut factors.exr " SAMPLE "--method separable --size 64 -o a.pfm");
    do_run("prefilter env.pfm --lut lut.exr --rank 3 " SAMPLE "--method separable --size 64 "
           "-o b.pfm");
    struct image a, b;
    struct err e = {0};
    assert_true(image_read(&a, "a.pfm", &e) && image_read(&b, "b.pfm", &e));
    assert_int_equal(a.w, 64);
    assert_memory_equal(a.px, b.px, 64 * 32 * 3 * sizeof(float));
    image_finish(&a);
    image_finish(&b);
    refused("prefilter env.pfm --lut factors.exr " SAMPLE "--size 64 -o out.pfm", 3,
            "factors.exr holds factors: --method exact needs the table itself");
}

TEST(exact_and_direct_write_the_same_map)
{
    enter_scratch("prefilter_direct");
    write_case();
    do_run("prefilter env.pfm --lut lut.exr " SAMPLE "--fresnel schlick --size 17 -o a.pfm");
    do_run("prefilter env.pfm --lut lut.exr " SAMPLE "--fresnel schlick --method direct --size 17 "
           "-o b.pfm");
    struct image a, b;
    struct err e = {0};
    double wrong = 0, all = 0;
    assert_true(image_read(&a, "a.pfm", &e) && image_read(&b, "b.pfm", &e));
    for (int k = 0; k < 3 * 17 * 17; k++) {
        wrong += pow((double)a.px[k] - (double)b.px[k], 2);
        all += pow((double)b.px[k], 2);
    }
    assert_true(sqrt(wrong / all) < 1e-3);
    image_finish(&a);
    image_finish(&b);
}

TEST(a_window_is_its_piece_of_the_map)
{
    enum { N = 65 };
    enter_scratch("prefilter_window");
    write_case();
    do_run("prefilter env.pfm --lut lut.exr " SAMPLE "--size 65 -o a.pfm");
    do_run("prefilter env.pfm --lut lut.exr " SAMPLE "--size 65 --window .3,-.2,.4 -o b.pfm");
    struct image a, b;
    struct err e = {0};
    assert_true(image_read(&a, "a.pfm", &e) && image_read(&b, "b.pfm", &e));
    for (int k = 0; k < 3 * N * N; k++) {
        const double t = 2.0 * (k / 3 % N) / (N - 1) - 1, v = 2.0 * (k / 3 / N) / (N - 1) - 1;
        const bool in = fabs(t - .3) <= .2 + 1e-9 && fabs(v + .2) <= .2 + 1e-9;
        assert_near(b.px[k], in ? (double)a.px[k] : 0, 1e-5 * (1 + (double)a.px[k]));
    }
    image_finish(&a);
    image_finish(&b);
    refused("prefilter env.pfm --lut lut.exr " SAMPLE "--size 9 --window .3,-.2 -o out.pfm", 2,
            "--window: needs T,B,WIDTH, not '.3,-.2'");
    refused("prefilter env.pfm --lut lut.exr " SAMPLE "--size 9 --window .3,2,.1 -o out.pfm", 3,
            "--window: T and B must be -1 to 1, WIDTH above 0 and at most 2, not .3,2,.1");
    refused("prefilter env.pfm --lut lut.exr " SAMPLE
            "--size 9 --method direct --window 0,0,1 -o out.pfm",
            3, "--window: only --method exact computes a part of the map");
}

TEST(all_methods_stand_on_one_page)
{
    enter_scratch("prefilter_methods");
    write_case();
    do_run("methods env.pfm --lut lut.exr " SAMPLE "--size 24 -o page");
    static const char *const files[] = {"page/index.html", "page/exact.png",
                                        "page/products-1-error.png", "page/rank-21.png"};
    for (size_t k = 0; k < sizeof files / sizeof *files; k++)
        assert_int_equal(access(files[k], R_OK), 0);
}

TEST(impossible_samples_are_refused)
{
    enter_scratch("prefilter_refused");
    write_case();
    refused("prefilter env.pfm --lut lut.exr --tangent 0,0,2 --normal 0,0,1 --size 9 -o out.pfm", 3,
            "tangent 0,0,2 is parallel to normal 0,0,1: it must lie in the surface");
    refused("prefilter env.pfm --lut lut.exr " SAMPLE "--method separable --rank 62 --size 64 "
            "-o out.pfm",
            3, "lut.exr: bad rank 62: must be 1 to 61, the table's nodes a side");
    refused("prefilter lut.exr --lut lut.exr " SAMPLE "--size 9 -o out.pfm", 3,
            "lut.exr: 61 x 61 pixels: a lat-long map is twice as wide as high");
    refused("methods env.pfm --lut lut.exr --tangent 0,0,1 -o page", 3,
            "tangent 0,0,1 and normal 0,0,1 make no frame");
    refused("methods env.pfm --lut lut.exr --size 9 -o page", 3, "bad --size 9: must be 16 to");
}

TEST_MAIN(cmocka_unit_test(factors_of_a_file_filter_as_the_table_they_are_of),
          cmocka_unit_test(exact_and_direct_write_the_same_map),
          cmocka_unit_test(a_window_is_its_piece_of_the_map),
          cmocka_unit_test(all_methods_stand_on_one_page),
          cmocka_unit_test(impossible_samples_are_refused))
