// test_lut_exact.c - the fast method against closed-form patterns, the plain method and itself.
#include "tests/lobes.h"

#include <omp.h>

static void run(const struct lut_request *r, struct table *t)
{
    struct err e = {0};
    struct lut_report report;
    if (!lut_build(r, t, &report, &e))
        fail_msg("%s", e.msg);
}

struct score {
    double l2, worst; // relative L2, and the largest error over the largest value
};

// Every `stride`-th node (both ways) within |u|, |v| <= reach against the closed form.
static struct score judge(const struct table *t, const struct lobes *l, int stride, double reach)
{
    double diff = 0, norm = 0, worst = 0, peak = 0;
    for (int j = 1; j < t->n; j += stride)
        for (int i = 1; i < t->n; i += stride) {
            const double u = table_node(t, i), v = table_node(t, j);
            if (fabs(u) > reach || fabs(v) > reach)
                continue;
            double truth[3];
            lobes_truth(l, u, v, 1601, truth);
            for (int c = 0; c < 3; c++) {
                const double d =
                    t->tab[((size_t)j * (size_t)t->n + (size_t)i) * 3 + (size_t)c] - truth[c];
                diff += d * d;
                norm += truth[c] * truth[c];
                worst = fmax(worst, fabs(d));
                peak = fmax(peak, truth[c]);
            }
        }
    return (struct score){sqrt(diff / norm), worst / peak};
}

TEST(it_meets_the_closed_form_for_many_requests)
{
    static const struct {
        int w, h;
        double cx, cy, h_per_px, sigma, lambda_m, exponent;
        const char *light;
        int n;
        double range;
        int power;
        double limit;
    } cases[] = {
        {300, 300, 149.7, 150.2, 2e-3, 2.2, 520e-9, 2, "E", 201, 0.2, 1, 1e-5},
        {300, 300, 149.7, 150.2, 2e-3, 2.2, 520e-9, 2, "D65", 201, 0.2, 5, 3e-5},
        {300, 300, 149.7, 150.2, 2e-3, 2.2, 520e-9, 4, "F11", 200, 0.2, 3, 3e-5},
        {400, 300, 110.2, 160.9, 1e-3, 3, 680e-9, 2, "A", 151, 0.07, 1, 3e-5},
        {300, 400, 180.5, 120, 5e-3, 2, 420e-9, 2, "F2", 333, 0.4, 9, 5e-5},
        {300, 300, 150, 150, 2e-3, 1.5, 520e-9, 2, "E", 201, 0.2, 1, 1e-4},
        // 1.1 px is under-sampled: the photograph itself is aliased by 2e-3 (exp(-pi^2 sigma^2 /
        // 2))
        {300, 300, 150, 150, 2e-3, 1.1, 520e-9, 2, "inverse-A", 201, 0.2, 1, 1e-3},
        {300, 300, 150, 150, 2e-3, 2.2, 520e-9, 2, "E", 501, 0.01, 1, 3e-5},
        {300, 300, 150, 150, 2e-3, 2.2, 780e-9, 2, "E", 101, 2, 5, 3e-5},
        {300, 300, 150, 150, 2e-3, 2.2, 380e-9, 2, "D50", 100, 0.3, 7, 3e-5},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct spectrum s;
        struct err e = {0};
        assert_true(illuminant_get(&s, cases[k].light, &e));
        struct lobes l = lobes_new(90, cases[k].sigma);
        l.exponent = cases[k].exponent;
        l.lambda_m = cases[k].lambda_m;
        l.h_per_px = cases[k].h_per_px;
        l.light = &s;
        struct lut_pattern p = lobes_picture(&l, cases[k].w, cases[k].h, cases[k].cx, cases[k].cy);
        struct table t;
        run(&(struct lut_request){.pattern = &p,
                                  .lambda_m = l.lambda_m,
                                  .light = &s,
                                  .f0 = 1,
                                  .exponent = l.exponent,
                                  .n = cases[k].n,
                                  .range = cases[k].range,
                                  .power = cases[k].power,
                                  .method = LUT_EXACT,
                                  .tolerance = 1e-4},
            &t);
        const struct score got = judge(&t, &l, 17, INFINITY);
        if (!(got.l2 < cases[k].limit && got.worst < 3 * cases[k].limit))
            fail_msg("case %zu: relative L2 %.2g, largest %.2g of the peak", k, got.l2, got.worst);
        table_finish(&t);
        lut_pattern_finish(&p);
        spectrum_finish(&s);
    }
}

// A request with the settings that most tests share.
static struct lut_request request(const struct lut_pattern *p, const struct spectrum *s)
{
    return (struct lut_request){.pattern = p,
                                .lambda_m = 520e-9,
                                .light = s,
                                .f0 = 1,
                                .exponent = 2,
                                .n = 129,
                                .range = 0.2,
                                .power = 1,
                                .method = LUT_EXACT,
                                .tolerance = 1e-4};
}

static struct lut_pattern blank(int w, int h)
{
    return (struct lut_pattern){.w = w,
                                .h = h,
                                .px = calloc((size_t)(w * h), sizeof(float)),
                                .h_per_px = 2e-3,
                                .cx = 0.5 * (w - 1),
                                .cy = 0.5 * (h - 1)};
}

struct extent {
    double least, most;
    long bad; // not finite
};

static struct extent extent_of(const struct table *t)
{
    struct extent x = {INFINITY, -INFINITY, 0};
    for (size_t k = 0; k < 3 * (size_t)t->n * (size_t)t->n; k++) {
        x.bad += !isfinite(t->tab[k]);
        x.least = fmin(x.least, t->tab[k]);
        x.most = fmax(x.most, t->tab[k]);
    }
    return x;
}

TEST(hard_patterns_and_extreme_requests_stay_finite_and_do_not_swing_below_zero)
{
    enum { ZEROS, DELTA, BORDER, HOT, CORNER, PATTERNS };
    static const int powers[] = {1, 5, 9};
    static const double ranges[] = {0.01, 0.2, 2}, lambdas[] = {380e-9, 520e-9, 780e-9};
    struct spectrum s;
    struct err e = {0};
    assert_true(illuminant_get(&s, "F11", &e));
    for (int kind = 0; kind < PATTERNS; kind++)
        for (int q = 0; q < 27; q++) {
            struct lut_pattern p = blank(120, 90);
            if (kind == DELTA)
                p.px[50 * 120 + 70] = 1;
            if (kind == BORDER)
                for (int j = 0; j < 90; j++)
                    p.px[j * 120 + 119] = p.px[j * 120] = 3;
            if (kind == CORNER)
                p.px[0] = p.px[89 * 120 + 119] = 1;
            if (kind == HOT)
                for (int k = 0; k < 120 * 90; k++)
                    p.px[k] = k == 40 * 120 + 30 ? 1e30f : 1;
            struct lut_request r = request(&p, &s);
            r.power = powers[q % 3];
            r.range = ranges[q / 3 % 3];
            r.lambda_m = lambdas[q / 9];
            r.n = 64 + q % 2;
            struct table t;
            run(&r, &t);
            const struct extent x = extent_of(&t);
            assert_int_equal(x.bad, 0);
            assert_true(x.least >= 0);
            assert_true(kind == ZEROS ? x.most == 0 : kind == HOT ? x.most > 0 : true);
            table_finish(&t);
            lut_pattern_finish(&p);
        }
    spectrum_finish(&s);
}

TEST(any_number_of_threads_gives_the_same_bytes)
{
    struct spectrum s;
    struct err e = {0};
    assert_true(illuminant_get(&s, "D65", &e));
    struct lobes l = lobes_new(90, 2);
    l.h_per_px = 2e-3;
    struct lut_pattern p = lobes_picture(&l, 250, 260, 120.3, 130.8);
    p.variance = calloc(250 * 260, sizeof(float));
    for (int k = 0; k < 250 * 260; k++)
        p.variance[k] = 1e-4f * p.px[k];
    struct table one, many;
    const struct lut_request r = request(&p, &s);
    omp_set_num_threads(1);
    run(&r, &one);
    omp_set_num_threads(3);
    run(&r, &many);
    assert_memory_equal(one.tab, many.tab, 3 * 129 * 129 * sizeof(float));
    assert_memory_equal(one.sigma, many.sigma, 3 * 129 * 129 * sizeof(float));
    table_finish(&one);
    table_finish(&many);
    lut_pattern_finish(&p);
    spectrum_finish(&s);
}

TEST(a_hole_marks_the_nodes_whose_band_it_cuts_and_no_others)
{
    struct spectrum s;
    struct err e = {0};
    assert_true(illuminant_get(&s, "E", &e));
    struct lobes l = lobes_new(90, 2);
    l.h_per_px = 2e-3;
    struct lut_pattern whole = lobes_picture(&l, 250, 250, 125, 125), holed = {0};
    const int hx = 60, hy = -35; // px from the centre
    struct image im = {.w = 250, .h = 250, .nc = 1, .px = whole.px};
    const float was = whole.px[(125 + hy) * 250 + 125 + hx];
    whole.px[(125 + hy) * 250 + 125 + hx] = NAN;
    assert_true(lut_pattern_init(&holed, &im, 0, 1, &e));
    whole.px[(125 + hy) * 250 + 125 + hx] = was;
    holed.h_per_px = 2e-3;
    holed.cx = holed.cy = 125;
    struct table a, b;
    const struct lut_request r = request(&whole, &s), with_hole = request(&holed, &s);
    run(&r, &a);
    run(&with_hole, &b);
    const struct extent x = extent_of(&a);
    for (int j = 0; j < 129; j++)
        for (int i = 0; i < 129; i++) {
            // Where the ray through the node passes the hole: how near, in px, within the band
            const double u = table_node(&a, i) / 2e-3, v = table_node(&a, j) / 2e-3;
            double nearest = INFINITY;
            for (double lambda_nm = 380; lambda_nm <= 780; lambda_nm += 0.25) {
                const double ratio = 520 / lambda_nm;
                nearest = fmin(nearest, hypot(u * ratio - hx, v * ratio - hy));
            }
            const int k = j * 129 + i;
            const double far = fmax(fabs(u), fabs(v)) * 520 / 380; // beyond the frame
            if (nearest < 0.5)
                assert_int_equal(b.cover[k], 0);
            if (nearest > 3 && far < 124)
                assert_int_equal(b.cover[k], 1);
            assert_int_equal(a.cover[k], far < 124.5);
            if (nearest > 6)
                for (int c = 0; c < 3; c++)
                    assert_near(a.tab[3 * k + c], b.tab[3 * k + c], 1e-3 * x.most);
        }
    table_finish(&a);
    table_finish(&b);
    lut_pattern_finish(&holed);
    lut_pattern_finish(&whole);
    spectrum_finish(&s);
}

TEST(a_symmetric_pattern_is_computed_by_half_and_its_halves_are_averaged)
{
    struct spectrum s;
    struct err e = {0};
    assert_true(illuminant_get(&s, "E", &e));
    struct lobes l = lobes_new(60, 2);
    l.exponent = 2;
    l.lambda_m = 520e-9;
    l.h_per_px = 2e-3;
    l.light = &s;
    struct lobes twin = l;
    for (int k = 0; k < LOBES / 2; k++) {
        twin.x[LOBES - 1 - k] = -(twin.x[k] = l.x[k]);
        twin.y[LOBES - 1 - k] = -(twin.y[k] = l.y[k]);
        twin.height[LOBES - 1 - k] = twin.height[k];
        twin.sigma[LOBES - 1 - k] = twin.sigma[k];
    }
    const struct lobes *patterns[] = {&l, &twin};
    for (int k = 0; k < 2; k++) {
        struct lut_pattern p = lobes_picture(patterns[k], 300, 320, 150.3, 155.8);
        struct lut_request r = request(&p, &s);
        for (r.n = 128; r.n < 130; r.n++) {
            struct table t;
            struct lut_report report;
            assert_true(lut_build(&r, &t, &report, &e));
            assert_int_equal(report.skipped.symmetric, k);
            const struct score got = judge(&t, patterns[k], 11, INFINITY);
            assert_true(got.l2 < 3e-5 && got.worst < 6e-5);
            table_finish(&t);
        }
        lut_pattern_finish(&p);
    }
    spectrum_finish(&s);
}

TEST(what_is_empty_is_skipped_and_counted)
{
    struct spectrum s;
    struct err e = {0};
    assert_true(illuminant_get(&s, "E", &e));
    struct lobes l = lobes_new(60, 2);
    l.exponent = 2;
    l.lambda_m = 520e-9;
    l.h_per_px = 1e-3;
    l.light = &s;
    for (int k = 3; k < LOBES; k++)
        l.height[k] = 0;
    struct lut_pattern p = lobes_picture(&l, 700, 700, 350, 350);
    for (int k = 0; k < 700 * 700; k++)
        p.px[k] = p.px[k] > 1e-7f ? p.px[k] : 0;
    const struct lut_request r = request(&p, &s);
    struct table t;
    struct lut_report report;
    assert_true(lut_build(&r, &t, &report, &e));
    assert_true(report.skipped.rays > 0.5 && report.skipped.rays < 1);
    assert_true(report.skipped.radii > 0.3 && report.skipped.radii < 1);
    assert_true(report.skipped.nodes > 0.5 && report.skipped.nodes < 1);
    assert_true(judge(&t, &l, 5, INFINITY).l2 < 3e-5);
    table_finish(&t);
    lut_pattern_finish(&p);
    spectrum_finish(&s);
}

// Many noisy photographs: the scatter of their tables is the sigma that one of them states.
TEST(sigma_is_the_scatter_of_tables_from_noisy_pictures)
{
    enum { PICTURES = 60, N = 41, SIDE = 160 };
    static const struct {
        double range;
        bool rgb;
        double limit;
    } cases[] = {
        {0.15, false, 0.1}, {0.15, true, 0.1}, {0.008, false, 0.2}}; // last: innermost 4 px
    struct spectrum s;
    struct err e = {0};
    assert_true(illuminant_get(&s, "E", &e));
    for (int q = 0; q < 3; q++) {
        static double sum[3 * N * N], sum2[3 * N * N];
        memset(sum, 0, sizeof sum);
        memset(sum2, 0, sizeof sum2);
        double stated = 0, found = 0;
        uint64_t seed = 88172645463325252u;
        for (int k = 0; k < PICTURES; k++) {
            struct lut_pattern p = blank(SIDE, SIDE);
            p.variance = calloc(SIDE * SIDE, sizeof(float));
            for (int m = 0; m < SIDE * SIDE; m++) {
                double uniform = 0; // twelve of them: nearly normal, variance 1
                for (int d = 0; d < 12; d++) {
                    seed ^= seed << 13;
                    seed ^= seed >> 7;
                    seed ^= seed << 17;
                    uniform += (double)(seed >> 11) / 9007199254740992.0;
                }
                p.px[m] = (float)(100 + 2 * (uniform - 6));
                p.variance[m] = 4;
            }
            struct lut_request r = request(&p, &s);
            r.n = N;
            r.range = cases[q].range;
            r.is_rgb = cases[q].rgb;
            struct table t;
            run(&r, &t);
            for (int m = 0; m < 3 * N * N; m++) {
                sum[m] += t.tab[m];
                sum2[m] += (double)t.tab[m] * t.tab[m];
                if (k == 0)
                    stated += (double)t.sigma[m] * t.sigma[m];
            }
            table_finish(&t);
            lut_pattern_finish(&p);
        }
        for (int m = 0; m < 3 * N * N; m++)
            found += (sum2[m] - sum[m] * sum[m] / PICTURES) / (PICTURES - 1);
        assert_near(sqrt(stated / found), 1, cases[q].limit);
    }
    spectrum_finish(&s);
}

TEST_MAIN(
    cmocka_unit_test(it_meets_the_closed_form_for_many_requests),
    cmocka_unit_test(hard_patterns_and_extreme_requests_stay_finite_and_do_not_swing_below_zero),
    cmocka_unit_test(any_number_of_threads_gives_the_same_bytes),
    cmocka_unit_test(a_hole_marks_the_nodes_whose_band_it_cuts_and_no_others),
    cmocka_unit_test(a_symmetric_pattern_is_computed_by_half_and_its_halves_are_averaged),
    cmocka_unit_test(what_is_empty_is_skipped_and_counted),
    cmocka_unit_test(sigma_is_the_scatter_of_tables_from_noisy_pictures))
