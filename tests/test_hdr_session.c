// test_hdr_session.c - closed loop: a simulated sample is captured, merged, and compared with the
// light that the simulator made it from.
#include "tests/test.h"

#include "core/imgfile.h"
#include "tests/run.h"

static const char scene[] = "sample:\n  kind: lcd\n  pitch: 25um\n"
                            "view:\n  width: 240\n  height: 200\n  h-per-pixel: 3e-3\n";
static const char plan[] = "name: test\nlights: [led]\nfilters: [red, green]\n"
                           "exposures: {first: 0.5ms, last: 128ms, step: 2}\ndarks: 4\n";

static void write_text(const char *path, const char *text)
{
    FILE *f = fopen(path, "w");
    fputs(text, f);
    fclose(f);
}

static void capture(void)
{
    enter_scratch("hdr_session");
    write_text("scene.yaml", scene);
    write_text("plan.yaml", plan);
    assert_int_equal(
        system("sed 's|samples/lcd.yaml|scene.yaml|' " SOURCE_DIR "/rigs/sim.yaml > rig.yaml"), 0);
    do_run("capture --rig rig.yaml --plan plan.yaml -o session");
}

// For truth in [lo, hi): mean relative error, its standard error, and the mean squared error over
// the variance.
static void compare(const struct image *m, const struct image *t, double e, double lo, double hi,
                    double *bias, double *sigma, double *chi2)
{
    double sum = 0, squares = 0, variance = 0;
    long n = 0;
    for (int k = 0; k < m->w * m->h; k++) {
        const double truth = (double)t->px[k * t->nc] / e, v = (double)m->px[3 * k];
        if (truth < lo || truth >= hi || !(m->px[3 * k + 2] > 0))
            continue;
        sum += v / truth - 1;
        squares += (v - truth) * (v - truth) / (double)m->px[3 * k + 1];
        variance += (double)m->px[3 * k + 1] / (truth * truth);
        n++;
    }
    assert_true(n > 100);
    *bias = sum / (double)n;
    *sigma = sqrt(variance) / (double)n;
    *chi2 = squares / (double)n;
}

TEST(a_merged_session_is_the_simulators_light_over_the_irradiance)
{
    struct image m, t;
    struct err e = {0};
    double bias, sigma, chi2;
    capture();
    do_run("hdr session --filter green -o merged.exr");
    do_run("simulate rig.yaml --what pattern --filter green -o truth.exr");
    if (!image_read(&m, "merged.exr", &e) || !image_read(&t, "truth.exr", &e))
        fail_msg("%s", e.msg);
    assert_string_equal(meta_text(&m.meta, "nacre.unit"), "1/sr");
    const double irradiance = 10 * 0.05; // of rigs/sim.yaml
    for (int stop = -6; stop < 2; stop += 2) {
        compare(&m, &t, irradiance, exp2(stop), exp2(stop + 2), &bias, &sigma, &chi2);
        assert_near(bias, 0, 2e-3 + 3 * sigma); // the scales have some 0.1 %
        assert_near(chi2, 1.05, 0.25);          // the sensor's PRNU is no noise of a merge
    }
    compare(&m, &t, irradiance, 1e-9, exp2(-10), &bias, &sigma, &chi2);
    assert_near(chi2, 1.1, 0.3); // dark current and offsets are gone
    double lambda_m = 0;
    assert_true(meta_num(&m.meta, "nacre.lambda_m", &lambda_m));
    assert_near(lambda_m, 530e-9, 1e-9);
    image_finish(&m);
    image_finish(&t);
}

TEST(a_session_of_several_brackets_asks_which)
{
    capture();
    const struct run r = run_nacre("hdr session -o merged.exr");
    assert_int_equal(r.status, 3);
    assert_non_null(strstr(r.err, "holds 2 brackets: choose by --group, --filter or --light: "
                                  "0 (light led, filter red), 1 (light led, filter green)"));
    assert_int_equal(run_nacre("hdr session --filter blue -o merged.exr").status, 3);
    assert_int_equal(run_nacre("hdr session session -o merged.exr").status, 2);
    assert_int_not_equal(access("merged.exr", F_OK), 0);
}

TEST_MAIN(cmocka_unit_test(a_merged_session_is_the_simulators_light_over_the_irradiance),
          cmocka_unit_test(a_session_of_several_brackets_asks_which))
