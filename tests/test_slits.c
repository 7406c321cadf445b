// test_slits.c - analytic gratings: against sums of waves, at removable singularities, G04's
// listing.
#include "tests/test.h"

#include "core/imgfile.h"
#include "process/multislit.h"
#include "process/rainbow.h"
#include "tests/run.h"
#include <complex.h>

static const struct multislit cd = { // T17 6.1
    .pitch_m = 2e-6,
    .width_m = 0.5e-6,
    .count = 21,
    .exponent = 2};

static struct spectrum light_of(const char *name)
{
    struct spectrum s = {0};
    struct err e = {0};
    assert_true(illuminant_get(&s, name, &e));
    return s;
}

// The waves of all slits, each the closed integral over its width.
static double by_waves(const struct multislit *s, double u, double lambda_m)
{
    double complex sum = 0;
    const double k = 2 * M_PI * u / lambda_m;
    for (int n = 0; n < s->count; n++)
        sum += cexp(I * k * s->pitch_m * n);
    const double half = 0.5 * k * s->width_m;
    const double slit = half == 0 ? 1 : sin(half) / half;
    return creal(sum * conj(sum)) / ((double)s->count * s->count) * slit * slit;
}

TEST(slits_are_the_sum_of_their_waves)
{
    for (int k = -4000; k <= 4000; k++) {
        const double u = k / 2000.0 * 0.999, lambda_m = 380e-9 + (k + 4000) * 5e-11;
        assert_near(multislit_power(&cd, u, lambda_m), by_waves(&cd, u, lambda_m), 1e-12);
    }
}

TEST(zeros_of_the_denominator_are_no_trouble)
{
    static const double beside[] = {0, 1e-16, 1e-13, 1e-10, 1e-8, 3e-8, 1e-7, 1e-5};
    struct multislit one = cd;
    for (int order = -8; order <= 8; order++)
        for (size_t k = 0; k < sizeof beside / sizeof *beside; k++) {
            // d u / lambda = order + beside; the slit's own factor is taken away
            const double lambda_m = 532e-9, u = (order + beside[k]) * lambda_m / cd.pitch_m;
            one.count = 1;
            const double slit = multislit_power(&one, u, lambda_m);
            const double x = M_PI * cd.count * (u * cd.pitch_m / lambda_m - order);
            const double near =
                1 - x * x / 3 * (1 - 1.0 / (cd.count * cd.count)); // Taylor, order 2
            assert_near(multislit_power(&cd, u, lambda_m), slit * near, 1e-12);
        }
    assert_near(multislit_power(&cd, 0, 500e-9), 1, 0);
    struct multislit many = cd;
    many.count = 1000000;
    assert_near(multislit_power(&many, 0.25, 500e-9), multislit_power(&one, 0.25, 500e-9), 1e-9);
}

TEST(a_row_is_constant_across_and_a_radial_one_all_around)
{
    struct spectrum e_light = light_of("E");
    struct err e = {0};
    struct table row = {0}, radial = {0}, turned = {0};
    struct multislit s = cd;
    assert_true(multislit_table(&row, &s, &e_light, 1e-9, 101, 1, 1, &e));
    s.radial = true;
    assert_true(multislit_table(&radial, &s, &e_light, 1e-9, 101, 1, 1, &e));
    s.radial = false;
    s.turn_rad = M_PI / 2;
    assert_true(multislit_table(&turned, &s, &e_light, 1e-9, 101, 1, 1, &e));
    for (int j = 0; j <= 100; j += 10)
        for (int i = 0; i <= 100; i++)
            for (int c = 0; c < 3; c++) {
                const float at = row.tab[(50 * 101 + i) * 3 + c];
                assert_near(row.tab[(j * 101 + i) * 3 + c], at, 1e-7);
                assert_near(turned.tab[(i * 101 + j) * 3 + c], at, 1e-6);
            }
    for (int i = 0; i <= 100; i++) // (0.6, 0.8) t has the radius t
        for (int c = 0; c < 3; c++) {
            double out[3];
            const double t = table_node(&row, i);
            table_eval(&radial, 0, t, 2, 0, out);
            assert_near(out[c], row.tab[(50 * 101 + i) * 3 + c], 1e-6);
        }
    assert_near(row.tab[(50 * 101 + 50) * 3 + 1], 1, 1e-6); // Y = 1 at h = 0
    table_finish(&row);
    table_finish(&radial);
    table_finish(&turned);
    spectrum_finish(&e_light);
}

TEST(the_wavelength_step_resolves_the_lobes)
{
    struct spectrum light = light_of("D65");
    struct err e = {0};
    struct table coarse = {0}, fine = {0};
    const double step_m = multislit_step(&cd, 1);
    assert_true(multislit_table(&coarse, &cd, &light, step_m, 201, 1, 1, &e));
    assert_true(multislit_table(&fine, &cd, &light, step_m / 8, 201, 1, 1, &e));
    double apart = 0, all = 0;
    for (int k = 0; k < 201 * 201 * 3; k++) {
        apart += pow(coarse.tab[k] - fine.tab[k], 2);
        all += pow(fine.tab[k], 2);
    }
    assert_near(sqrt(apart / all), 0, 1e-3);
    table_finish(&coarse);
    table_finish(&fine);
    spectrum_finish(&light);
}

TEST(an_absolute_row_reflects_width_over_pitch)
{
    double lambda_m[] = {531e-9, 532e-9, 533e-9}, line[] = {0, 1, 0};
    const struct spectrum laser = {.n = 3, .lambda_m = lambda_m, .value = line};
    struct multislit s = {.pitch_m = 8e-6, .width_m = 3e-6, .count = 5, .window = {0, 0.05}};
    s.absolute = true;
    struct err e = {0};
    struct table t = {0};
    assert_true(multislit_table(&t, &s, &laser, 1e-9, 1001, 2, 1, &e));
    double sum = 0, white[3];
    for (int k = 0; k < 1001 * 1001; k++)
        sum += t.tab[3 * k + 1];
    cie_xyz(532e-9, white);
    // f w^2 / G = 16 pi^2 S_d; orders beyond |u| = 2 hold 2 lambda / (2 pi^2 a 2) of the light
    assert_near(sum * (4.0 / 1000) * (4.0 / 1000) * 16 * M_PI * M_PI, 3.0 / 8, 0.375 * 0.01);
    table_finish(&t);
}

// Listing 8-1 of G04, in its own words.
static void listing(double tangent_h, double normal_h, float r, float d, float out[3])
{
    float u = (float)tangent_h * d, w = (float)normal_h, e = r * u / w, c = expf(-e * e);
    if (u < 0)
        u = -u;
    for (int k = 0; k < 3; k++)
        out[k] = c;
    for (int n = 1; n < 8; n++) {
        const float y = 2 * u / (float)n - 1;
        const float x[3] = {4 * (y - 0.75f), 4 * (y - 0.5f), 4 * (y - 0.25f)};
        for (int k = 0; k < 3; k++)
            out[k] += fmaxf(1 - x[k] * x[k], 0);
    }
}

TEST(the_rainbow_is_the_listing)
{
    const struct rainbow r = {.spacing_m = 1.6e-6, .roughness = 5, .highlight = {1, 1, 1}};
    for (int k = -200; k <= 200; k++)
        for (double w = 0.2; w <= 2; w += 0.3) {
            float want[3];
            double got[3];
            listing(k / 100.0, w, 5, 1.6f, want);
            rainbow_rgb(&r, k / 100.0, w, got);
            for (int c = 0; c < 3; c++)
                assert_near(got[c], want[c], 2e-5); // float in the listing
        }
}

TEST(the_spectral_rainbow_has_the_observers_colours)
{
    struct spectrum light = light_of("E");
    const struct rainbow r = {.spacing_m = 1e-6};
    double xyz[3], a[3], b[3];
    rainbow_xyz(&r, &light, 0.55, 2, xyz); // 550 nm in the first order, 275 nm in the second
    cie_xyz(550e-9, a);
    for (int c = 0; c < 3; c++)
        assert_near(xyz[c], a[c], 1e-12);
    rainbow_xyz(&r, &light, -1.3, 2, xyz); // 650 nm in the second, 433 nm in the third
    cie_xyz(650e-9, a);
    cie_xyz(1300e-9 / 3, b);
    for (int c = 0; c < 3; c++)
        assert_near(xyz[c], a[c] + b[c], 1e-12);
    rainbow_xyz(&r, &light, 0, 2, xyz);
    assert_near(xyz[1], 0, 0);
    spectrum_finish(&light);
}

TEST(the_command_makes_masks_and_refuses_nonsense)
{
    enter_scratch("cmd_slits");
    struct image mask = {0};
    struct err e = {0};
    assert_true(image_init(&mask, 2, 1, 1, &e));
    mask.px[1] = 1; // 0 at u = -1 to 1 at u = 1
    assert_true(image_write(&mask, "mask.pfm", &e));
    image_finish(&mask);
    FILE *f = fopen("at.csv", "w");
    fputs("u,v\n0,0\n0.5,-1\n-0.5,1\n", f);
    fclose(f);
    assert_int_equal(run_nacre("slits --pitch 2um --width 0.5um --count 21 --size 5 --mask "
                               "mask.pfm -o lut.exr")
                         .status,
                     0);
    struct run r = run_nacre("eval lut.exr --points at.csv");
    double y[3];
    assert_int_equal(sscanf(r.out,
                            "u,v,w,X,Y,Z 0,0,2,%*f,%lf,%*f 0.5,-1,2,%*f,%lf,%*f "
                            "-0.5,1,2,%*f,%lf,%*f",
                            y, y + 1, y + 2),
                     3);
    assert_near(y[0], 0.5, 1e-6);
    assert_near(y[1] / y[2], 3, 1e-5); // 0.75 to 0.25
    static const struct {
        const char *words;
        int status;
        const char *message;
    } bad[] = {
        {"slits --pitch 2um -o no.exr", 2, "--width and --count are needed"},
        {"slits --pitch 0um --width 1um --count 3 -o no.exr", 3, "bad pitch"},
        {"slits --pitch 2um --width 3um --count 3 -o no.exr", 3, "bad slit width 3 um"},
        {"slits --pitch 2um --width 1um --count -3 -o no.exr", 3, "bad number of slits -3"},
        {"slits --pitch 2um --width 1um --count 3 --absolute -o no.exr", 3, "needs a row with"},
        {"slits --pitch 2um --width 1um --count 3 --window -1 -o no.exr", 3, "bad window -1"},
        {"slits --pitch 2um --width 1um --count 3 --mask none.png -o no.exr", 5, "none.png"},
        {"slits --pitch 2um --model g04 --w 3 -o no.exr", 3, "bad w 3"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        r = run_nacre(bad[k].words);
        if (r.status != bad[k].status || !strstr(r.err, bad[k].message))
            fail_msg("nacre %s: exit %d, said: %s", bad[k].words, r.status, r.err);
        assert_int_not_equal(access("no.exr", F_OK), 0);
    }
}

TEST_MAIN(cmocka_unit_test(slits_are_the_sum_of_their_waves),
          cmocka_unit_test(zeros_of_the_denominator_are_no_trouble),
          cmocka_unit_test(a_row_is_constant_across_and_a_radial_one_all_around),
          cmocka_unit_test(the_wavelength_step_resolves_the_lobes),
          cmocka_unit_test(an_absolute_row_reflects_width_over_pitch),
          cmocka_unit_test(the_rainbow_is_the_listing),
          cmocka_unit_test(the_spectral_rainbow_has_the_observers_colours),
          cmocka_unit_test(the_command_makes_masks_and_refuses_nonsense))
