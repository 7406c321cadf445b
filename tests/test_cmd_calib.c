// test_cmd_calib.c - nacre calib at the command line: closed loops, records that do not fit, and
// what is refused.
#include "tests/test.h"

#include "core/imgfile.h"
#include "tests/noise.h"
#include "tests/run.h"

static void write_text(const char *path, const char *text)
{
    FILE *f = fopen(path, "w");
    fputs(text, f);
    fclose(f);
}

static double said(const struct run *r, const char *key)
{
    char line[80];
    snprintf(line, sizeof line, "\n%s ", key);
    const char *at = strstr(r->out, line);
    return at ? strtod(at + strlen(line), NULL) : NAN;
}

static void refused(const char *words, int status, const char *sentence)
{
    assert_refuses(words, status, sentence);
    assert_int_not_equal(access("out.yaml", F_OK), 0);
}

TEST(the_help_of_a_verb_is_of_it_alone)
{
    enter_scratch("calib_help");
    const struct run all = run_nacre("calib --help"), lens = run_nacre("calib lens --help");
    assert_int_equal(all.status, 0);
    assert_non_null(strstr(all.out, "\n  lens "));
    assert_null(strstr(all.out, "--board COLS"));
    assert_non_null(strstr(lens.out, "usage: nacre calib lens IMAGE... [options]"));
    assert_non_null(strstr(lens.out, "--board COLS"));
    assert_null(strstr(lens.out, "--blaze"));
    assert_non_null(strstr(lens.out, "nacre calib lens board*.png"));
}

TEST(a_simulated_sensor_is_found_as_it_was_made)
{
    enter_scratch("calib_sensor");
    write_text("scene.yaml", "sample:\n  kind: lcd\n  pitch: 25um\n"
                             "view:\n  width: 320\n  height: 240\n  h-per-pixel: 2.5e-3\n");
    write_text("plan.yaml",
               "name: test\nlights: [led]\nfilters: [open]\n"
               "exposures: {first: 0.5ms, last: 128ms, step: 2}\nrepeats: 4\ndarks: 4\n");
    assert_int_equal(
        system("sed 's|samples/lcd.yaml|scene.yaml|' " SOURCE_DIR "/rigs/sim.yaml > rig.yaml"), 0);
    do_run("capture --rig rig.yaml --plan plan.yaml -o session");

    struct run r = do_run("calib dark session -o dark.exr");
    assert_near(said(&r, "black"), 256, 0.5);
    assert_near(said(&r, "read_noise"), sqrt(1 + 1 / 12.), 0.03); // 2.5 electrons, 2.5 to a count
    assert_near(said(&r, "dark_rate_per_s"), 4 / 2.5, 0.3);
    r = do_run("calib noise session --dark dark.exr -o noise.yaml");
    assert_near(said(&r, "gain"), 1 / 2.5, 0.01 / 2.5);
    assert_near(said(&r, "read"), sqrt(1 + 1 / 12.), 0.03);
    r = do_run("calib response session -o linearity.yaml");
    assert_near(said(&r, "worst"), 0, 5e-4);
    do_run("hdr session --dark dark.exr --noise noise.yaml -o merged.exr");

    // the same records on another camera, size, gain
    assert_int_equal(system("sed -i 's/^device:.*/device: \"Another\"/' noise.yaml"), 0);
    refused("hdr session --noise noise.yaml -o out.yaml", 3,
            "noise.yaml: made with camera 'Another'");
    assert_int_equal(system("sed -i '/^device:/d; s/^iso:.*/iso: 800/' noise.yaml"), 0);
    refused("hdr session --noise noise.yaml -o out.yaml", 3,
            "noise.yaml: made with ISO 800, but this is 100");
    assert_int_equal(system("sed -i '/^iso:/d; s/^date:.*/date: \"2020-02-01\"/' noise.yaml"), 0);
    refused("hdr session --noise noise.yaml -o out.yaml", 3,
            "noise.yaml: made on 2020-02-01 and valid for 365 days, but this is of 20");
    assert_int_equal(system("sed -i '/^valid_days:/d' noise.yaml"), 0);
    do_run("hdr session --noise noise.yaml -o merged.exr");
    write_text("scene.yaml", "sample:\n  kind: lcd\n  pitch: 25um\n"
                             "view:\n  width: 120\n  height: 90\n  h-per-pixel: 5e-3\n");
    write_text("plan.yaml", "name: test\nlights: [led]\nfilters: [open]\n"
                            "exposures: {first: 0.5ms, last: 8ms, step: 2}\n");
    do_run("capture --rig rig.yaml --plan plan.yaml -o small");
    refused("hdr small --dark dark.exr -o out.yaml", 3,
            "dark.exr: made at 320 x 240 pixels, but this is 120 x 90");
    refused("hdr small --noise dark.exr -o out.yaml", 3, "dark.exr");
    refused("calib dark small -o out.yaml", 3, "fewer than two good dark frames");
    refused("calib noise small -o out.yaml", 3, "no two frames have the same exposure");
}

TEST(a_real_response_is_monotone_and_its_halves_agree)
{
    char words[2048];
    const char *dir = shared_or_skip("data/brackets/canon5d");
    double half[2][256];
    enter_scratch("calib_response");
    for (int k = 0; k < 2; k++) {
        snprintf(words, sizeof words, "calib response $(ls %s/*.jpg | awk 'NR%%2==%d') -o r%d.yaml",
                 dir, k, k);
        do_run(words);
        char path[32], line[8192];
        snprintf(path, sizeof path, "r%d.yaml", k);
        FILE *f = fopen(path, "r");
        while (fgets(line, sizeof line, f) && strncmp(line, "log_x_1: [", 10))
            ;
        const char *at = line + 10;
        for (int z = 0; z < 256; z++) {
            char *end;
            half[k][z] = strtod(at, &end);
            while (*end == ',' || *end == ' ')
                end++;
            at = end;
            if (*at == '\n' && fgets(line, sizeof line, f))
                at = line;
        }
        fclose(f);
        for (int z = 1; z < 256; z++)
            assert_true(half[k][z] >= half[k][z - 1]);
    }
    for (int z = 16; z < 240; z++) // neither nearly black nor nearly saturated
        assert_near(half[0][z], half[1][z], 0.02);
}

TEST(what_cannot_be_calibrated_is_refused)
{
    enter_scratch("calib_bad");
    refused("calib -o out.yaml", 2, "VERB");
    refused("calib colour x.png -o out.yaml", 2, "'colour' is not one of");
    refused("calib dark -o out.yaml", 2, "needs a file to work on");
    refused("calib dark x.png --board 9x6 -o out.yaml", 2,
            "--board is not an option of dark; see nacre calib dark --help");
    refused("calib bokeh absent.png --lines 600/mm --blaze 13deg -o out.yaml", 5, "absent.png");
    refused("calib bokeh absent.png -o out.yaml", 2, "--lines 600/mm --blaze 13deg");
    refused("calib bokeh absent.png --lines 600/mm --blaze 100deg -o out.yaml", 3, "--blaze");
    refused("calib bokeh absent.png --lines 600/mm --blaze 13deg --turn up -o out.yaml", 2,
            "--turn");
    refused("calib flat absent.exr -o out.yaml", 5, "absent.exr");

    // what no bracket is: frames of noise, one picture said to be three exposures, a white dark
    // frame
    uint64_t seed = 5;
    for (int k = 0; k < 5; k++) {
        char name[20];
        struct image im;
        struct err e;
        assert_true(image_init(&im, 64, 48, 1, &e));
        for (int i = 0; i < 64 * 48; i++)
            im.px[i] = (float)(k < 4 ? noise_uniform(&seed) : 1);
        snprintf(name, sizeof name, "%d.png", k);
        assert_true(image_write(&im, name, &e));
        image_finish(&im);
    }
    refused("calib response 0.png 1.png 2.png 3.png --times 1,2,4,8 -o out.yaml", 3,
            "the frames follow no curve");
    refused("calib response 0.png 1.png 2.png --times 1,2,4 --method robertson -o out.yaml", 3,
            "the frames follow no curve");
    refused("hdr 0.png 1.png 2.png --times 1,2,4 -o out.yaml", 3, "the frames follow no curve");
    refused("hdr 0.png 0.png 0.png --times 1,2,4 --linear -o out.yaml", 3,
            "0.png: shows 0.50 times the light of 0.png at the same place");
    refused("calib dark 4.png 4.png --times 1,2 -o out.yaml", 3, "8-bit pictures carry a curve");
}

TEST(the_reference_grating_is_measured)
{
    char words[1200];
    enter_scratch("calib_bokeh");
    snprintf(words, sizeof words, "calib bokeh %s --lines 600/mm --blaze 13deg -o bokeh.yaml",
             shared_or_skip("reference/bokeh/grating.png"));
    const struct run r = do_run(words);
    assert_near(said(&r, "um_per_px") / 0.07692855304, 1, 5e-3);
    assert_near(said(&r, "turn_deg"), 90, 0.2);
    assert_near(said(&r, "psf_sigma_px") / 1.874, 1, 0.02);
    assert_true(said(&r, "rmse") < 0.0583);
    snprintf(words, sizeof words, "bokeh %s --calibration bokeh.yaml -o height.gsf",
             shared_or_skip("reference/bokeh/sample.png"));
    const struct run h = do_run(words);
    assert_near(said(&h, "height_sd_m") / 0.13573540e-6, 1, 0.06);
    snprintf(words, sizeof words, "calib bokeh %s --lines 600/mm --blaze 13deg -o out.yaml",
             shared_or_skip("reference/bokeh/sample.png"));
    const struct run s = run_nacre(words); // two directions of lines: not a grating
    assert_int_equal(s.status, 3);
}

TEST_MAIN(cmocka_unit_test(the_help_of_a_verb_is_of_it_alone),
          cmocka_unit_test(a_simulated_sensor_is_found_as_it_was_made),
          cmocka_unit_test(a_real_response_is_monotone_and_its_halves_agree),
          cmocka_unit_test(what_cannot_be_calibrated_is_refused),
          cmocka_unit_test(the_reference_grating_is_measured))
