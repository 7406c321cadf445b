// test_sim_sensor.c - the sensor's statistics and flaws are those that it states.
#include "tests/test.h"

#include "sim/rng.h"
#include "sim/sensor.h"

enum { W = 200, H = 150, N = W * H };

static const struct sim_sensor ideal = {
    .bits = 14,
    .black = 100,
    .responsivity = 1000,
    .electrons_per_count = 2.5,
    .shot_noise = true,
    .full_well = 1e6,
};

// One frame of an even light into raw[N]; the mean radiance is 1.
static void expose(const struct sim_sensor *spec, double seconds, uint64_t frame, uint16_t *raw)
{
    static float even[N];
    static double row_s[H];
    struct sensor s;
    struct err e = {0};
    for (int k = 0; k < N; k++)
        even[k] = 1;
    for (int j = 0; j < H; j++)
        row_s[j] = seconds;
    const struct sensor_layer layer = {even, row_s};
    assert_true(sensor_init(&s, spec, W, H, 5, &e));
    sensor_expose(&s, &layer, 1, seconds, 1, frame, raw);
    sensor_finish(&s);
}

static void statistics(const uint16_t *raw, double *mean, double *variance)
{
    double sum = 0, square = 0;
    for (int k = 0; k < N; k++)
        sum += raw[k];
    *mean = sum / N;
    for (int k = 0; k < N; k++)
        square += pow(raw[k] - *mean, 2);
    *variance = square / (N - 1);
}

TEST(variance_against_mean_is_a_line_of_the_stated_gain)
{
    struct sim_sensor spec = ideal;
    uint16_t raw[N];
    double mean[6], variance[6];
    spec.read_noise = 5;
    for (int k = 0; k < 6; k++) {
        expose(&spec, 0.02 * (1 << k), (uint64_t)k, raw);
        statistics(raw, &mean[k], &variance[k]);
        const double counts = 20. * (1 << k), read = 25 / (2.5 * 2.5);
        // variance = counts / gain + read^2 + 1/12 of rounding; its own error is sqrt(2 / N).
        const double expect = counts / 2.5 + read + 1. / 12;
        assert_near(mean[k] - 100, counts, 5 * sqrt(expect / N));
        assert_near(variance[k] / expect, 1, 5 * sqrt(2. / N));
    }
    const double slope = (variance[5] - variance[0]) / (mean[5] - mean[0]);
    assert_near(1 / slope, 2.5, 0.1);
}

TEST(twice_the_exposure_is_twice_the_signal_above_black)
{
    uint16_t a[N], b[N];
    double mean[2], variance;
    expose(&ideal, 1, 0, a);
    expose(&ideal, 2, 1, b);
    statistics(a, &mean[0], &variance);
    statistics(b, &mean[1], &variance);
    assert_near((mean[1] - 100) / (mean[0] - 100), 2, 1e-3); // 5 deviations of the means: 7e-4
}

TEST(frames_of_one_number_are_the_same_and_others_are_not)
{
    uint16_t a[N], b[N];
    expose(&ideal, 0.1, 3, a);
    expose(&ideal, 0.1, 3, b);
    assert_memory_equal(a, b, sizeof a);
    expose(&ideal, 0.1, 4, b);
    assert_memory_not_equal(a, b, sizeof a);
}

TEST(fixed_patterns_stay_and_have_the_stated_size)
{
    struct sim_sensor spec = ideal;
    uint16_t a[N], b[N];
    double mean, variance, covariance = 0, mean_b;
    spec.shot_noise = false;
    spec.prnu = 0.01;
    spec.fixed_pattern = 3;
    spec.column_pattern = 2;
    expose(&spec, 1, 0, a);
    expose(&spec, 1, 1, b);
    statistics(a, &mean, &variance);
    statistics(b, &mean_b, &variance);
    for (int k = 0; k < N; k++)
        covariance += (a[k] - mean) * (b[k] - mean_b) / N;
    // PRNU of 1000 counts, offsets of pixels and columns; 200 columns know their own to 10 %.
    assert_near(covariance, 100 + 9 + 4, 3 + 2 * 4 * sqrt(2. / W));
    assert_near(variance - covariance, 0, 0.5);
}

TEST(hot_pixels_are_as_many_as_stated_and_grow_with_time)
{
    struct sim_sensor spec = ideal;
    uint16_t raw[N];
    int hot = 0;
    spec.shot_noise = false;
    spec.hot_pixels = 0.01;
    spec.hot_current = 5000;
    spec.responsivity = 1e-9;
    expose(&spec, 1, 0, raw);
    for (int k = 0; k < N; k++)
        hot += raw[k] > 120;
    // exp(-20 * 2.5 / 5000) of 300 are hotter than 20 counts
    assert_near(hot, 297, 5 * sqrt(300));
}

TEST(a_full_well_spills_along_its_column)
{
    struct sim_sensor spec = ideal;
    static float light[N];
    static double row_s[H];
    uint16_t raw[N];
    struct sensor s;
    struct err e = {0};
    spec.shot_noise = false;
    spec.full_well = 1000;
    spec.blooming = 1;
    memset(light, 0, sizeof light);
    for (int j = 0; j < H; j++)
        row_s[j] = 1;
    light[75 * W + 100] = 2; // 5000 electrons
    const struct sensor_layer layer = {light, row_s};
    assert_true(sensor_init(&s, &spec, W, H, 5, &e));
    sensor_expose(&s, &layer, 1, 1, 1, 0, raw);
    sensor_finish(&s);
    for (int d = -2; d <= 2; d++) // four thousand spill: two wells either way
        assert_int_equal(raw[(75 + d) * W + 100], 100 + 400);
    assert_int_equal(raw[78 * W + 100], 100);
    assert_int_equal(raw[75 * W + 101], 100);
}

TEST(bits_and_black_drift_are_as_stated)
{
    uint16_t raw[N];
    for (int bits = 8; bits <= 14; bits += 2) {
        struct sim_sensor spec = ideal;
        spec.bits = bits;
        spec.black = 10;
        expose(&spec, 100, 0, raw);
        assert_int_equal(raw[0], (1 << bits) - 1);
    }
    struct sim_sensor spec = ideal;
    double least = INFINITY, most = -INFINITY, mean, variance;
    spec.black_drift = 2;
    spec.responsivity = 1e-9;
    spec.read_noise = 5; // dither
    for (uint64_t frame = 0; frame < 400; frame += 20) {
        expose(&spec, 1, frame, raw);
        statistics(raw, &mean, &variance);
        least = fmin(least, mean);
        most = fmax(most, mean);
    }
    assert_true(least > 97.9 && most < 102.1 && most - least > 0.5);
}

TEST(random_numbers_have_their_distributions)
{
    static const double means[] = {0.3, 4, 9.9, 10, 37, 1e4};
    for (size_t m = 0; m < sizeof means / sizeof *means; m++) {
        double sum = 0, square = 0;
        for (uint64_t k = 0; k < 100000; k++) {
            struct rng r = rng_at(1, m < 3 ? RNG_NOISE : RNG_PRNU, k);
            const double x = rng_poisson(&r, means[m]) - means[m];
            sum += x;
            square += x * x;
        }
        assert_near(sum / 1e5, 0, 5 * sqrt(means[m] / 1e5));
        assert_near(square / 1e5 / means[m], 1, 5 * sqrt((2 + 1 / means[m]) / 1e5));
    }
    // The first words for counter and key zero: Random123's known answer for Philox 4x32-10.
    struct rng r = rng_at(0, 0, 0);
    uint32_t word[4];
    for (int k = 3; k >= 0; k--)
        word[k] = rng_word(&r);
    assert_int_equal(word[0], 0x6627e8d5);
    assert_int_equal(word[1], 0xe169c58d);
    assert_int_equal(word[2], 0xbc57ac4c);
    assert_int_equal(word[3], 0x9b00dbd8);
}

TEST_MAIN(cmocka_unit_test(variance_against_mean_is_a_line_of_the_stated_gain),
          cmocka_unit_test(twice_the_exposure_is_twice_the_signal_above_black),
          cmocka_unit_test(frames_of_one_number_are_the_same_and_others_are_not),
          cmocka_unit_test(fixed_patterns_stay_and_have_the_stated_size),
          cmocka_unit_test(hot_pixels_are_as_many_as_stated_and_grow_with_time),
          cmocka_unit_test(a_full_well_spills_along_its_column),
          cmocka_unit_test(bits_and_black_drift_are_as_stated),
          cmocka_unit_test(random_numbers_have_their_distributions))
