// test_lut.c - the data-driven table against closed forms and the reference data.
#include "tests/test.h"

#include "core/imgfile.h"
#include "process/bspline.h"
#include "process/lut.h"
#include "process/lut_band.h"

static void run(const struct lut_request *r, struct table *t)
{
    struct err e = {0};
    struct lut_report report;
    if (!lut_build(r, t, &report, &e))
        fail_msg("%s", e.msg);
}

static struct lut_pattern blank(int w, int h)
{
    return (struct lut_pattern){.w = w,
                                .h = h,
                                .px = calloc((size_t)(w * h), sizeof(float)),
                                .h_per_px = 0.01,
                                .cx = 0.5 * (w - 1),
                                .cy = 0.5 * (h - 1)};
}

static struct spectrum light(const char *name)
{
    struct spectrum s;
    struct err e = {0};
    assert_true(illuminant_get(&s, name, &e));
    return s;
}

TEST(the_band_holds_the_white_point)
{
    static const struct {
        const char *name;
        double x, y;
    } lights[] = {{"E", 0.3333, 0.3333}, {"A", 0.4476, 0.4074}, {"F1", 0.3131, 0.3371}};
    for (int k = 0; k < 3; k++) {
        struct spectrum s = light(lights[k].name);
        struct err e = {0};
        for (int n = 0; n <= 401; n += 401) {
            struct lut_band b;
            assert_true(n ? lut_band_sampled(&b, &s, n, &e) : lut_band_init(&b, &s, 1e-3, &e));
            double sum[3] = {0};
            for (int q = 0; q < b.n; q++)
                for (int c = 0; c < 3; c++)
                    sum[c] += b.weight[q][c];
            const double all = sum[0] + sum[1] + sum[2];
            assert_near(sum[1], 1, 3e-7);                 // what counts as nothing is left out
            assert_near(sum[0] / all, lights[k].x, 4e-4); // tabulated for sums over 5 nm rows
            assert_near(sum[1] / all, lights[k].y, 4e-4);
            lut_band_finish(&b);
        }
        spectrum_finish(&s);
    }
}

// A constant pattern gives C * integral (lm/l)^e P cmf dl at every node, whatever the node.
TEST(a_constant_pattern_gives_a_constant_table)
{
    struct lut_pattern p = blank(81, 71);
    for (int k = 0; k < 81 * 71; k++)
        p.px[k] = 3;
    struct spectrum s = light("D65");
    struct lut_request r = {.pattern = &p,
                            .lambda_m = 520e-9,
                            .light = &s,
                            .f0 = 0.5,
                            .exponent = 0,
                            .n = 9,
                            .range = 0.1,
                            .power = 3,
                            .tolerance = 1e-4,
                            .method = LUT_SAMPLED};
    struct table t;
    run(&r, &t);
    for (int k = 0; k < 81; k++) // Y: 3 / (4 pi^2 0.25)
        assert_near(t.tab[k * 3 + 1], 3 / (M_PI * M_PI), 1e-6);
    table_finish(&t);
    spectrum_finish(&s);
    lut_pattern_finish(&p);
}

static double *read_truth(const char *path, int *rows) // [rows][5] u, v, X, Y, Z
{
    FILE *f = fopen(path, "r");
    assert_non_null(f);
    char header[64];
    assert_non_null(fgets(header, sizeof header, f));
    double *row = calloc(5 * 10000, sizeof *row);
    int n = 0;
    while (n < 10000 && fscanf(f, "%lf,%lf,%lf,%lf,%lf", row + 5 * n, row + 5 * n + 1,
                               row + 5 * n + 2, row + 5 * n + 3, row + 5 * n + 4) == 5)
        n++;
    fclose(f);
    *rows = n;
    return row;
}

TEST(bad_requests_are_refused_with_a_reason)
{
    struct lut_pattern p = blank(8, 8);
    struct spectrum s = light("E");
    const struct lut_request good = {.pattern = &p,
                                     .lambda_m = 520e-9,
                                     .light = &s,
                                     .f0 = 1,
                                     .exponent = 2,
                                     .n = 8,
                                     .range = 0.1,
                                     .power = 1,
                                     .tolerance = 1e-4};
    struct lut_request bad[6];
    for (int k = 0; k < 6; k++)
        bad[k] = good;
    bad[0].lambda_m = 300e-9;
    bad[1].power = 2;
    bad[2].f0 = 0;
    bad[3].n = 1;
    bad[4].range = -1;
    bad[5].tolerance = 0;
    static const char *const says[] = {
        "wavelength 300 nm is out of range: must be 380 to 780 nm",
        "bad table power 2: must be odd (1, 3, 5, ...)",
        "bad F0 0: must be positive",
        "bad table size 1: must be 2 to 65536 nodes a side",
        "bad table range -1: must be above 0 and at most 2 (|h| = 2)",
        "bad tolerance 0: must be above 0 and at most 1",
    };
    struct table t;
    struct lut_report report;
    for (int k = 0; k < 6; k++) {
        struct err e = {0};
        assert_false(lut_build(&bad[k], &t, &report, &e));
        assert_string_equal(e.msg, says[k]);
        assert_int_equal(e.code, ERR_DATA);
    }
    struct err e = {0};
    p.cx = 8;
    assert_false(lut_build(&good, &t, &report, &e));
    assert_string_equal(e.msg, "centre (8, 3.5) is outside the 8 x 8 image");
    p.cx = 4;
    p.h_per_px = 0;
    assert_false(lut_build(&good, &t, &report, &e));
    assert_string_equal(e.msg, "bad h per pixel 0: must be positive");
    spectrum_finish(&s);
    lut_pattern_finish(&p);
}

// Relative L2 error of the table at the truth's points inside its range, read by a quintic spline.
static double error_to(const struct table *t, const double *truth, int rows)
{
    const size_t n = (size_t)t->n;
    float *plane = calloc(n * n, sizeof *plane);
    double diff = 0, norm = 0;
    for (int c = 0; c < 3; c++) {
        for (size_t k = 0; k < n * n; k++)
            plane[k] = t->tab[3 * k + (size_t)c];
        bspline_fit_image(plane, t->n, t->n, BSPLINE_QUINTIC);
        for (const double *row = truth; row < truth + 5 * rows; row += 5) {
            const double x = table_index(t, row[0]), y = table_index(t, row[1]);
            if (!(x >= 2 && y >= 2 && x < t->n - 3 && y < t->n - 3))
                continue;
            double sum = 0;
            for (int b = (int)y - 2; b <= (int)y + 3; b++)
                for (int a = (int)x - 2; a <= (int)x + 3; a++)
                    sum += plane[(size_t)b * n + (size_t)a] * bspline_basis(5, x - a) *
                           bspline_basis(5, y - b);
            diff += (sum - row[2 + c]) * (sum - row[2 + c]);
            norm += row[2 + c] * row[2 + c];
        }
    }
    free(plane);
    return sqrt(diff / norm);
}

static struct lut_pattern reference_pattern(void)
{
    struct image im;
    struct lut_pattern p;
    struct err e = {0};
    assert_true(image_read(&im, shared_or_skip("reference/lut/pattern.pfm"), &e));
    assert_true(lut_pattern_init(&p, &im, 0, 1, &e));
    image_finish(&im);
    p.h_per_px = 0.0011248194656100288;
    p.cx = 502.436;
    p.cy = 488.689;
    return p;
}

TEST(the_methods_meet_the_reference)
{
    static const struct {
        enum lut_method method;
        int n;
        double range, least, most; // of the relative L2 error
    } cases[] = {
        {LUT_EXACT, 1024, 0.35, 0, 1e-5}, // wanted: 2e-4
        {LUT_SAMPLED, 257, 0.1, 0, 5e-4}, // physics.md: 3.3e-4 with 161 wavelengths
        {LUT_FLOOR, 513, 0.2, 0.05, 0.4}, // the order of 1e-1
    };
    struct lut_pattern p = reference_pattern();
    struct spectrum s = light("E");
    int rows;
    double *truth = read_truth(shared_or_skip("reference/lut/truth.csv"), &rows);
    for (int k = 0; k < 3; k++) {
        struct table t;
        run(&(struct lut_request){.pattern = &p,
                                  .lambda_m = 520e-9,
                                  .light = &s,
                                  .f0 = 1,
                                  .exponent = 2,
                                  .n = cases[k].n,
                                  .range = cases[k].range,
                                  .power = 1,
                                  .tolerance = k ? 1e-3 : 1e-4,
                                  .method = cases[k].method},
            &t);
        const double error = error_to(&t, truth, rows);
        if (!(error >= cases[k].least && error <= cases[k].most))
            fail_msg("%s: relative L2 error %g", lut_method_name(cases[k].method), error);
        table_finish(&t);
    }
    free(truth);
    spectrum_finish(&s);
    lut_pattern_finish(&p);
}

TEST(the_centre_is_found_to_a_fraction_of_a_pixel_whatever_the_sensor_did_to_it)
{
    struct lut_pattern p = reference_pattern();
    struct err e = {0};
    for (int clip = 0; clip < 3; clip++) {
        p.px[100 * 1000 + 700] = 1e30f; // a hot pixel
        for (int k = 0; k < 1000 * 1000; k++)
            if (clip && p.px[k] > 12 && p.px[k] < 1e29f)
                p.px[k] = 12;
        p.cx = p.cy = 0;
        assert_true(lut_pattern_center(&p, &e));
        assert_near(p.cx, 502.436, 0.02);
        assert_near(p.cy, 488.689, 0.02);
    }
    lut_pattern_finish(&p);
}

TEST(holes_are_remembered_and_filled_from_around)
{
    float px[8 * 8];
    for (int k = 0; k < 64; k++)
        px[k] = 5;
    px[27] = px[28] = px[29] = px[0] = NAN;
    px[36] = INFINITY;
    const struct image im = {.w = 8, .h = 8, .nc = 1, .px = px};
    struct lut_pattern p;
    struct err e = {0};
    assert_true(lut_pattern_init(&p, &im, 0, 2, &e));
    assert_int_equal(p.unseen, 5);
    for (int k = 0; k < 64; k++) {
        assert_near(p.px[k], k == 0 ? 5 : 10, 1e-5); // a corner is outside, and fades
        assert_int_equal(p.seen[k], k != 0 && k != 27 && k != 28 && k != 29 && k != 36);
    }
    lut_pattern_finish(&p);
    for (int k = 0; k < 64; k++)
        px[k] = NAN;
    assert_false(lut_pattern_init(&p, &im, 0, 2, &e));
    assert_string_equal(e.msg, "the pattern has no finite pixel");
    assert_false(lut_pattern_init(&p, &im, 1, 2, &e));
    assert_string_equal(e.msg, "the pattern has 1 channel: no channel number 2");
}

TEST(what_a_bracket_saturated_is_kept_but_not_called_measured)
{
    float px[16][3]; // Y, var.Y, mask
    for (int k = 0; k < 16; k++) {
        px[k][0] = 2;
        px[k][1] = 0.01f;
        px[k][2] = 1;
    }
    px[5][0] = 9;
    px[5][1] = 81;
    px[5][2] = 0;                       // saturated
    px[6][0] = px[6][1] = px[6][2] = 0; // black in every frame: dark, and known to be
    struct image im = {.w = 4, .h = 4, .nc = 3, .px = px[0]};
    meta_set_text(&im.meta, "channels", "Y,var.Y,mask");
    struct lut_pattern p;
    struct err e = {0};
    assert_true(lut_pattern_init(&p, &im, 0, 0.5, &e));
    assert_int_equal(p.unseen, 1);
    assert_near(p.px[5], 4.5, 0);
    assert_near(p.variance[0], 0.0025, 1e-9);
    for (int k = 0; k < 16; k++)
        assert_int_equal(p.seen[k], k != 5);
    lut_pattern_finish(&p);
    meta_finish(&im.meta);
}

TEST_MAIN(
    cmocka_unit_test(the_band_holds_the_white_point),
    cmocka_unit_test(a_constant_pattern_gives_a_constant_table),
    cmocka_unit_test(bad_requests_are_refused_with_a_reason),
    cmocka_unit_test(what_a_bracket_saturated_is_kept_but_not_called_measured),
    cmocka_unit_test(holes_are_remembered_and_filled_from_around),
    cmocka_unit_test(the_centre_is_found_to_a_fraction_of_a_pixel_whatever_the_sensor_did_to_it),
    cmocka_unit_test(the_methods_meet_the_reference))
