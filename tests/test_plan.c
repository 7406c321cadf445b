// test_plan.c - plan files, the steps they become, and what is refused before any light goes on.
#include "tests/test.h"

#include "acquire/plan.h"
#include "core/outfile.h"

static struct rig rig;
static const struct cam_caps caps = {.model = "toy",
                                     .w = 100,
                                     .h = 80,
                                     .bits = 12,
                                     .exposure_min_ns = 100000,
                                     .exposure_max_ns = 20000000000,
                                     .exposure_step_ns = 10000,
                                     .gain_min = 1,
                                     .gain_max = 4};
static const struct trig_caps lines = {.model = "lines", .lines = 2};
static const struct trig_caps wheel = {.model = "wheel", .positions = 5};

static int setup(void **state)
{
    (void)state;
    struct err e;
    return rig_open(&rig, SOURCE_DIR "/rigs/sim.yaml", &e) ? 0 : -1;
}
static int teardown(void **state)
{
    (void)state;
    rig_finish(&rig);
    return 0;
}

static bool open_text(struct plan *p, const char *text, struct err *e)
{
    assert_true(outfile_write("test_plan.yaml", text, strlen(text), e));
    const bool ok = plan_open(p, "test_plan.yaml", e);
    unlink("test_plan.yaml");
    return ok;
}

static struct plan opened(const char *text)
{
    struct plan p;
    struct err e = {0};
    if (!open_text(&p, text, &e))
        fail_msg("%s", e.msg);
    return p;
}

TEST(the_plans_that_ship_fit_the_default_rig)
{
    static const char *const names[] = {"bracket", "bokeh", "focus", "full"};
    struct cam_caps with_focus = caps;
    with_focus.focus_max_per_m = 20;
    for (size_t k = 0; k < 4; k++) {
        char path[300];
        struct plan p;
        struct plan_report r;
        struct err e = {0};
        snprintf(path, sizeof path, SOURCE_DIR "/rigs/plans/%s.yaml", names[k]);
        if (!plan_open(&p, path, &e) ||
            !plan_check(&p, &rig, &with_focus, &lines, &wheel, 1e12, &r, &e))
            fail_msg("%s", e.msg);
        assert_true(r.frames >= 9 && r.duration_s > 0 && r.bytes > r.frames * 16000);
        plan_finish(&p);
    }
}

TEST(groups_and_steps_come_in_the_documented_order)
{
    struct plan p = opened("name: p\nlights: [led]\nfilters: [red, blue]\nexposures: [1ms, 4ms]\n"
                           "repeats: 2\ndarks: 3\n");
    struct plan_group *g;
    const int n = plan_groups(&p, &rig, &g);
    assert_int_equal(n, 3);
    assert_int_equal(g[1].filter, rig_filter_index(&rig, "blue"));
    assert_int_equal(g[2].kind, SESSION_DARK);
    struct session_step *s;
    assert_int_equal(plan_steps(&p, &rig, &g[1], p.exposure_ns, 2, &caps, 4, &s), 4);
    assert_int_equal(s[3].index, 7);
    assert_int_equal(s[3].repeat, 1);
    assert_true(s[2].exposure_ns == 1000000 && s[3].exposure_ns == 4000000);
    assert_string_equal(s[0].filter, "blue");
    free(s);
    assert_int_equal(plan_steps(&p, &rig, &g[2], p.exposure_ns, 2, &caps, 8, &s), 6);
    assert_string_equal(s[0].light, "");
    free(s);
    free(g);
    plan_finish(&p);
}

TEST(a_range_counts_stops_and_includes_its_end)
{
    struct plan p = opened("name: p\nexposures: {first: 1ms, last: 64ms, step: 2}\n");
    assert_int_equal(p.n_exposures, 4);
    assert_true(p.exposure_ns[3] == 64000000);
    plan_finish(&p);
}

TEST(an_automatic_bracket_stops_at_what_camera_and_light_allow)
{
    struct plan p = opened("name: p\nlights: [led]\nexposures: {meter: 8ms, step: 1, span: 10}\n");
    int64_t ns[PLAN_MAX_EXPOSURES];
    const int n = plan_bracket(&p, &caps, &rig.light[0], 100000000, ns);
    assert_int_equal(n, 6); // 0.1 to 3.2 s; the LED may be on for 5 s
    assert_true(ns[5] == 3200000000);
    plan_finish(&p);
}

TEST(what_cannot_work_is_refused_with_the_reason)
{
    static const struct {
        const char *text, *msg;
    } bad[] = {
        {"lights: [lamp]\nexposures: [1ms]\n",
         "test_plan.yaml: light 'lamp' is not in " SOURCE_DIR "/rigs/sim.yaml; it has led"},
        {"filters: [pink]\nexposures: [1ms]\n",
         "test_plan.yaml: filter 'pink' is not in " SOURCE_DIR
         "/rigs/sim.yaml; it has red green blue open"},
        {"exposures: [10us]\n", "exposure 10 us: camera toy can do 100 us to 20 s"},
        {"lights: [led]\nexposures: [8s]\n",
         "exposure 8 s: light 'led' would be on for 8.001 s, its limit is 5 s"},
        {"exposures: [1ms]\ngain: 8\n", "gain 8: camera toy has 1 to 4"},
        {"exposures: [1ms]\nfocus: [2]\n",
         "focus 2 dioptres: camera toy has no focus drive: 0 to 0"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        char text[200];
        struct plan_report r;
        struct err e = {0};
        snprintf(text, sizeof text, "name: p\n%s", bad[k].text);
        struct plan p = opened(text);
        assert_false(plan_check(&p, &rig, &caps, &lines, &wheel, 1e12, &r, &e));
        assert_string_equal(e.msg, bad[k].msg);
        assert_int_equal(e.code, ERR_DATA);
        plan_finish(&p);
    }
    struct plan p = opened("name: p\nexposures: [1ms]\n");
    struct plan_report r;
    struct err e = {0};
    assert_false(plan_check(&p, &rig, &caps, &lines, &wheel, 1e6, &r, &e));
    assert_string_equal(e.msg, "1 frames need 64.02 MB, but only 1 MB are free");
    assert_int_equal(e.code, ERR_FILE);
    struct cam_caps other = caps;
    other.for_looking = true;
    assert_false(plan_check(&p, &rig, &other, &lines, &wheel, 1e12, &r, &e));
    assert_non_null(strstr(e.msg, "not to measure with"));
    other = caps;
    other.bits = 10;
    assert_false(plan_check(&p, &rig, &other, &lines, &wheel, 1e12, &r, &e));
    assert_non_null(strstr(e.msg, "says 12 bits, but camera toy has 10"));
    const struct trig_caps small = {.model = "small wheel", .positions = 2};
    assert_false(plan_check(&p, &rig, &caps, &lines, &small, 1e12, &r, &e));
    assert_non_null(strstr(e.msg, "filter 'blue' is at position 2, but small wheel has 2"));
    plan_finish(&p);
}

TEST(rounding_is_announced)
{
    struct plan p = opened("name: p\nexposures: [1.003ms, 2ms]\n");
    struct plan_report r;
    struct err e = {0};
    assert_true(plan_check(&p, &rig, &caps, &lines, &wheel, 1e12, &r, &e));
    assert_int_equal(r.n_rounded, 1);
    assert_true(r.rounded[0][0] == 1003000 && r.rounded[0][1] == 1000000);
    plan_finish(&p);
}

TEST(a_bad_file_is_refused_by_line)
{
    static const struct {
        const char *text, *msg;
    } bad[] = {
        {"name: p\n", "test_plan.yaml:1: needs the key 'exposures'"},
        {"name: p\nexposures: [2ms, 1ms]\n", "test_plan.yaml:2: exposures must rise"},
        {"name: p\nexposures: [-1ms]\n",
         "test_plan.yaml:2: -1ms is out of range: must be 1 us to 3600 s"},
        {"name: p\nexposures: {first: 2ms, last: 1ms}\n",
         "test_plan.yaml:2: exposures: last must not be shorter than first"},
        {"name: p\nexposures: 1ms\n", "test_plan.yaml:2: exposures: expected a list of times, or "
                                      "first, last and step, or meter, step and span"},
        {"name: p\nexposures: [1ms]\nlights: [a, a]\n", "test_plan.yaml:3: 'a' is given twice"},
        {"name: p\nexposures: [1ms]\nrepeat: 2\n",
         "test_plan.yaml:3: repeat: unknown key, did you mean 'repeats'?"},
        {"name: p\nexposures: [1ms]\nrepeats: 0\n",
         "test_plan.yaml:3: repeats: 0 is out of range: must be 1 to 1e+04"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        struct plan p;
        struct err e = {0};
        assert_false(open_text(&p, bad[k].text, &e));
        assert_string_equal(e.msg, bad[k].msg);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_plans_that_ship_fit_the_default_rig),
        cmocka_unit_test(groups_and_steps_come_in_the_documented_order),
        cmocka_unit_test(a_range_counts_stops_and_includes_its_end),
        cmocka_unit_test(an_automatic_bracket_stops_at_what_camera_and_light_allow),
        cmocka_unit_test(what_cannot_work_is_refused_with_the_reason),
        cmocka_unit_test(rounding_is_announced),
        cmocka_unit_test(a_bad_file_is_refused_by_line),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
