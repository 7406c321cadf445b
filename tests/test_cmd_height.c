// test_cmd_height.c - nacre height from the command line: figures, files, refusals.
#include "tests/run.h"

#include "core/hfield_file.h"
#include "core/imgfile.h"

static void write_field(const char *path, double tilt, bool hole)
{
    struct hfield hf;
    struct err e;
    assert_true(hfield_init(&hf, 200, 100, 1e-7, 1e-7, &e));
    for (int k = 0; k < 200 * 100; k++)
        hf.z[k] = (float)(1e-7 * sin(2 * M_PI * (k % 200) / 25) + tilt * (k % 200) * 1e-7);
    if (hole)
        hf.z[100 * 50 + 3] = NAN;
    assert_true(hfield_write(&hf, path, NULL, &e));
    hfield_finish(&hf);
}

static double number(const struct run *r, const char *key)
{
    char quoted[40];
    snprintf(quoted, sizeof quoted, "\"%s\":", key);
    const char *at = strstr(r->out, quoted);
    if (!at)
        fail_msg("no %s in %s", key, r->out);
    at += strlen(quoted);
    return strtod(at + strspn(at, " [\n"), NULL);
}

TEST(figures_come_without_a_file)
{
    enter_scratch("cmd_height");
    write_field("tilted.gsf", 0.01, false);
    struct run r = run_nacre("height tilted.gsf --level plane --json");
    assert_int_equal(r.status, 0);
    assert_near(number(&r, "size_m"), 2e-5, 1e-15);
    assert_near(number(&r, "sq_m") / 7.07e-8, 1, 0.02); // the plane takes a little of the sine
    assert_near(number(&r, "period_m") / 2.5e-6, 1, 1e-3);
    r = run_nacre("height tilted.gsf --json");
    assert_near(number(&r, "tilt_deg"), 0.573, 0.08); // the sine has some of its own
    assert_near(number(&r, "max_m") - number(&r, "min_m"), number(&r, "sz_m"), 1e-15);
}

TEST(steps_work_in_one_order_and_say_what_they_made)
{
    write_field("a.gsf", 0, true);
    struct run r = run_nacre("height a.gsf --resample 0.05um --crop 8um,4um --fill --rotate 90 "
                             "--level mean -o b.x3p --json");
    assert_int_equal(r.status, 0);
    assert_near(number(&r, "nx"), 79, 0); // 4 um turned to x: 40 nodes, between them 78 halves
    assert_near(number(&r, "ny"), 159, 0);
    assert_near(number(&r, "missing"), 0, 0);
    assert_near(number(&r, "direction_deg"), 90, 0.1);
    struct hfield hf;
    struct err e;
    assert_true(hfield_read(&hf, "b.x3p", NULL, &e));
    assert_int_equal(hf.ny, 159);
    assert_non_null(meta_text(&hf.meta, "nacre.command"));
    hfield_finish(&hf);
    r = run_nacre("height a.gsf --rotate auto --json");
    assert_int_equal(r.status, 0);
    assert_near(number(&r, "direction_deg"), 0, 0.05);
}

TEST(gsf_to_x3p_to_gsf_is_the_identity)
{
    write_field("a.gsf", 0.001, true);
    assert_int_equal(run_nacre("height a.gsf -o b.x3p").status, 0);
    assert_int_equal(run_nacre("height b.x3p -o c.gsf").status, 0);
    struct hfield a, c;
    struct err e;
    assert_true(hfield_read(&a, "a.gsf", NULL, &e));
    assert_true(hfield_read(&c, "c.gsf", NULL, &e));
    assert_memory_equal(a.z, c.z, 200 * 100 * sizeof(float));
    assert_near(a.dx_m, c.dx_m, 0);
    hfield_finish(&a);
    hfield_finish(&c);
}

TEST(measured_files_have_the_sizes_that_their_headers_state)
{
    char line[1100];
    snprintf(line, sizeof line, "height %s --json", shared_or_skip("data/heights/di-3.di"));
    struct run r = run_nacre(line);
    assert_near(number(&r, "size_m"), 1e-5, 1e-18);
    snprintf(line, sizeof line, "height %s --json", shared_or_skip("data/heights/x3p-2.x3p"));
    r = run_nacre(line);
    assert_near(number(&r, "size_m"), 650 * 1.27656509837346e-7, 1e-18);
}

TEST(what_cannot_be_done_leaves_no_file)
{
    static const struct {
        const char *words, *sentence;
        int status;
    } cases[] = {
        {"missing.gsf", "missing.gsf", 5},
        {"a.gsf --crop 30um", "is not a part of the field of 20 x 10 um", 3},
        {"a.gsf --crop 1um,2um,3um", "neither W, W,H nor X,Y,W,H", 2},
        {"a.gsf --crop 4kg", "--crop", 2},
        {"a.gsf --resample -1um", "must be positive", 3},
        {"a.gsf --resample 1m", "leaves 1 x 1 nodes", 3},
        {"a.gsf --rotate up", "--rotate", 2},
        {"flat.gsf --rotate auto", "no period stands out of the noise", 3},
        {"a.gsf --level cone", "cone", 2},
        {"empty.gsf --fill", "no node was measured", 3},
        {"empty.gsf", "no node was measured", 3},
        {"a.gsf --z-scale -1um", "must be positive", 3},
    };
    struct hfield hf;
    struct err e;
    write_field("a.gsf", 0, false);
    assert_true(hfield_init(&hf, 20, 20, 1e-7, 1e-7, &e));
    assert_true(hfield_write(&hf, "empty.gsf", NULL, &e));
    for (int k = 0; k < 400; k++)
        hf.z[k] = 1e-9f;
    assert_true(hfield_write(&hf, "flat.gsf", NULL, &e));
    hfield_finish(&hf);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char line[200];
        snprintf(line, sizeof line, "height %s -o never.gsf", cases[k].words);
        const struct run r = run_nacre(line);
        if (r.status != cases[k].status || !strstr(r.err, cases[k].sentence))
            fail_msg("%s: %d, %s", cases[k].words, r.status, r.err);
        assert_int_equal(count_errors(r.err), 1);
        assert_int_not_equal(access("never.gsf", F_OK), 0);
    }
    assert_int_equal(run_nacre("look empty.gsf never.png").status, 3);
    assert_int_not_equal(access("never.png", F_OK), 0);
    assert_int_equal(run_nacre("height a.gsf -o a.png").status, 3); // without --z-scale
    assert_int_not_equal(access("a.png", F_OK), 0);
}

TEST(a_look_at_heights_is_darkest_at_the_lowest_node)
{
    enter_scratch("cmd_height_look");
    write_field("sine.gsf", 0, true);
    const struct run r = run_nacre("look sine.gsf sine.png --json");
    assert_int_equal(r.status, 0);
    assert_near(number(&r, "lowest_m"), -1e-7, 1e-9);
    assert_near(number(&r, "highest_m"), 1e-7, 1e-9);
    struct image im;
    struct err e;
    assert_true(image_read(&im, "sine.png", &e));
    assert_true(im.w == 200 && im.h == 100);
    const float *low = im.px + 3 * 19, *high = im.px + 3 * 6; // the sine has 25 nodes a period
    assert_true(low[0] + low[1] + low[2] < 0.1F && high[0] + high[1] + high[2] > 1.5F);
    image_finish(&im);
}

TEST_MAIN(cmocka_unit_test(figures_come_without_a_file),
          cmocka_unit_test(steps_work_in_one_order_and_say_what_they_made),
          cmocka_unit_test(gsf_to_x3p_to_gsf_is_the_identity),
          cmocka_unit_test(measured_files_have_the_sizes_that_their_headers_state),
          cmocka_unit_test(a_look_at_heights_is_darkest_at_the_lowest_node),
          cmocka_unit_test(what_cannot_be_done_leaves_no_file))
