// test_sensor_records.c - dark, noise, flat and linearity against sensors of known make.
#include "tests/test.h"

#include "calib/dark.h"
#include "calib/flat.h"
#include "calib/linearity.h"
#include "calib/noise.h"
#include "core/mem.h"
#include "tests/noise.h"

enum { W = 320, H = 240, PIXELS = W * H };

// A sensor: 0.4 counts per electron, 2 counts of read noise, PRNU 0.7 %, black 256, 12 bits.
static const double gain = 0.4, read_noise = 2, prnu = 0.007, black = 256, white = 4095;

struct sensor {
    float sensitivity[PIXELS], offset[PIXELS], rate[PIXELS]; // 1 + prnu; counts; counts / s
    uint64_t seed;
};

static struct sensor *sensor_new(void)
{
    struct sensor *s = xcalloc(1, sizeof *s);
    s->seed = 42;
    for (int k = 0; k < PIXELS; k++) {
        s->sensitivity[k] = (float)(1 + prnu * noise_gauss(&s->seed));
        s->offset[k] = (float)(0.5 * noise_gauss(&s->seed));
        s->rate[k] = k % 1000 == 7 ? 500 : 0.5f;
    }
    return s;
}

// signal(k): counts above black that an even sensor would have.
static void expose(struct sensor *s, double level, double slope, double time_s, float *out)
{
    for (int k = 0; k < PIXELS; k++) {
        const double light = level * (1 + slope * ((double)(k % W) / W - 0.5));
        const double mean = light * (double)s->sensitivity[k] + (double)s->rate[k] * time_s;
        const double x = black + (double)s->offset[k] + mean +
                         sqrt(gain * mean + read_noise * read_noise) * noise_gauss(&s->seed);
        out[k] = (float)fmin(white, fmax(0, floor(x + 0.5)));
    }
}

TEST(dark_frames_give_black_read_noise_current_and_hot_pixels)
{
    struct sensor *s = sensor_new();
    struct dark_sums sums;
    struct dark d, back;
    struct err e = {0};
    float *px = xcalloc(PIXELS, sizeof *px);
    assert_true(dark_begin(&sums, W, H, &e));
    for (int k = 0; k < 12; k++) {
        const double time_s = 0.01 * pow(4, k % 4); // 10 to 640 ms
        expose(s, 0, 0, time_s, px);
        dark_add(&sums, px, time_s);
    }
    assert_true(dark_end(&sums, &d, &e));
    assert_near(d.read_noise, sqrt(read_noise * read_noise + 1 / 12.), 0.03 * read_noise);
    assert_near(d.black_mean, black, 0.1);
    assert_near(d.rate_median, 0.5, 0.1);
    assert_near((double)d.n_hot, PIXELS / 1000, 3);
    assert_true(d.hot[7] && d.hot[1007] && !d.hot[8]);
    double worst = 0, sum = 0; // the dark that is taken off a long exposure
    for (int k = 0; k < PIXELS; k++) {
        const double truth = black + (double)s->offset[k] + (double)s->rate[k] * 0.64;
        const double off = dark_at(&d, (size_t)k, 0.64) - truth;
        worst = fmax(worst, d.hot[k] ? 0 : fabs(off));
        sum += d.hot[k] ? 0 : off * off;
    }
    assert_true(sqrt(sum / PIXELS) < 0.6 * read_noise && worst < 4 * read_noise);

    char path[] = "/tmp/nacre-dark-XXXXXX.exr";
    close(mkstemps(path, 4));
    if (!dark_write(&d, "test", path, &e) || !dark_read(&back, path, &e))
        fail_msg("%s", e.msg);
    assert_int_equal(back.n_hot, d.n_hot);
    assert_near(dark_at(&back, 1234, 0.1), dark_at(&d, 1234, 0.1), 1e-3);
    assert_string_equal(back.head.kind, "dark");
    unlink(path);
    dark_finish(&back);
    dark_finish(&d);

    assert_true(dark_begin(&sums, W, H, &e));
    dark_add(&sums, px, 1);
    assert_false(dark_end(&sums, &d, &e));
    assert_non_null(strstr(e.msg, "1 dark frame: two or more are needed"));
    free(px);
    free(s);
}

static void transfer(struct sensor *s, double top, struct noise_sums *sums)
{
    float *a = xcalloc(PIXELS, sizeof *a), *b = xcalloc(PIXELS, sizeof *b);
    for (int k = 0; k <= 8; k++) {
        expose(s, top * k / 8, 0.3, 0, a);
        expose(s, top * k / 8, 0.3, 0, b);
        noise_add(sums, a, b, NULL, W, H);
    }
    free(a);
    free(b);
}

TEST(photon_transfer_gives_gain_within_1_and_read_noise_within_3_percent)
{
    struct sensor *s = sensor_new();
    struct noise n;
    struct err e = {0};
    double model[2] = {0};
    for (int round = 0; round < 2; round++) {
        struct noise_sums sums = {.black = black, .white = white, .model = {model[0], model[1]}};
        transfer(s, 3000, &sums);
        if (!noise_end(&sums, &n, &e))
            fail_msg("%s", e.msg);
        model[0] = n.read * n.read;
        model[1] = n.gain;
    }
    assert_near(n.gain / gain, 1, 0.01);
    assert_near(n.read / sqrt(read_noise * read_noise + 1 / 12.), 1, 0.03);
    assert_near(n.prnu / prnu, 1, 0.05);
    assert_near(n.gain, gain, 4 * n.gain_sigma);
    free(s);
}

TEST(the_noise_of_dark_current_is_no_read_noise)
{
    struct sensor *s = sensor_new();
    struct dark_sums darks;
    struct dark d;
    struct noise n;
    struct err e = {0};
    float *px = xcalloc(PIXELS, sizeof *px);
    for (int k = 0; k < PIXELS; k++)
        s->rate[k] = 8;
    assert_true(dark_begin(&darks, W, H, &e));
    for (int k = 0; k < 12; k++) {
        const double time_s = 0.01 * pow(4, k % 4); // 10 to 640 ms
        expose(s, 0, 0, time_s, px);
        dark_add(&darks, px, time_s);
    }
    assert_true(dark_end(&darks, &d, &e));
    struct noise_sums sums = {.black = black,
                              .white = white,
                              .model = {read_noise * read_noise, gain},
                              .dark_level = d.level,
                              .dark_variance = d.read_noise * d.read_noise,
                              .dark_samples = 12. * PIXELS};
    transfer(s, 3000, &sums);
    assert_true(noise_end(&sums, &n, &e));
    assert_true(d.read_noise > 1.04 * read_noise); // the dark frames' own noise has both
    assert_near(n.read / sqrt(read_noise * read_noise + 1 / 12.), 1, 0.01);
    dark_finish(&d);
    free(px);
    free(s);
}

TEST(frames_that_cannot_tell_noise_are_refused)
{
    struct sensor *s = sensor_new();
    struct noise n;
    struct err e = {0};
    struct noise_sums none = {.black = black, .white = white};
    assert_false(noise_end(&none, &n, &e));
    assert_non_null(strstr(e.msg, "no two frames have the same exposure"));
    struct noise_sums dark = {.black = black, .white = white};
    transfer(s, 0, &dark);
    assert_false(noise_end(&dark, &n, &e));
    assert_non_null(strstr(e.msg, "photon transfer needs light"));
    struct noise_sums bright = {.black = black, .white = 200};
    transfer(s, 3000, &bright);
    assert_false(noise_end(&bright, &n, &e));
    assert_non_null(strstr(e.msg, "every pixel is saturated in every pair"));
    assert_int_equal(e.code, ERR_DATA);
    free(s);
}

TEST(a_flat_is_the_light_of_an_even_target_dust_or_not)
{
    struct image im;
    struct flat f, back;
    struct err e = {0};
    assert_true(image_init(&im, W, H, 1, &e));
    for (int j = 0; j < H; j++)
        for (int i = 0; i < W; i++) {
            const double r2 = pow((i - 170.) / W, 2) + pow((j - 110.) / W, 2);
            const bool dust = hypot(i - 60, j - 70) < 6;
            im.px[j * W + i] = (float)(5 * (1 - 0.8 * r2 + 0.2 * r2 * r2) * (dust ? 0.7 : 1));
        }
    if (!flat_fit(&f, &im, 1, &e))
        fail_msg("%s", e.msg);
    for (int k = 0; k < 50; k++) {
        const int i = k * 37 % W, j = k * 53 % H;
        if (hypot(i - 60, j - 70) > 8)
            assert_near(im.px[j * W + i] / flat_at(&f, 0, i, j) /
                            ((double)im.px[120 * W + 160] / flat_at(&f, 0, 160, 120)),
                        1, 2e-3);
    }
    assert_near(flat_at(&f, 0, 0.5 * (W - 1), 0.5 * (H - 1)), 1, 1e-12); // keeps the radiometry
    char path[] = "/tmp/nacre-flat-XXXXXX";
    close(mkstemp(path));
    assert_true(flat_write(&f, "test", path, &e) && flat_read(&back, path, &e));
    assert_near(flat_at(&back, 0, 12, 34), flat_at(&f, 0, 12, 34), 1e-7);
    unlink(path);
    for (int k = 0; k < PIXELS; k++)
        im.px[k] = (float)(k / 8 % 2);
    assert_false(flat_fit(&f, &im, 1, &e));
    assert_int_equal(e.code, ERR_DATA);
    image_finish(&im);
}

static double worst_of(struct sensor *s, double bend)
{
    struct linearity_sums sums = {0};
    struct linearity l;
    struct err e = {0};
    float *px[2] = {xcalloc(PIXELS, sizeof(float)), xcalloc(PIXELS, sizeof(float))};
    for (int k = 0; k < 6; k++) {
        for (int m = 0; m < 2; m++) {
            expose(s, 1000 * (m + 1) * (k + 1) / 4.0, 1.9, 0, px[m]);
            for (int i = 0; i < PIXELS; i++) {
                px[m][i] -= (float)(black + (double)s->offset[i]);
                px[m][i] *= (float)(1 - bend * (double)px[m][i] / white);
            }
        }
        linearity_add(&sums, px[0], px[1], PIXELS, 1, 2, 3500);
    }
    if (!linearity_end(&sums, 3500, &l, &e))
        fail_msg("%s", e.msg);
    free(px[0]);
    free(px[1]);
    return l.worst;
}

TEST(a_sensor_that_bends_is_told_from_one_that_does_not)
{
    struct sensor *s = sensor_new();
    assert_near(worst_of(s, 0), 0, 1e-4);
    assert_true(worst_of(s, 0.03) > 3e-4);
    free(s);
}

TEST_MAIN(cmocka_unit_test(dark_frames_give_black_read_noise_current_and_hot_pixels),
          cmocka_unit_test(photon_transfer_gives_gain_within_1_and_read_noise_within_3_percent),
          cmocka_unit_test(the_noise_of_dark_current_is_no_read_noise),
          cmocka_unit_test(frames_that_cannot_tell_noise_are_refused),
          cmocka_unit_test(a_flat_is_the_light_of_an_even_target_dust_or_not),
          cmocka_unit_test(a_sensor_that_bends_is_told_from_one_that_does_not))
