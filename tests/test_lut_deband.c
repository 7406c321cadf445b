// test_lut_deband.c - photographs through a band of wavelengths.
#include "tests/lobes.h"

#include "core/mem.h"

// A Gaussian band of this full width at half maximum, 1 nm steps.
static struct spectrum gaussian(double centre_nm, double fwhm_nm)
{
    const int n = 2 * (int)(2 * fwhm_nm) + 1;
    struct spectrum s = {n, xcalloc((size_t)n, sizeof(double)), xcalloc((size_t)n, sizeof(double))};
    for (int k = 0; k < n; k++) {
        const double x = k - n / 2;
        s.lambda_m[k] = (centre_nm + x) * 1e-9;
        s.value[k] = exp(-4 * M_LN2 * x * x / (fwhm_nm * fwhm_nm));
    }
    return s;
}

// What the camera sees of the lobes through the band.
static struct lut_pattern photograph(const struct lobes *l, const struct spectrum *band, int side)
{
    struct lut_pattern p = lobes_picture(l, side, side, side / 2, side / 2);
    memset(p.px, 0, sizeof(float) * (size_t)(side * side));
    double whole = 0;
    for (int q = 0; q < band->n; q++)
        whole += band->value[q];
    for (int q = 0; q < band->n; q++) {
        const double ratio = l->lambda_m / band->lambda_m[q];
        for (int j = 0; j < side; j++)
            for (int i = 0; i < side; i++)
                p.px[j * side + i] += (float)(band->value[q] / whole * pow(ratio, l->exponent) *
                                              lobes_at(l, (i - p.cx) * ratio, (j - p.cy) * ratio));
    }
    return p;
}

static double error_of(const struct table *t, const struct lobes *l)
{
    double diff = 0, norm = 0;
    for (int j = 1; j < t->n; j += 7)
        for (int i = 1; i < t->n; i += 7) {
            double truth[3];
            lobes_truth(l, table_node(t, i), table_node(t, j), 801, truth);
            for (int c = 0; c < 3; c++) {
                const double v = t->tab[(j * t->n + i) * 3 + c];
                diff += (v - truth[c]) * (v - truth[c]);
                norm += truth[c] * truth[c];
            }
        }
    return sqrt(diff / norm);
}

TEST(undoing_the_band_lowers_the_error_within_its_noise_limit)
{
    struct spectrum s, band = gaussian(532, 20);
    struct err e = {0};
    assert_true(illuminant_get(&s, "E", &e));
    struct lobes l = lobes_new(100, 2.5);
    l.exponent = 2;
    l.h_per_px = 2e-3;
    l.light = &s;
    l.lambda_m = lut_effective_wavelength(&band, l.exponent);
    struct lut_pattern p = photograph(&l, &band, 320);
    p.variance = calloc(320 * 320, sizeof(float));
    for (int k = 0; k < 320 * 320; k++)
        p.variance[k] = 1e-6f;
    double error[2], sigma[2];
    for (int k = 0; k < 2; k++) {
        const struct lut_request r = {.pattern = &p,
                                      .lambda_m = l.lambda_m,
                                      .light = &s,
                                      .f0 = 1,
                                      .exponent = 2,
                                      .n = 129,
                                      .range = 0.2,
                                      .power = 1,
                                      .tolerance = 1e-4,
                                      .band = k ? &band : NULL,
                                      .noise_limit = 2};
        struct table t;
        struct lut_report report;
        assert_true(lut_build(&r, &t, &report, &e));
        error[k] = error_of(&t, &l);
        sigma[k] = t.sigma[3 * (20 * 129 + 30) + 1];
        if (k) {
            assert_true(report.noise_gain > 1 && report.noise_gain <= 2);
            assert_true(sigma[1] / sigma[0] <= 2.05);
        }
        table_finish(&t);
    }
    print_message("error %.2g as photographed, %.2g undone; noise times %.2f\n", error[0], error[1],
                  sigma[1] / sigma[0]);
    assert_true(error[1] < 0.1 * error[0]);
    lut_pattern_finish(&p);
    spectrum_finish(&band);
    spectrum_finish(&s);
}

TEST(the_effective_wavelength_moves_no_lobe)
{
    struct spectrum narrow = gaussian(532, 2), wide = gaussian(532, 40);
    assert_near(lut_effective_wavelength(&narrow, 2), 532e-9, 0.01e-9);
    // The mean of ln(l) under b l^-2: shorter by (2 + 1/2) sigma^2 / l = 1.36 nm
    const double sigma_nm = 40 / 2.354820;
    assert_near(lut_effective_wavelength(&wide, 2), (532 - 2.5 * sigma_nm * sigma_nm / 532) * 1e-9,
                0.05e-9);
    spectrum_finish(&narrow);
    spectrum_finish(&wide);
}

TEST_MAIN(cmocka_unit_test(undoing_the_band_lowers_the_error_within_its_noise_limit),
          cmocka_unit_test(the_effective_wavelength_moves_no_lobe))
