// test_cmd_hdr.c - nacre hdr on two real brackets, on linear frames, and on bad ones.
#include "tests/test.h"

#include "core/imgfile.h"
#include "core/sort.h"
#include "tests/run.h"

static double median(double *v, size_t n)
{
    sort_doubles(v, n);
    return v[n / 2];
}

// Median of |a / b / common scale - 1| over the channels both measured.
static double disagreement(const char *path_a, const char *path_b)
{
    struct image a, b;
    struct err e = {0};
    if (!image_read(&a, path_a, &e) || !image_read(&b, path_b, &e))
        fail_msg("%s", e.msg);
    const size_t n = (size_t)a.w * (size_t)a.h;
    double *q = calloc(n * 3, sizeof *q);
    size_t m = 0;
    for (size_t k = 0; k < n; k++)
        for (size_t c = 0; c < 3; c++)
            if (a.px[7 * k + 6] > 0 && b.px[7 * k + 6] > 0)
                q[m++] = (double)a.px[7 * k + c] / (double)b.px[7 * k + c];
    const double scale = median(q, m);
    for (size_t k = 0; k < m; k++)
        q[k] = fabs(q[k] / scale - 1);
    const double result = median(q, m);
    image_finish(&a);
    image_finish(&b);
    free(q);
    return result;
}

static double said_number(const struct run *r, const char *key)
{
    const char *at = strstr(r->out, key);
    return at ? strtod(at + strlen(key), NULL) : NAN;
}

static void real_bracket(const char *folder, double limit)
{
    char words[2048];
    const char *dir = shared_or_skip(folder);
    enter_scratch("hdr_real");
    snprintf(words, sizeof words, "hdr %s/*.jpg --times exif -o all.exr", dir);
    const struct run r = run_nacre(words);
    if (r.status)
        fail_msg("%s", r.err);
    assert_true(said_number(&r, "range_stops") >= 10);
    for (int odd = 0; odd < 2; odd++) {
        snprintf(words, sizeof words, "hdr $(ls %s/*.jpg | awk 'NR%%2==%d') -o half%d.exr", dir,
                 odd, odd);
        if (run_nacre(words).status)
            fail_msg("%s", words);
    }
    assert_near(disagreement("half0.exr", "half1.exr"), 0, limit);
}

TEST(canon_5d_halves_agree_and_span_10_stops)
{
    real_bracket("data/brackets/canon5d", 0.03);
}
TEST(canon_7d_halves_agree_and_span_10_stops)
{
    real_bracket("data/brackets/canon7d", 0.05); // most of it is dark leaves of a few codes
}

static void write_frame(const char *path, float value, float saturation)
{
    struct image im;
    struct err e;
    assert_true(image_init(&im, 40, 30, 1, &e));
    for (int k = 0; k < 40 * 30; k++)
        im.px[k] = fminf(saturation, value * (1 + (float)k / 400));
    assert_true(image_write(&im, path, &e));
    image_finish(&im);
}

TEST(linear_frames_merge_to_counts_per_second_and_their_plateau_is_saturation)
{
    enter_scratch("hdr_linear");
    write_frame("a.pfm", 100, 1000);
    write_frame("b.pfm", 400, 1000);
    write_frame("c.pfm", 1600, 1000);
    const struct run r = run_nacre("hdr a.pfm b.pfm c.pfm --times 1/16s,1/4s,1s -o out.exr");
    if (r.status)
        fail_msg("%s", r.err);
    assert_near(said_number(&r, "saturation"), 1000, 1e-3);
    struct image im;
    struct err e;
    assert_true(image_read(&im, "out.exr", &e));
    assert_string_equal(meta_text(&im.meta, "channels"), "Y,var.Y,mask");
    for (int k = 0; k < 40 * 30; k++)
        assert_near(im.px[3 * k] / (1600 * (1 + (double)k / 400)), 1, 1e-4);
    image_finish(&im);

    assert_int_equal(run_nacre("hdr a.pfm b.pfm --times 1/16s,1/4s -o out.pfm").status, 0);
    assert_true(image_read(&im, "out.pfm", &e));
    assert_int_equal(im.nc, 1);
    image_finish(&im);
}

static void refused(const char *words, int status, const char *sentence)
{
    const struct run r = run_nacre(words);
    if (r.status != status || !strstr(r.err, sentence) || count_lines(r.err) != 1)
        fail_msg("nacre %s: exit %d, '%s'", words, r.status, r.err);
    assert_int_not_equal(access("out.exr", F_OK), 0);
}

TEST(frames_that_are_no_bracket_are_refused_by_name_and_reason)
{
    enter_scratch("hdr_bad");
    write_frame("a.pfm", 100, 1000);
    write_frame("b.pfm", 400, 1000);
    write_frame("a.png", 0.1f, 1);
    write_frame("b.png", 0.4f, 1);
    write_frame("black.png", 0, 1);
    write_frame("dark.png", 0, 1);
    refused("hdr a.pfm b.pfm -o out.exr", 3, "a.pfm: no exposure time inside");
    refused("hdr a.pfm b.pfm --times 1,1.001 -o out.exr", 3,
            "a.pfm and b.pfm have the same exposure time, 1 s");
    refused("hdr a.pfm b.png --times 1,2 -o out.exr", 3, "b.png: is of another kind than a.pfm");
    refused("hdr a.png b.png --times 1,4 --linear --response auto.yaml -o out.exr", 2,
            "--linear and --response exclude each other");
    refused("hdr a.png b.png --times 1,4 --response none.yaml -o out.exr", 5, "none.yaml");
    refused("hdr a.png b.png --times 1,4 --response a.png -o out.exr", 3, "a.png");
    refused("hdr black.png dark.png --times 1,4 -o out.exr", 3, "black.png: every pixel is black");
    refused("hdr a.pfm b.pfm --times 1,4 --saturation -1 -o out.exr", 3, "--saturation");
    refused("hdr a.pfm b.pfm --times 1,4 --method best -o out.exr", 2, "'best'");
    refused("hdr a.pfm b.pfm --times 1,4 -o nowhere/out.exr", 5, "nowhere");
}

TEST_MAIN(
    cmocka_unit_test(canon_5d_halves_agree_and_span_10_stops),
    cmocka_unit_test(canon_7d_halves_agree_and_span_10_stops),
    cmocka_unit_test(linear_frames_merge_to_counts_per_second_and_their_plateau_is_saturation),
    cmocka_unit_test(frames_that_are_no_bracket_are_refused_by_name_and_reason))
