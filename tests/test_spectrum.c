// test_spectrum.c - the embedded CIE tables, illuminants, white points, spectra from CSV.
#include "core/spectrum.h"
#include "tests/test.h"

TEST(embedded_observer_is_the_source_file)
{
    FILE *f = fopen(shared_or_skip("data/cie1931_2deg_5nm.csv"), "r");
    char row[200];
    int compared = 0;
    double nm, x, y, z;
    while (fgets(row, sizeof row, f))
        if (sscanf(row, "%lf,%lf,%lf,%lf", &nm, &x, &y, &z) == 4 && nm >= CIE_FIRST_NM &&
            nm <= CIE_LAST_NM) {
            double xyz[3];
            cie_xyz(nm * 1e-9, xyz);
            assert_near(xyz[0], x, 1e-9);
            assert_near(xyz[1], y, 1e-9);
            assert_near(xyz[2], z, 1e-9);
            compared++;
        }
    fclose(f);
    assert_int_equal(compared, 81);
}

TEST(embedded_illuminants_are_the_source_files)
{
    static const char *const names[] = {"A", "D50", "D65", "F1", "F2", "F11"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        char path[100];
        snprintf(path, sizeof path, "data/illuminant_%s.csv", names[k]);
        struct spectrum ours = {0}, theirs = {0};
        struct err e = {0};
        assert_true(illuminant_get(&ours, names[k], &e));
        if (!spectrum_read_csv(&theirs, shared_or_skip(path), &e))
            fail_msg("%s", e.msg);
        for (int nm = 380; nm <= 780; nm += 5)
            assert_near(spectrum_at(&ours, nm * 1e-9), spectrum_at(&theirs, nm * 1e-9), 1e-9);
        spectrum_finish(&ours);
        spectrum_finish(&theirs);
    }
}

TEST(white_points_are_those_of_the_cie)
{
    // E, A, F1 from docs/optics.md; D65 and D50 from CIE 15. F1 is tabulated to few digits.
    static const struct {
        const char *name;
        double x, y, tol;
    } white[] = {
        {"E", 0.3333, 0.3334, 2e-4},   {"A", 0.4476, 0.4074, 2e-4},   {"F1", 0.3131, 0.3371, 3e-4},
        {"D65", 0.3127, 0.3290, 2e-4}, {"D50", 0.3457, 0.3585, 2e-4},
    };
    for (size_t k = 0; k < sizeof white / sizeof *white; k++) {
        struct spectrum s = {0};
        struct err e = {0};
        assert_true(illuminant_get(&s, white[k].name, &e));
        double sum[3] = {0};
        for (int nm = 380; nm <= 780; nm += 5) {
            double xyz[3];
            cie_xyz(nm * 1e-9, xyz);
            for (int c = 0; c < 3; c++)
                sum[c] += xyz[c] * spectrum_at(&s, nm * 1e-9);
        }
        const double all = sum[0] + sum[1] + sum[2];
        assert_near(sum[0] / all, white[k].x, white[k].tol);
        assert_near(sum[1] / all, white[k].y, white[k].tol);
        spectrum_finish(&s);
    }
}

TEST(scale_makes_the_luminance_integral_one)
{
    static const char *const names[] = {"E", "A", "F11", "inverse-A"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        struct spectrum s = {0};
        struct err e = {0};
        assert_true(illuminant_get(&s, names[k], &e));
        const double scale = illuminant_scale(&s), step = 1e-11;
        double sum = 0;
        for (double l = 380e-9 + step / 2; l < 780e-9;
             l += step) { // the midpoint rule, 40,000 steps
            double xyz[3];
            cie_xyz(l, xyz);
            sum += step * xyz[1] * spectrum_at(&s, l);
        }
        assert_near(scale * sum, 1, 1e-6);
        spectrum_finish(&s);
    }
}

TEST(bad_spectra_are_refused_with_file_and_line)
{
    static const struct {
        const char *text, *msg;
    } bad[] = {
        {"nm,power\n400,1\n390,1\n", "bad.csv:3: wavelengths must rise, 390 nm follows 400 nm"},
        {"400,1\n410\n", "bad.csv:2: expected two finite numbers 'nm,power'"},
        {"400,1\n410,-1\n", "bad.csv:2: negative power -1"},
        {"400,nan\n", "bad.csv:1: expected two finite numbers 'nm,power'"},
        {"4e-7,1\n", "bad.csv:1: wavelength 4e-07 is not in nanometres (1 to 1e5)"},
        {"400,1\n", "bad.csv: a spectrum needs two rows 'nm,power', found 1"},
        {"400,1\n405,1\n410,1\n420,1\n425,1\n",
         "bad.csv: rows missing between 410 and 420 nm (steps are 5 nm)"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        FILE *f = fopen("bad.csv", "w");
        fputs(bad[k].text, f);
        fclose(f);
        struct spectrum s = {0};
        struct err e = {0};
        assert_false(spectrum_read_csv(&s, "bad.csv", &e));
        assert_string_equal(e.msg, bad[k].msg);
        assert_int_equal(e.code, ERR_DATA);
    }
    remove("bad.csv");
    struct spectrum s = {0};
    struct err e = {0};
    assert_false(illuminant_get(&s, "D66", &e));
    assert_string_equal(
        e.msg,
        "unknown illuminant 'D66': use one of E A D50 D65 F1 F2 F11 inverse-A, or a CSV file");
    assert_false(illuminant_get(&s, "absent.csv", &e));
    assert_int_equal(e.code, ERR_FILE);
}

TEST(rgb_and_xyz_are_inverses)
{
    const double rgb[3] = {0.2, -0.3, 1.7};
    double xyz[3], back[3];
    rgb_to_xyz(rgb, xyz);
    xyz_to_rgb(xyz, back);
    for (int c = 0; c < 3; c++)
        assert_near(back[c], rgb[c], 1e-14);
    for (double x = 0; x <= 1; x += 0.01)
        assert_near(srgb_decode(srgb_encode(x)), x, 1e-6);
}

TEST_MAIN(cmocka_unit_test(embedded_observer_is_the_source_file),
          cmocka_unit_test(embedded_illuminants_are_the_source_files),
          cmocka_unit_test(white_points_are_those_of_the_cie),
          cmocka_unit_test(scale_makes_the_luminance_integral_one),
          cmocka_unit_test(bad_spectra_are_refused_with_file_and_line),
          cmocka_unit_test(rgb_and_xyz_are_inverses))
