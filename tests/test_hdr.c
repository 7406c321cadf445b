// test_hdr.c - merging: no bias, the Cramer-Rao bound, saturation, channels on their own.
#include "tests/test.h"

#include "core/mem.h"
#include "process/exposure.h"
#include "process/hdr.h"
#include "tests/noise.h"

enum { W = 64, H = 64, PIXELS = W * H };

// Counts of a sensor: gain 0.5 counts per electron, read noise 3 counts, full scale 4000.
static const double gain = 0.5, read_noise = 3, full = 4000;

static void shoot(float *px, double radiance, double time_s, uint64_t *seed)
{
    const double x = radiance * time_s;
    for (int k = 0; k < PIXELS; k++) {
        const double noisy = x + sqrt(gain * x + read_noise * read_noise) * noise_gauss(seed);
        px[k] = (float)(noisy < full ? noisy : full);
    }
}

static const double times[] = {1, 0.25, 1. / 16, 1. / 64, 1. / 256};
enum { N = 5 };

struct case_frames {
    float px[N][PIXELS];
    const float *ptr[N];
    double time_s[N];
    struct hdr_frames f;
};

static struct case_frames *frames_of(double radiance, uint64_t seed)
{
    struct case_frames *c = xcalloc(1, sizeof *c);
    for (int j = 0; j < N; j++) {
        c->ptr[j] = c->px[j];
        c->time_s[j] = times[j];
        shoot(c->px[j], radiance, times[j], &seed);
    }
    c->f = (struct hdr_frames){.n = N,
                               .w = W,
                               .h = H,
                               .nc = 1,
                               .px = c->ptr,
                               .time_s = c->time_s,
                               .saturation = full,
                               .noise = {read_noise * read_noise, gain}};
    return c;
}

TEST(the_mean_is_unbiased_and_its_variance_is_the_cramer_rao_bound_over_10_stops)
{
    for (int stop = 0; stop <= 10; stop++) {
        const double radiance = 300 * exp2(stop);
        double information = 0; // of the frames that do not saturate
        for (int j = 0; j < N; j++) {
            const double x = radiance * times[j], v = gain * x + read_noise * read_noise;
            if (x + 4 * sqrt(v) < full)
                information += times[j] * times[j] / v;
        }
        double sum = 0, sum2 = 0, said = 0;
        enum { RUNS = 8 };
        for (int run = 0; run < RUNS; run++) {
            struct case_frames *c = frames_of(radiance, (uint64_t)(1000 * stop + run));
            struct image out;
            struct hdr_counts counts;
            struct err e;
            assert_true(hdr_merge(&c->f, HDR_POISSON, &out, &counts, &e));
            for (int k = 0; k < PIXELS; k++) {
                const double d = (double)out.px[3 * k] - radiance;
                sum += d;
                sum2 += d * d;
                said += (double)out.px[3 * k + 1];
            }
            image_finish(&out);
            free(c);
        }
        const double n = RUNS * PIXELS, bias = sum / n, variance = sum2 / n - bias * bias;
        // 32768 samples: the variance is known to 0.8 %, the mean to sigma / 181
        assert_near(variance * information, 1, 0.05);
        assert_near(said / n * information, 1, 0.05);
        assert_near(bias / radiance, 0, 1e-3 + 3 * sqrt(1 / information / n) / radiance);
    }
}

TEST(a_saturated_sample_never_pulls_a_pixel_down)
{
    struct case_frames *c = frames_of(900000, 7); // saturates all but the shortest
    struct image out;
    struct hdr_counts counts;
    struct err e;
    const enum hdr_method methods[] = {HDR_POISSON, HDR_DEBEVEC, HDR_ROBERTSON};
    for (int m = 0; m < 3; m++) {
        assert_true(hdr_merge(&c->f, methods[m], &out, &counts, &e));
        double sum = 0;
        for (int k = 0; k < PIXELS; k++)
            sum += (double)out.px[3 * k] / PIXELS;
        assert_near(sum / 900000, 1, 2e-3);
        assert_int_equal(counts.saturated, 0);
        image_finish(&out);
    }
    free(c);
}

TEST(a_pixel_saturated_in_every_frame_is_masked_and_holds_the_bound)
{
    struct case_frames *c = frames_of(1000, 7);
    for (int j = 0; j < N; j++)
        c->px[j][5] = (float)full;
    struct image out;
    struct hdr_counts counts;
    struct err e;
    assert_true(hdr_merge(&c->f, HDR_POISSON, &out, &counts, &e));
    assert_near(out.px[15], full * 256, 1);
    assert_near(out.px[16], out.px[15] * out.px[15], 1e-3 * full * full * 65536);
    assert_int_equal(out.px[17], 0);
    assert_int_equal(out.px[20], 1);
    assert_int_equal(counts.saturated, 1);
    image_finish(&out);
    for (int j = 0; j < N; j++)
        for (int k = 0; k < PIXELS; k++)
            c->px[j][k] = (float)full;
    assert_false(hdr_merge(&c->f, HDR_POISSON, &out, &counts, &e));
    assert_string_equal(e.msg, "every pixel is saturated in every frame");
    free(c);
}

TEST(scaling_all_exposure_times_scales_the_radiance)
{
    struct case_frames *c = frames_of(5000, 3);
    struct image a, b;
    struct hdr_counts counts;
    struct err e;
    assert_true(hdr_merge(&c->f, HDR_POISSON, &a, &counts, &e));
    for (int j = 0; j < N; j++)
        c->time_s[j] *= 8;
    assert_true(hdr_merge(&c->f, HDR_POISSON, &b, &counts, &e));
    for (int k = 0; k < PIXELS; k++)
        assert_near(b.px[3 * k] * 8, a.px[3 * k], 1e-6 * a.px[3 * k]);
    image_finish(&a);
    image_finish(&b);
    free(c);
}

// A ramp of radiances, the frames' light drifting by 3 % from each to the next.
static struct case_frames *ramp(double drift, uint64_t seed)
{
    struct case_frames *c = frames_of(1, seed);
    for (int j = 0; j < N; j++)
        for (int k = 0; k < PIXELS; k++) {
            const double x = exp2(8 + 12.0 * k / PIXELS) * times[j] * pow(1 + drift, j);
            const double noisy = x + sqrt(gain * x + read_noise * read_noise) * noise_gauss(&seed);
            c->px[j][k] = (float)(noisy < full ? noisy : full);
        }
    return c;
}

// Half a million pixels of a ramp over 12 stops: what is left of the drift is 0.1 % and less.
TEST(a_drift_of_3_percent_per_frame_is_removed_to_a_thousandth)
{
    enum { BIG_W = 1024, BIG_H = 512 };
    float *px[N];
    struct err e;
    uint64_t seed = 11;
    for (int j = 0; j < N; j++) {
        px[j] = sample_alloc((size_t)BIG_W * BIG_H, sizeof(float), "frame", &e);
        for (int k = 0; k < BIG_W * BIG_H; k++) {
            const double x = exp2(8 + 12.0 * (k % BIG_W) / BIG_W) * times[j] * pow(1.03, j);
            const double noisy = x + sqrt(gain * x + read_noise * read_noise) * noise_gauss(&seed);
            px[j][k] = (float)(noisy < full ? noisy : full);
        }
    }
    const struct hdr_frames f = {.n = N,
                                 .w = BIG_W,
                                 .h = BIG_H,
                                 .nc = 1,
                                 .px = (const float *const *)px,
                                 .time_s = times,
                                 .saturation = full,
                                 .noise = {read_noise * read_noise, gain}};
    double log_scale[N];
    int unlinked;
    exposure_drift(&f, log_scale, &unlinked);
    assert_int_equal(unlinked, 0);
    for (int j = 0; j < N; j++)
        assert_near(log_scale[j] - log_scale[0], j * log(1.03), 1e-3);
    for (int j = 0; j < N; j++)
        free(px[j]);
}

// Chance: the shortest frame of a faint pixel is far below its mean. That is no reason to take the
// light of all others for spilled charge.
TEST(a_low_sample_in_the_shortest_frame_does_not_drop_the_others)
{
    struct case_frames *c = frames_of(8000, 3);
    c->px[4][0] = 5; // 31 +- 5 counts
    struct image out;
    struct hdr_counts counts;
    struct err e;
    assert_true(hdr_merge(&c->f, HDR_POISSON, &out, &counts, &e));
    assert_near(out.px[0] / 8000, 1, 0.1);
    image_finish(&out);
    free(c);
}

// Where a frame is about to saturate for some pixels of an even area and not for others, the mean
// stays the truth and most of what the frame knows is kept.
TEST(frames_at_the_brink_of_saturation_keep_their_information)
{
    for (int k = -3; k <= 3; k++) {
        const double x = full + 40 * k, radiance = x / times[2], v = gain * x + 9;
        double sum = 0, sum2 = 0, shorter = 0;
        for (int j = 3; j < N; j++)
            shorter += times[j] * times[j] / (gain * radiance * times[j] + 9);
        const double z = (full - x) / sqrt(v), over = 0.5 * erfc(z / M_SQRT2);
        const double phi = exp(-0.5 * z * z) / sqrt(2 * M_PI);
        const double bound =
            shorter + times[2] * times[2] / v * (1 - over - z * phi + phi * phi / over);
        enum { RUNS = 8 };
        for (int run = 0; run < RUNS; run++) {
            struct case_frames *c = frames_of(radiance, (uint64_t)(100 * k + run + 1000));
            struct image out;
            struct hdr_counts counts;
            struct err e;
            assert_true(hdr_merge(&c->f, HDR_POISSON, &out, &counts, &e));
            for (int i = 0; i < PIXELS; i++) {
                const double d = (double)out.px[3 * i] / radiance - 1;
                sum += d;
                sum2 += d * d;
            }
            image_finish(&out);
            free(c);
        }
        assert_near(sum / (RUNS * PIXELS), 0,
                    5e-3); // 0.4 % at worst; left out by prediction: 0.6 %
        // one sample does not reach the bound; without it the variance is up to four times as large
        assert_true(sum2 / (RUNS * PIXELS) * radiance * radiance * bound < 1.9);
    }
}

TEST(noise_is_found_from_the_bracket_alone)
{
    struct case_frames *c = ramp(0, 5);
    const struct hdr_noise noise = exposure_noise(&c->f);
    assert_near(noise.gain, gain, 0.1 * gain); // medians of 4096 pixels
    assert_near(sqrt(noise.read), read_noise, 0.15 * read_noise);
    free(c);
}

TEST(printed_exposure_times_snap_to_the_stops_of_the_camera)
{
    static const struct {
        double printed, true_s;
    } cases[] = {{1. / 15, 1. / 16},
                 {1. / 30, 1. / 32},
                 {1. / 8000, 1. / 8192},
                 {1. / 1600, 1 / exp2(32 / 3.)},
                 {1. / 3, 1 / exp2(5 / 3.)},
                 {0.3, 1 / exp2(5 / 3.)},
                 {1.3, exp2(1 / 3.)},
                 {30, 32},
                 {60, 60},              // bulb: a clock's
                 {1. / 45, exp2(-5.5)}, // a camera of half stops
                 {0.7, exp2(-0.5)}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
        assert_near(exposure_snap(cases[k].printed), cases[k].true_s, 1e-12);
    const double t[] = {1, 0.5, 0.25, 0.501};
    int a, b;
    assert_true(exposure_same(t, 4, &a, &b));
    assert_int_equal(a, 1);
    assert_int_equal(b, 3);
    assert_false(exposure_same(t, 3, &a, &b));
}

// Issue: OpenCV averages the weight over channels, which makes narrow-band spots 90 % too dark.
TEST(a_red_spot_that_saturates_red_alone_keeps_its_true_red)
{
    enum { FRAMES = 6 };
    uint8_t code[FRAMES][9 * 3];
    const uint8_t *ptr[FRAMES];
    double time_s[FRAMES], red = 200, green = 0.5, blue = 0.5;
    struct response r;
    response_linear(&r, 3);
    for (int j = 0; j < FRAMES; j++) {
        time_s[j] = pow(0.25, j);
        ptr[j] = code[j];
        for (int k = 0; k < 9; k++) {
            const double v[3] = {red, green, blue};
            for (int c = 0; c < 3; c++)
                code[j][3 * k + c] = (uint8_t)fmin(255, v[c] * time_s[j] * 128 + 0.5);
        }
    }
    struct bracket b = {FRAMES, 3, 3, 3, ptr, time_s};
    struct image out;
    struct hdr_counts counts;
    struct err e;
    for (int m = 0; m < 3; m++) {
        assert_true(hdr_merge_codes(&b, &r, (enum hdr_method)m, &out, &counts, &e));
        assert_near(out.px[0] / red, 1, 0.02); // a code is 1 in 100 there
        assert_near(out.px[1] / green, 1, 0.02);
        assert_int_equal(out.px[6], 1);
        image_finish(&out);
    }
}

TEST_MAIN(
    cmocka_unit_test(the_mean_is_unbiased_and_its_variance_is_the_cramer_rao_bound_over_10_stops),
    cmocka_unit_test(a_saturated_sample_never_pulls_a_pixel_down),
    cmocka_unit_test(a_pixel_saturated_in_every_frame_is_masked_and_holds_the_bound),
    cmocka_unit_test(scaling_all_exposure_times_scales_the_radiance),
    cmocka_unit_test(a_drift_of_3_percent_per_frame_is_removed_to_a_thousandth),
    cmocka_unit_test(a_low_sample_in_the_shortest_frame_does_not_drop_the_others),
    cmocka_unit_test(frames_at_the_brink_of_saturation_keep_their_information),
    cmocka_unit_test(noise_is_found_from_the_bracket_alone),
    cmocka_unit_test(printed_exposure_times_snap_to_the_stops_of_the_camera),
    cmocka_unit_test(a_red_spot_that_saturates_red_alone_keeps_its_true_red))
