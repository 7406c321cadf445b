// test_rig.c - a rig file: what is read, what is refused, and the light that gets through.
#include "tests/test.h"

#include "core/rig.h"

static const char head[] = "name: r\ncamera: {uri: 'sim:', responsivity: 2e5}\n";

static bool open_text(struct rig *rig, const char *text, struct err *e)
{
    FILE *f = fopen("test_rig.yaml", "w");
    assert_non_null(f);
    fputs(text, f);
    fclose(f);
    const bool ok = rig_open(rig, "test_rig.yaml", e);
    unlink("test_rig.yaml");
    return ok;
}

TEST(the_default_rig_is_good)
{
    struct rig rig;
    struct err e = {0};
    if (!rig_open(&rig, SOURCE_DIR "/rigs/sim.yaml", &e))
        fail_msg("%s", e.msg);
    assert_true(rig.n_lights >= 1 && rig.n_filters >= 3);
    const int led = rig_light_index(&rig, "led"), red = rig_filter_index(&rig, "red");
    assert_near(rig_irradiance(&rig, led, red),
                rig.light[led].irradiance * rig.filter[red].throughput, 0);
    double centre, sigma;
    assert_true(rig_wavelength(&rig, led, red, &centre, &sigma, &e));
    assert_near(centre, rig.filter[red].band.centre_m, 2e-9); // the LED's slope pulls it a little
    char *uri = rig_uri(&rig, "sim:a=@run,b=@rig,@c", "x1");
    assert_string_equal(uri, "sim:a=x1,b=" SOURCE_DIR "/rigs/sim.yaml,@c");
    free(uri);
    rig_finish(&rig);
}

TEST(a_narrow_filter_on_a_sloping_source_shifts_the_centroid)
{
    // Product of two Gaussians: variances combine as 1/s = 1/s1 + 1/s2, means weighted by 1/s.
    struct rig rig;
    struct err e = {0};
    if (!open_text(&rig,
                   "name: r\ncamera: {uri: 'sim:'}\n"
                   "lights:\n  trigger: 'sim:'\n  list:\n"
                   "  - {name: l, line: 0, max_on: 1s, centre: 550nm, width: 100nm}\n"
                   "filters:\n  trigger: 'sim:'\n  list:\n"
                   "  - {name: f, position: 0, centre: 600nm, width: 40nm}\n",
                   &e))
        fail_msg("%s", e.msg);
    double centre, sigma;
    assert_true(rig_wavelength(&rig, 0, 0, &centre, &sigma, &e));
    const double p1 = 1 / pow(100e-9, 2), p2 = 1 / pow(40e-9, 2);
    assert_near(centre, (550e-9 * p1 + 600e-9 * p2) / (p1 + p2), 1e-13);
    assert_near(sigma, 1 / sqrt(p1 + p2) / (2 * sqrt(2 * log(2))), 1e-13);
    rig_finish(&rig);
}

TEST(refusals_name_the_line)
{
    static const struct {
        const char *rest, *msg;
    } bad[] = {
        {"lights: {trigger: 'sim:', list: []}\n",
         "test_rig.yaml:3: list: 0 entries: must be 1 to 32"},
        {"lights:\n  trigger: 'sim:'\n  list:\n  - {name: a, line: 0}\n",
         "test_rig.yaml:6: needs the key 'max_on'"},
        {"lights:\n  trigger: 'sim:'\n  list:\n  - {name: a, line: 0, max_on: 1s}\n"
         "  - {name: b, line: 0, max_on: 1s}\n",
         "test_rig.yaml:7: name 'b' or line 0 is already taken"},
        {"filters:\n  trigger: 'sim:'\n  list:\n  - {name: a, position: 0, csv: /etc/x.csv}\n",
         "test_rig.yaml:6: csv: must be a path below the rig's folder, so that a session can "
         "carry it along"},
        {"filters:\n  trigger: 'sim:'\n  list:\n  - {name: a, position: 0, centre: 500nm}\n",
         "test_rig.yaml:6: needs the key 'width'"},
        {"filters:\n  trigger: 'sim:'\n  list:\n  - {name: 'a/b', position: 0}\n",
         "test_rig.yaml:6: name: must be 1 to 40 letters, digits and . _ + -"},
        {"light: 3\n", "test_rig.yaml:3: light: unknown key, did you mean 'lights'?"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        char text[600];
        struct rig rig;
        struct err e = {0};
        snprintf(text, sizeof text, "%s%s", head, bad[k].rest);
        assert_false(open_text(&rig, text, &e));
        assert_string_equal(e.msg, bad[k].msg);
        assert_int_equal(e.code, ERR_DATA);
    }
}

TEST(a_filter_that_lets_nothing_through_is_refused_by_its_line)
{
    static const struct {
        const char *filter, *msg;
    } bad[] = {
        {"{name: f, position: 0, csv: test_rig_dark.csv}",
         "test_rig.yaml:10: 'test_rig_dark.csv' is 0 at every wavelength: no light gets through"},
        {"{name: f, position: 0, centre: 700nm, width: 10nm}",
         "test_rig.yaml:10: light 'l', filter 'f' and the camera have no wavelength in common: no "
         "light gets through"},
        {"{name: f, position: 0, throughput: 0}",
         "test_rig.yaml:10: throughput: 0 is out of range: must be 1e-09 to 1"},
    };
    FILE *f = fopen("test_rig_dark.csv", "w");
    fputs("nm,value\n400,0\n700,0\n", f);
    fclose(f);
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        char text[600];
        struct rig rig;
        struct err e = {0};
        double centre, sigma;
        snprintf(text, sizeof text,
                 "%slights:\n  trigger: 'sim:'\n  list:\n"
                 "  - {name: l, line: 0, max_on: 1s, centre: 450nm, width: 20nm}\n"
                 "filters:\n  trigger: 'sim:'\n  list:\n  - %s\n",
                 head, bad[k].filter);
        if (open_text(&rig, text, &e)) {
            assert_false(rig_wavelength(&rig, 0, 0, &centre, &sigma, &e));
            rig_finish(&rig);
        }
        assert_string_equal(e.msg, bad[k].msg);
        assert_int_equal(e.code, ERR_DATA);
    }
    unlink("test_rig_dark.csv");
}

TEST(a_copy_takes_its_spectra_along)
{
    char folder[] = "/tmp/nacre_test_XXXXXX", path[80], cmd[200];
    assert_non_null(mkdtemp(folder));
    snprintf(cmd, sizeof cmd, "mkdir -p %s/a/s %s/b", folder, folder);
    assert_int_equal(system(cmd), 0);
    snprintf(path, sizeof path, "%s/a/s/led.csv", folder);
    FILE *f = fopen(path, "w");
    fputs("nm,value\n500,1\n510,3\n", f);
    fclose(f);
    snprintf(path, sizeof path, "%s/a/my.yaml", folder);
    f = fopen(path, "w");
    fprintf(f,
            "%slights:\n  trigger: 'sim:'\n  list:\n"
            "  - {name: l, line: 0, max_on: 1s, csv: s/led.csv}\n",
            head);
    fclose(f);
    struct rig rig = {0};
    struct err e = {0};
    assert_true(rig_open(&rig, path, &e));
    snprintf(path, sizeof path, "%s/b", folder);
    if (!rig_copy(&rig, path, &e))
        fail_msg("%s", e.msg);
    rig_finish(&rig);
    snprintf(path, sizeof path, "%s/b/rig.yaml", folder);
    assert_true(rig_open(&rig, path, &e));
    double centre, sigma; // a ramp from 1 to 3: centroid (by the 1 nm sum) past the middle
    assert_true(rig_wavelength(&rig, 0, -1, &centre, &sigma, &e));
    assert_near(centre, 506e-9, 0.2e-9);
    rig_finish(&rig);
    snprintf(cmd, sizeof cmd, "rm -r %s", folder);
    assert_int_equal(system(cmd), 0);
}

TEST_MAIN(cmocka_unit_test(the_default_rig_is_good),
          cmocka_unit_test(a_narrow_filter_on_a_sloping_source_shifts_the_centroid),
          cmocka_unit_test(refusals_name_the_line),
          cmocka_unit_test(a_filter_that_lets_nothing_through_is_refused_by_its_line),
          cmocka_unit_test(a_copy_takes_its_spectra_along))
