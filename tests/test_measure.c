// test_measure.c - ratios of exposures from pixels: unbiased by noise, blooming and saturation.
#include "tests/test.h"

#include "acquire/judge.h"
#include "acquire/measure.h"

enum { W = 320, H = 240, BLACK = 100, WHITE = 4095 };

static uint64_t seed = 88172645463325252u;

static double uniform(void)
{
    seed ^= seed << 13; // xorshift64, Marsaglia 2003
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return (double)(seed >> 11) * 0x1p-53 + 0x1p-54;
}

static double normal(void)
{
    return sqrt(-2 * log(uniform())) * cos(2 * 3.14159265358979 * uniform());
}

// A steep scene (few bright pixels, in two stripes), 4 electrons a count, 3 counts of read noise.
static void expose(uint16_t raw[W * H], double exposure, double from_row, double factor)
{
    for (int k = 0; k < W * H; k++) {
        const double depth = fabs((double)(k % W * 2 % W) / W - 0.5) * 2;
        double signal = 20000 * exposure * exp(-12 * depth);
        if (k / W >= from_row)
            signal *= factor;
        const double noisy = signal + sqrt(signal / 4 + 9) * normal() + BLACK;
        raw[k] = (uint16_t)(noisy < 0 ? 0 : noisy > WHITE ? WHITE : noisy + 0.5);
    }
}

static struct measure_frame as_frame(const uint16_t *raw, double exposure)
{
    return (struct measure_frame){W, H, raw, BLACK, WHITE, (int64_t)(1e9 * exposure)};
}

static uint16_t a[W * H], b[W * H];

TEST(the_ratio_is_that_of_the_exposures_within_its_sigma)
{
    static const double pairs[][2] = {{0.1, 0.2}, {0.2, 0.1}, {0.4, 0.4}, {0.05, 0.8}, {1, 0.25}};
    for (size_t k = 0; k < sizeof pairs / sizeof *pairs; k++) {
        struct measure_ratio m;
        expose(a, pairs[k][0], H, 1);
        expose(b, pairs[k][1], H, 1);
        const struct measure_frame fa = as_frame(a, pairs[k][0]), fb = as_frame(b, pairs[k][1]);
        assert_true(measure_ratio(&fa, &fb, &m));
        const double off = m.ratio / (pairs[k][0] / pairs[k][1]) - 1;
        assert_near(off, 0, 0.01);
        assert_true(fabs(off) < 3 * m.sigma);
    }
}

TEST(a_frame_with_less_light_in_some_rows_says_which)
{
    struct measure_ratio m;
    expose(a, 0.2, 180, 0.5);
    expose(b, 0.1, H, 1);
    const struct measure_frame fa = as_frame(a, 0.2), fb = as_frame(b, 0.1);
    assert_true(measure_ratio(&fa, &fb, &m));
    if (!(m.worst < 0.8 && m.worst_first >= 180))
        fail_msg("%g +- %g in rows %d to %d", m.worst, m.worst_sigma, m.worst_first, m.worst_last);
}

TEST(a_frame_without_light_differs_and_an_empty_scene_tells_nothing)
{
    struct measure_ratio m;
    expose(a, 0.1, 0, 0);
    expose(b, 0.2, H, 1);
    const struct measure_frame fa = as_frame(a, 0.1), fb = as_frame(b, 0.2);
    assert_true(measure_ratio(&fa, &fb, &m));
    assert_true(m.ratio < 0.05);
    expose(b, 0.1, 0, 0);
    assert_false(measure_ratio(&fa, &fb, &m));
}

TEST(the_brightest_pixels_and_the_saturated_share_are_counted)
{
    struct measure_level level;
    for (int k = 0; k < W * H; k++)
        a[k] = BLACK + 50;
    for (int k = 0; k < 8; k++)
        a[k] = BLACK + 1000;
    for (int k = 8; k < 12; k++)
        a[k] = WHITE;
    const struct measure_frame f = as_frame(a, 1);
    measure_level(&f, &level);
    assert_near(level.saturated, 4.0 / (W * H), 1e-12);
    assert_near(level.bright, 1000, 0); // the 8th brightest of 76800
}

TEST(rows_of_the_frame_before_are_found_but_flat_ones_tell_nothing)
{
    int first, last;
    const struct measure_frame fa = as_frame(a, 1), fb = as_frame(b, 1);
    expose(a, 0.1, H, 1);
    memcpy(b, a, sizeof a);
    assert_true(measure_same_rows(&fa, &fb, &first, &last));
    expose(b, 0.1, H, 1);
    assert_false(measure_same_rows(&fa, &fb, &first, &last));
    assert_int_equal(first, -1);
    memcpy(b + 100 * W, a + 100 * W, 20 * W * sizeof *b);
    assert_false(measure_same_rows(&fa, &fb, &first, &last));
    assert_true(first == 100 && last == 119);
    memset(a, 0, sizeof a);
    memset(b, 0, sizeof b);
    a[5] = b[5] = WHITE; // a hot pixel under a cap
    assert_false(measure_same_rows(&fa, &fb, &first, &last));
    assert_int_equal(first, -1);
}

// One frame whose facts are all fine, and what spoils it.
TEST(every_verdict_has_its_cause)
{
    static const struct cam_caps caps = {.w = W, .h = H, .row_ns = 1000};
    static const struct measure_level dim = {.mean = 2}, lit = {.mean = 500};
    static const struct measure_ratio
        twice = {.ratio = 2, .sigma = 0.01, .worst = 1},
        same = {.ratio = 1, .sigma = 0.01, .worst = 1, .residual = 0.05},
        banded = {.ratio = 1, .sigma = 0.01, .worst = 0.6, .worst_sigma = 0.01, .worst_last = 9};
    const struct session_frame fine = {
        .step = {.exposure_ns = 1000000, .gain = 1, .light = "led", .filter = "red"},
        .reported_ns = 1000000,
        .gain = 1,
        .w = W,
        .h = H,
        .black = BLACK,
        .white = WHITE,
        .start_ns = 5000000,
        .light_on_ns = 4900000,
        .light_off_ns = 7000000};
    struct session_frame focus = fine, dark = fine, wrong = fine, gain = fine, missed = fine,
                         small = fine;
    dark.step.kind = SESSION_DARK;
    wrong.reported_ns = 2000000;
    gain.gain = 2;
    missed.light_off_ns = 6100000; // the last row ends at 6.239 ms
    small.w = 8;
    focus.step.focus_per_m = 10;
    focus.focus_per_m = 9.5;
    const struct judge_facts base = {.stale_first = -1, .caps = &caps, .level = &lit};
    struct judge_facts damaged = base, duplicate = base, agrees = base, disagrees = base,
                       uneven = base, black = base, stuck = base, torn = base;
    damaged.damaged = true;
    torn.stale_first = 3;
    torn.stale_last = 200;
    duplicate.duplicate = true;
    agrees.ratio = &same;
    disagrees.ratio = &twice;
    uneven.ratio = &banded;
    agrees.ratio_ns = disagrees.ratio_ns = uneven.ratio_ns = 1000000;
    black.level = &dim;
    stuck.other = &same;
    stuck.other_ns = 1000000;
    stuck.own_residual = 0.05;
    const struct {
        const struct session_frame *f;
        const struct judge_facts *facts;
        const char *verdict;
    } cases[] = {
        {&fine, &base, "good"},           {&fine, &agrees, "good"},
        {&fine, &damaged, "damaged"},     {&small, &base, "damaged"},
        {&fine, &duplicate, "duplicate"}, {&wrong, &base, "wrong-exposure"},
        {&gain, &base, "wrong-exposure"}, {&fine, &disagrees, "wrong-light"},
        {&fine, &uneven, "uneven"},       {&missed, &base, "light-missed"},
        {&dark, &base, "not-dark"},       {&dark, &black, "good"},
        {&fine, &stuck, "same-filter"},   {&fine, &torn, "damaged"},
        {&focus, &base, "wrong-focus"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct session_frame f = *cases[k].f;
        judge(&f, cases[k].facts);
        assert_string_equal(f.verdict, cases[k].verdict);
        assert_int_equal(!*f.reason, !strcmp(f.verdict, "good"));
    }
}

TEST_MAIN(cmocka_unit_test(the_ratio_is_that_of_the_exposures_within_its_sigma),
          cmocka_unit_test(a_frame_with_less_light_in_some_rows_says_which),
          cmocka_unit_test(a_frame_without_light_differs_and_an_empty_scene_tells_nothing),
          cmocka_unit_test(the_brightest_pixels_and_the_saturated_share_are_counted),
          cmocka_unit_test(rows_of_the_frame_before_are_found_but_flat_ones_tell_nothing),
          cmocka_unit_test(every_verdict_has_its_cause))
