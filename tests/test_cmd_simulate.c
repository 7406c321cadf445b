// test_cmd_simulate.c - nacre simulate: heights of any sample, and what is refused, as a user runs
// it.
#include "tests/test.h"

#include "core/hfield_file.h"
#include "core/outfile.h"
#include "tests/run.h"

static void put(const char *path, const char *text)
{
    struct err e = {0};
    if (!outfile_write(path, text, strlen(text), &e))
        fail_msg("%s", e.msg);
}

TEST(heights_of_a_blazed_grating_are_its_profile)
{
    enter_scratch("simulate_height");
    put("blazed.yaml", "sample:\n  kind: blazed\n  lines: 600/mm\n  blaze: 13deg\n  turn: 90deg\n");
    const struct run r =
        run_nacre("simulate blazed.yaml --what height --size 200 --pixel 50nm -o z.exr");
    assert_int_equal(r.status, 0);
    struct hfield hf;
    struct err e = {0};
    if (!hfield_read(&hf, "z.exr", NULL, &e))
        fail_msg("%s", e.msg);
    assert_int_equal(hf.nx, 200);
    assert_near(hf.dx_m, 50e-9, 1e-15);
    const double pitch_m = 1e-3 / 600, slope = tan(13 * M_PI / 180);
    int falls = 0;
    for (int j = 1; j < 200; j++) {
        const double rise = (double)hf.z[j * 200 + 7] - (double)hf.z[(j - 1) * 200 + 7];
        assert_near(hf.z[j * 200 + 7], hf.z[j * 200 + 190], 1e-12); // turned: lines along x
        if (rise * slope > 0 && fabs(rise) < 20e-9)
            assert_near(fabs(rise), 50e-9 * slope, 1e-12);
        else
            falls++;
    }
    assert_true(abs(falls - (int)(199 * 50e-9 / pitch_m)) <= 1);
    hfield_finish(&hf);
}

TEST(what_cannot_be_simulated_is_refused_by_its_line)
{
    enter_scratch("simulate_refused");
    static const struct {
        const char *text, *line;
    } cases[] = {
        {"sample:\n  kind: lcd\n  pitch: [-16um, 20um]\n",
         "a.yaml:3: -16um is out of range: must be 100 nm to 1 mm"},
        {"sample:\n  kind: height\n  file: one.pfm\n  pixel: 1um\n",
         "a.yaml:3: file: ./one.pfm: bad size 1 x 1: a height field has 2 to 65536 nodes a side"},
        {"name: r\ncamera: {uri: 'sim:'}\nfilters:\n  trigger: 'sim:'\n  list:\n"
         "  - {name: green, position: 0, throughput: 0}\n",
         "a.yaml:6: throughput: 0 is out of range: must be 1e-09 to 1"},
        {"name: r\ncamera: {uri: 'sim:'}\n"
         "lights:\n  trigger: 'sim:'\n  list:\n"
         "  - {name: l, line: 0, max_on: 1s, centre: 450nm, width: 20nm}\n"
         "filters:\n  trigger: 'sim:'\n  list:\n"
         "  - {name: green, position: 0, centre: 700nm, width: 10nm}\n",
         "a.yaml:10: light 'l', filter 'green' and the camera have no wavelength in common: no "
         "light gets through"},
        {"name: r\ncamera: {uri: 'v4l2:/dev/video0'}\n",
         "a.yaml: its camera 'v4l2:/dev/video0' is not simulated"},
    };
    put("one.pfm", "Pf\n1 1\n-1\n....");
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        put("a.yaml", cases[k].text);
        const struct run r = run_nacre("simulate a.yaml -o x.exr");
        char line[300];
        snprintf(line, sizeof line, "nacre: simulate: %s\n", cases[k].line);
        assert_string_equal(r.err, line);
        assert_int_equal(r.status, 3);
        assert_int_equal(access("x.exr", F_OK), -1);
    }
}

TEST_MAIN(cmocka_unit_test(heights_of_a_blazed_grating_are_its_profile),
          cmocka_unit_test(what_cannot_be_simulated_is_refused_by_its_line))
