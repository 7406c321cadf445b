// test_cmd_tables.c - nacre tables and nacre eval as a user runs them.
#include "tests/test.h"

#include "calib/bokeh_record.h"
#include "core/hfield_file.h"
#include "core/table.h"
#include "tests/run.h"

static void write_heights(const char *path, bool hole)
{
    struct hfield hf = {0};
    struct err e = {0};
    assert_true(hfield_init(&hf, 40, 30, 0.3e-6, 0.4e-6, &e));
    for (int j = 0; j < 30; j++)
        for (int i = 0; i < 40; i++)
            hf.z[j * 40 + i] = (float)(1e-7 * sin(0.9 * i + 0.2 * j) + 3e-8 * cos(1.7 * j));
    if (hole)
        hf.z[5 * 40 + 7] = NAN;
    if (!hfield_write(&hf, path, NULL, &e))
        fail_msg("%s", e.msg);
    hfield_finish(&hf);
}

static void write_text(const char *path, const char *text)
{
    FILE *f = fopen(path, "w");
    assert_non_null(f);
    fputs(text, f);
    fclose(f);
}

TEST(tables_are_made_and_agree_with_direct_summation)
{
    enter_scratch("cmd_tables");
    write_heights("h.gsf", false);
    struct run r = run_nacre("tables h.gsf --coherence 11um --size 21 --tolerance 1e-5 -o t.exr");
    if (r.status)
        fail_msg("%s", r.err);
    assert_non_null(strstr(r.out, "error_l2"));
    // nodes of N = 21, R = 2, p = 5, more columns than needed, in another order
    write_text("at.csv", "# nodes\nw,u,X,v\n2,0,7,2e-5\n0.5,-0.00486,7,0.15552\n1.5,0.33614,7,0\n");
    r = run_nacre("eval t.exr --json --points at.csv --reference h.gsf");
    if (r.status)
        fail_msg("%s", r.err);
    const char *error = strstr(r.out, "\"error_l2\":");
    assert_non_null(error);
    assert_true(strtod(error + 11, NULL) < 1e-4);
    r = run_nacre("eval t.exr --points at.csv --count 1");
    assert_int_equal(r.status, 0);
    assert_ptr_equal(strstr(r.out, "u,v,w,X,Y,Z\n0,2e-05,2,"), r.out);
    assert_int_equal(count_lines(r.out), 4);
}

TEST(holes_are_filled_when_asked)
{
    enter_scratch("cmd_tables_fill");
    write_heights("h.gsf", true);
    const struct run r =
        run_nacre("tables h.gsf --fill --size auto --range 0.1 --tolerance 0.05 -o t.exr");
    if (r.status)
        fail_msg("%s", r.err);
    assert_non_null(strstr(r.err, "h.gsf: filled 1 nodes of 1200"));
    assert_int_equal(access("t.exr", R_OK), 0);
}

TEST(a_bokeh_photograph_becomes_tables_in_one_go)
{
    char sample[1100], words[3000];
    snprintf(sample, sizeof sample, "%s", shared_or_skip("reference/bokeh/sample.png"));
    enter_scratch("cmd_tables_bokeh");
    struct bokeh_record rec = {.channel = "B",
                               .lines_per_m = 6e5,
                               .blaze_rad = 0.22689,
                               .cx_px = 540,
                               .cy_px = 540,
                               .radius_px = 500,
                               .turn_rad = M_PI / 2,
                               .lines = 50,
                               .m_per_px = 8.3e-8,
                               .m_per_px_sigma = 1e-11,
                               .sigma_px = 3,
                               .iterations = 5,
                               .gain_m = 4e-7,
                               .offset = 1,
                               .level = 0.36,
                               .exposure_s = NAN,
                               .rmse = 0.05};
    struct err e = {0};
    record_init(&rec.head, "bokeh", "test", rec.rmse, "of the height");
    if (!bokeh_record_write(&rec, "test", "rec.yaml", &e))
        fail_msg("%s", e.msg);
    snprintf(words, sizeof words, "bokeh %s --calibration rec.yaml -o h.gsf", sample);
    assert_int_equal(run_nacre(words).status, 0);
    assert_int_equal(run_nacre("tables h.gsf --size 21 --count 3 -o two.exr").status, 0);
    snprintf(words, sizeof words,
             "tables --from-bokeh %s --calibration rec.yaml --size 21 --count 3 -o one.exr",
             sample);
    const struct run r = run_nacre(words);
    if (r.status)
        fail_msg("%s", r.err);
    struct table one = {0}, two = {0};
    assert_true(table_read(&one, "one.exr", NULL, &e));
    assert_true(table_read(&two, "two.exr", NULL, &e));
    for (int k = 0; k < 3 * 21 * 21 * 3; k++) // the file holds the spacing as text
        assert_near(one.tab[k], two.tab[k], 1e-5);
    table_finish(&one);
    table_finish(&two);
}

TEST(a_plain_table_needs_no_w_and_tells_its_sigma)
{
    struct table t = {0};
    struct err e = {0};
    enter_scratch("cmd_eval");
    assert_true(table_init(&t, 3, 1, 1, 1, &e));
    for (int k = 0; k < 27; k++)
        t.tab[k] = (float)k;
    assert_true(table_write(&t, "plain.pfm", &e));
    t.sigma = calloc(27, sizeof *t.sigma);
    t.sigma[3] = 0.5;
    assert_true(table_write(&t, "sigma.exr", &e));
    table_finish(&t);
    write_text("at.csv", "0,-1\n1 , 1\n");
    struct run r = run_nacre("eval plain.pfm --range 1 --points at.csv");
    assert_string_equal(r.out, "u,v,w,X,Y,Z\n0,-1,2,3,4,5\n1,1,2,24,25,26\n");
    r = run_nacre("eval sigma.exr --points at.csv");
    assert_string_equal(r.out, "u,v,w,X,Y,Z,sigma_X,sigma_Y,sigma_Z\n0,-1,2,3,4,5,0.5,0,0\n"
                               "1,1,2,24,25,26,0,0,0\n");
}

static void refused(const char *words, int status, const char *message)
{
    const struct run r = run_nacre(words);
    if (r.status != status || !strstr(r.err, message))
        fail_msg("nacre %s: exit %d, said: %s", words, r.status, r.err);
    assert_int_not_equal(access("no.exr", F_OK), 0);
}

TEST(what_cannot_be_is_refused_in_one_line)
{
    enter_scratch("cmd_tables_bad");
    write_heights("h.gsf", false);
    write_heights("hole.gsf", true);
    assert_int_equal(run_nacre("tables h.gsf --size 11 --count 2 -o t.exr").status, 0);
    refused("tables h.gsf --count 2 --tolerance 0.1 -o no.exr", 2, "--count or --tolerance");
    refused("tables h.gsf --basis fourier -o no.exr", 2, "pod|chebyshev|taylor");
    refused("tables h.gsf --w 1 -o no.exr", 2, "--w needs two numbers");
    refused("tables h.gsf --repeat 1.5 -o no.exr", 2, "--repeat needs whole numbers");
    refused("tables h.gsf --size big -o no.exr", 2, "--size needs a number of nodes or auto");
    refused("tables h.gsf --size 1 -o no.exr", 3, "bad table size 1");
    refused("tables h.gsf --power 2 -o no.exr", 3, "bad table power 2");
    refused("tables h.gsf --pixel 0um -o no.exr", 3, "node spacings must be positive");
    refused("tables h.gsf --memory 2kB -o no.exr", 3, "must be 1 MB or more");
    refused("tables h.gsf --illuminant Q -o no.exr", 3, "unknown illuminant 'Q'");
    refused("tables h.gsf --size 11 -o no.pfm", 3, "only .exr holds tables over w");
    refused("tables -o no.exr", 2, "give a height field or --from-bokeh");
    refused("tables --from-bokeh h.gsf -o no.exr", 2, "--from-bokeh needs --calibration");
    refused("tables --from-bokeh h.gsf --calibration none.yaml -o no.exr", 5, "none.yaml");
    refused("tables hole.gsf -o no.exr", 3,
            "hole.gsf: node (7, 5) was not measured (1 such nodes)");
    refused("tables none.gsf -o no.exr", 5, "none.gsf");
    refused("tables h.gsf --size 11 -o none/no.exr", 5, "none/no.exr");
    write_text("bad.csv", "u,v,w\n0,0,1\n0,x,1\n");
    refused("eval t.exr --points bad.csv", 3, "bad.csv:3: 'x' is not a number for v");
    write_text("bad.csv", "u,v,w\n0,0\n");
    refused("eval t.exr --points bad.csv", 3, "bad.csv:2: 2 columns, 3 are needed");
    write_text("bad.csv", "0,0,3\n");
    refused("eval t.exr --points bad.csv", 3, "bad.csv:1: w = 3 must be above 0 and at most 2");
    write_text("bad.csv", "x,y\n0,0\n");
    refused("eval t.exr --points bad.csv", 3, "bad.csv:1: the header names no columns u and v");
    write_text("bad.csv", "\n");
    refused("eval t.exr --points bad.csv", 3, "bad.csv: no points");
    write_text("bad.csv", "0,0\n");
    refused("eval t.exr --points bad.csv", 3, "no column w");
    refused("eval t.exr --points none.csv", 5, "none.csv");
    refused("eval none.exr --points bad.csv", 5, "none.exr");
    write_text("at.csv", "0,0,1\n");
    refused("eval t.exr --points at.csv --count 3", 3, "t.exr has 2 tables");
}

TEST_MAIN(cmocka_unit_test(tables_are_made_and_agree_with_direct_summation),
          cmocka_unit_test(holes_are_filled_when_asked),
          cmocka_unit_test(a_bokeh_photograph_becomes_tables_in_one_go),
          cmocka_unit_test(a_plain_table_needs_no_w_and_tells_its_sigma),
          cmocka_unit_test(what_cannot_be_is_refused_in_one_line))
