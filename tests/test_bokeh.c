// test_bokeh.c - heights from bokeh photographs made here, whose truth is known, and from the
// reference one.
#include "tests/test.h"

#include "core/imgfile.h"
#include "process/bokeh.h"

enum { W = 640, H = 520 };
static const double M_PER_PX = 0.08e-6, HEIGHT_M = 0.2e-6;

struct made {
    double pitch_m[2], direction_rad, turn_rad;
    bool lines; // one direction only
};

static double clip(double x)
{
    return x < 0 ? 0 : x > 1 ? 1 : x;
}

// Soft-edged pixels: height as a smooth function of the sample's place.
static double true_height(const struct made *m, double x, double y)
{
    const double c = cos(m->direction_rad), s = sin(m->direction_rad);
    const double a = 0.5 + 0.5 * cos(2 * M_PI * (c * x + s * y) / m->pitch_m[0]);
    const double b = m->lines ? 1 : 0.5 + 0.5 * cos(2 * M_PI * (-s * x + c * y) / m->pitch_m[1]);
    return HEIGHT_M * a * b;
}

// The photograph: a disc with uneven light, dark is deep, slightly noisy; no blur (sigma is small).
static void photograph(const struct made *m, double cx, double cy, double radius, struct image *im)
{
    struct err e = {0};
    assert_true(image_init(im, W, H, 1, &e));
    const double c = cos(m->turn_rad), s = sin(m->turn_rad);
    unsigned seed = 1;
    for (int j = 0; j < H; j++)
        for (int i = 0; i < W; i++) {
            // the sensor shows the sample turned counter-clockwise: undo it here
            const double di = i - cx, dj = j - cy, x = c * di - s * dj, y = s * di + c * dj;
            const double edge = clip(radius - hypot(di, dj) + 0.5);
            const double light =
                0.4 * (1 - 0.15 * (di * di + dj * dj) / (radius * radius) + 0.05 * di / radius);
            const double reflect =
                0.8 + 0.4 * true_height(m, x * M_PER_PX, y * M_PER_PX) / HEIGHT_M;
            seed = seed * 1664525u + 1013904223u;
            im->px[j * W + i] =
                (float)(2e-4 + edge * light * reflect + 1e-4 * (seed / 4294967296.0 - 0.5));
        }
}

// The mean of `reflect` is 1 or 0.9: I = reflect / mean, so heights are (I * mean - 0.8) / 0.4.
static struct bokeh_record record(const struct made *m)
{
    const double mean = m->lines ? 1.0 : 0.9;
    return (struct bokeh_record){.channel = "Y",
                                 .lines_per_m = 6e5,
                                 .blaze_rad = 0.2,
                                 .turn_rad = m->turn_rad,
                                 .m_per_px = M_PER_PX,
                                 .sigma_px = 0.5,
                                 .iterations = 1,
                                 .gain_m = HEIGHT_M * mean / 0.4,
                                 .offset = 0.8 / mean};
}

TEST(the_sample_comes_back_turned_and_scaled)
{
    static const struct made cases[] = {
        {{6.2e-6, 4.7e-6}, 0.16, M_PI / 2, false},
        {{5e-6, 3.1e-6}, -0.3, 0, false},
        {{4e-6, 6e-6}, 0.05, 0.4, false},
        {{2.5e-6, 1}, 0.02, M_PI / 2, true},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const struct made *m = &cases[k];
        struct image im;
        photograph(m, 310, 260, 230, &im);
        const struct bokeh_record rec = record(m);
        struct hfield hf;
        struct bokeh_result r;
        struct err e = {0};
        const struct bokeh_options opt = {.f_number = NAN, .lines = BOKEH_1D_IF_LINES};
        if (!bokeh_height(&im, &rec, &opt, &hf, &r, &e))
            fail_msg("%s", e.msg);
        assert_int_equal(r.n_periods, m->lines ? 1 : 2);
        assert_int_equal(r.fold, m->lines ? FOLD_LINES : FOLD_NONE);
        for (int p = 0; p < r.n_periods; p++) {
            assert_near(r.period[p].period_m / m->pitch_m[p], 1, 2e-3);
            const double expected = m->direction_rad + p * M_PI / 2;
            assert_near(remainder(r.period[p].direction_rad - expected, M_PI), 0, 0.1 * M_PI / 180);
        }
        // Against the truth at every node; the centre is the middle of the field.
        double miss = 0, truth = 0, mean = 0;
        for (int j = 0; j < hf.ny; j++)
            for (int i = 0; i < hf.nx; i++) {
                const double x = (i - hf.nx / 2) * M_PER_PX, y = (j - hf.ny / 2) * M_PER_PX;
                const double t = true_height(m, x, y), d = (double)hf.z[j * hf.nx + i] - t;
                miss += d * d;
                mean += t;
                truth += t * t;
            }
        const double n = (double)hf.nx * hf.ny;
        const double sd = sqrt(truth / n - mean * mean / n / n);
        print_message("case %zu: RMSE %.2f %% of the height\n", k, 100 * sqrt(miss / n) / HEIGHT_M);
        assert_true(sqrt(miss / n) < 0.03 * HEIGHT_M);
        assert_near(r.sd_m / sd, 1, 0.02);
        assert_near(r.cutoff_per_m, 343.4e3, 100); // T17: 343 lp/mm at f/5.6
        hfield_finish(&hf);
        image_finish(&im);
    }
}

TEST(the_reference_sample_has_its_pitches_and_direction)
{
    struct image im;
    struct err e = {0};
    if (!image_read(&im, shared_or_skip("reference/bokeh/sample.png"), &e))
        fail_msg("%s", e.msg);
    struct bokeh_record rec = {.channel = "B",
                               .turn_rad = M_PI / 2,
                               .m_per_px = 0.07692855304153799e-6,
                               .sigma_px = 1.874,
                               .iterations = 20,
                               .gain_m = 1e-6,
                               .offset = 1};
    const struct bokeh_options opt = {.f_number = NAN};
    struct hfield hf;
    struct bokeh_result r;
    if (!bokeh_height(&im, &rec, &opt, &hf, &r, &e))
        fail_msg("%s", e.msg);
    assert_int_equal(r.n_periods, 2);
    assert_near(r.period[0].period_m / 6.2062764749619515e-6, 1, 0.005);
    assert_near(r.period[1].period_m / 7.7948457889697025e-6, 1, 0.005);
    assert_near(r.period[0].direction_rad * 180 / M_PI, 9.376227313693068, 0.3);
    hfield_finish(&hf);
    image_finish(&im);
}

TEST(what_is_no_bokeh_is_refused)
{
    struct image im;
    struct err e = {0};
    const struct made m = {{6e-6, 5e-6}, 0, 0, false};
    const struct bokeh_record rec = record(&m);
    const struct bokeh_options opt = {.f_number = NAN};
    struct hfield hf = {0};
    struct bokeh_result r;
    assert_true(image_init(&im, W, H, 1, &e));
    for (int k = 0; k < W * H; k++)
        im.px[k] = 0.3f;
    assert_false(bokeh_height(&im, &rec, &opt, &hf, &r, &e)); // no disc
    assert_int_equal(e.code, ERR_DATA);
    image_finish(&im);
    photograph(&m, 60, 260, 200, &im); // cut by the frame
    assert_false(bokeh_height(&im, &rec, &opt, &hf, &r, &e));
    image_finish(&im);
    photograph(&m, 310, 260, 200, &im);
    const struct bokeh_options red = {.f_number = NAN, .channel = "R"};
    im.nc = 1;
    assert_true(
        bokeh_height(&im, &rec, &red, &hf, &r, &e)); // a picture of one channel has just that
    hfield_finish(&hf);
    image_finish(&im);
}

TEST_MAIN(cmocka_unit_test(the_sample_comes_back_turned_and_scaled),
          cmocka_unit_test(the_reference_sample_has_its_pitches_and_direction),
          cmocka_unit_test(what_is_no_bokeh_is_refused))
