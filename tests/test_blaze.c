// test_blaze.c - the blazed grating of a bokeh calibration: scale, direction, blur, profile.
#include "tests/test.h"

#include "calib/grating.h"
#include "core/mem.h"

enum { W = 560, H = 540, FINE = 4096 };
static const struct disc disc = {281.3, 268.8, 240.2, 0};

// A sawtooth under a Gaussian by plain summation: [FINE] samples of a period of `period` px.
static void blurred_saw(double *out, double period, double sigma, bool rises)
{
    const int reach = (int)(5 * sigma / period * FINE);
    for (int k = 0; k < FINE; k++) {
        double sum = 0, weights = 0;
        for (int m = -reach; m <= reach; m++) {
            const double x = m * period / FINE / sigma, w = exp(-0.5 * x * x);
            const double t = (((k + m) % FINE + FINE) % FINE + 0.5) / FINE;
            sum += w * (rises ? t : 1 - t);
            weights += w;
        }
        out[k] = sum / weights;
    }
}

struct photo {
    double k, angle, sigma, contrast, noise; // cycles / px, radians on the sensor (y down)
    bool rises, sine;
};

// The flattened disc: mean 1, outside 1; 4 x 4 places in every pixel.
static float *paint(const struct photo *p)
{
    static double saw[FINE];
    float *px = xcalloc(W * H, sizeof *px);
    uint32_t seed = 7;
    blurred_saw(saw, 1 / p->k, p->sigma, p->rises);
    for (int j = 0; j < H; j++)
        for (int i = 0; i < W; i++) {
            double sum = 0, noise = 0;
            for (int s = 0; s < 16; s++) {
                const double x = i + (s % 4 - 1.5) / 4 - disc.cx_px,
                             y = j + (s / 4 - 1.5) / 4 - disc.cy_px;
                const double turns = p->k * (x * cos(p->angle) + y * sin(p->angle)) + 0.3;
                const double t = turns - floor(turns);
                sum += (p->sine ? 0.5 + 0.5 * sin(2 * M_PI * t) : saw[(int)(t * FINE)]) / 16;
            }
            for (int s = 0; s < 4; s++) { // near enough to a Gaussian
                seed = seed * 1664525 + 1013904223;
                noise += ((seed >> 8) / 16777216.0 - 0.5) * sqrt(3);
            }
            const bool in = hypot(i - disc.cx_px, j - disc.cy_px) <= disc.radius_px;
            px[j * W + i] = in ? (float)(1 + p->contrast * (sum - 0.5) + p->noise * noise) : 1;
        }
    return px;
}

static void measure(const struct photo *p, struct grating *g, struct blaze *b, double *rmse)
{
    struct err e = {0};
    float *px = paint(p);
    double profile[GRATING_SAMPLES], gain, offset;
    if (!grating_find(g, &disc, px, W, H, &e) || !grating_fit_blaze(g, b, &e))
        fail_msg("%s", e.msg);
    grating_sharpen(g, b->sigma_px, profile);
    grating_affine(profile, b, 1, 0, &gain, &offset, rmse);
    assert_near(gain * p->contrast, 1, 0.04);
    free(px);
}

TEST(period_direction_blur_and_profile_of_a_blaze_are_found)
{
    static const struct {
        struct photo p;
        double rmse; // the issue's: 4 % without noise, T17's 5.83 % with
    } cases[] = {
        {{1 / 21.7, 1.571, 1.87, 0.8, 0, true, false}, 0.04},
        {{1 / 21.7, -1.48, 1.87, 0.8, 0.013, true, false}, 0.0583},
        {{1 / 17.3, 0.1, 2.4, 0.5, 0, false, false}, 0.04},
        {{1 / 30.1, 1.9, 3.1, 0.9, 0.013, false, false}, 0.0583},
        {{1 / 12.2, 0.7, 1.2, 0.6, 0.01, true, false}, 0.0583},
    };
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        const struct photo *p = &cases[c].p;
        struct grating g;
        struct blaze b;
        double rmse;
        measure(p, &g, &b, &rmse);
        const double k = hypot(g.kx, g.ky);
        const double sign = g.kx * cos(p->angle) + g.ky * sin(p->angle) > 0 ? 1 : -1;
        assert_near(k / p->k, 1, 1e-3);
        assert_near(sin(atan2(g.ky, g.kx) - p->angle), 0, 1e-3);
        assert_near(b.sigma_px / p->sigma, 1, 0.02);
        assert_near(b.contrast / p->contrast, 1, 0.02);
        assert_int_equal(b.rises * sign, p->rises ? 1 : -1);
        assert_near(rmse, 0, cases[c].rmse);
    }
}

static void refused(const struct photo *p, bool found, const char *sentence)
{
    struct grating g;
    struct blaze b;
    struct err e = {0};
    float *px = paint(p);
    assert_int_equal(grating_find(&g, &disc, px, W, H, &e), found);
    if (found)
        assert_false(grating_fit_blaze(&g, &b, &e));
    assert_int_equal(e.code, ERR_DATA);
    if (!strstr(e.msg, sentence))
        fail_msg("'%s' lacks '%s'", e.msg, sentence);
    free(px);
}

TEST(what_cannot_be_a_scale_is_refused)
{
    refused(&(struct photo){1 / 130., 0.3, 2, 0.8, 0.01, true, false}, false,
            "lines in the disc of");
    refused(&(struct photo){1 / 21., 0.3, 2, 0, 0.01, true, false}, false, "no lines in the disc");
    refused(&(struct photo){1 / 40., 0.3, 0.1, 0.8, 0.01, true, true}, false,
            "limit of the optics");
    refused(&(struct photo){1 / 8., 0.3, 3, 0.8, 0.01, true, false}, false, "limit of the optics");
}

TEST_MAIN(cmocka_unit_test(period_direction_blur_and_profile_of_a_blaze_are_found),
          cmocka_unit_test(what_cannot_be_a_scale_is_refused))
