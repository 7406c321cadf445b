// test_shooter.c - captures with a camera that rounds, lags, lies, loses, and what the ledger says.
#include "tests/test.h"

#include "acquire/shooter.h"
#include "core/outfile.h"
#include "tests/run.h"
#include "tests/toy_bench.h"

struct outcome {
    struct loop *loop;
    struct shooter *shooter;
    struct err how;
    bool ended;
    int pause_after;
    struct loop_source *timer;
};

static void ended(void *ctx, const struct err *how)
{
    struct outcome *o = ctx;
    o->how = *how;
    o->ended = true;
    loop_stop(o->loop);
}

static void kept(void *ctx, const struct session_frame *f, int done, int planned)
{
    struct outcome *o = ctx;
    (void)planned;
    (void)f;
    if (o->pause_after && done == o->pause_after)
        shooter_pause(o->shooter);
}

static void write_rig(const char *camera)
{
    char text[600];
    struct err e;
    snprintf(text, sizeof text,
             "name: toy\ncamera: {uri: 'toy:%s'}\n"
             "lights:\n  trigger: 'toy:'\n  list: [{name: led, line: 0, max_on: 1s}]\n",
             camera);
    assert_true(outfile_write("rig.yaml", text, strlen(text), &e));
}

static struct outcome capture(const char *camera, const char *plan, bool resume)
{
    struct outcome o = {.loop = loop_new()};
    struct err e = {0};
    if (!resume) {
        enter_scratch("shooter");
        assert_true(outfile_write("plan.yaml", plan, strlen(plan), &e));
    }
    write_rig(camera);
    const struct shooter_order order = {.rig = "rig.yaml",
                                        .plan = "plan.yaml",
                                        .session = "s",
                                        .resume = resume,
                                        .drivers = &toy_drivers,
                                        .kept = kept,
                                        .end = ended,
                                        .ctx = &o};
    o.shooter = shooter_new(o.loop, &order, &e);
    if (!o.shooter)
        fail_msg("%s", e.msg);
    if (!loop_run(o.loop, &e))
        fail_msg("%s", e.msg);
    shooter_free(o.shooter);
    loop_free(o.loop);
    assert_int_equal(toy_light, 0);
    return o;
}

static struct session_frame *frames(bool good, int *n)
{
    struct session *s;
    struct session_frame *f;
    struct err e = {0};
    if (!session_open(&s, "s", SESSION_READ, &e) || !session_frames(s, good, &f, n, &e))
        fail_msg("%s", e.msg);
    session_close(s);
    return f;
}

static int count(const char *verdict)
{
    int n, hits = 0;
    struct session_frame *f = frames(false, &n);
    for (int k = 0; k < n; k++)
        hits += !strcmp(f[k].verdict, verdict);
    free(f);
    return hits;
}

static int notes(const char *part)
{
    char line[300];
    snprintf(line, sizeof line, "strings -a s/ledger.db | grep -c '%s' > n", part);
    assert_true(system(line) >= 0);
    int n = 0;
    FILE *f = fopen("n", "r");
    assert_int_equal(fscanf(f, "%d", &n), 1);
    fclose(f);
    return n;
}

static const char plan[] = "name: p\nlights: [led]\nexposures: {first: 25us, last: 400us}\n"
                           "darks: 1\nretries: 3\n";

// Every frame that counts was really exposed as the ledger says: what the ramp's bright end shows.
static void exposures_are_true(int expected)
{
    int n;
    struct session_frame *f = frames(true, &n);
    assert_int_equal(n, expected);
    for (int k = 0; k < n; k++) {
        struct dng d;
        struct err e = {0};
        char path[100];
        double sum = 0;
        if (f[k].step.kind == SESSION_DARK)
            continue;
        snprintf(path, sizeof path, "s/%s", f[k].path);
        assert_true(dng_read(&d, path, &e));
        for (int j = 0; j < d.h; j++)
            sum += d.raw[j * d.w + 63];
        const double us = (sum / d.h - 64) / 8;
        assert_near(us, 1e6 * session_exposure_s(&f[k]), 0.5);
        dng_finish(&d);
    }
    free(f);
}

TEST(a_good_camera_needs_one_shot_a_step)
{
    const struct outcome o = capture("", plan, false);
    assert_int_equal(o.how.code, ERR_NONE);
    assert_int_equal(count("good"), 10);
    int n;
    struct session_frame *f = frames(false, &n);
    assert_int_equal(n, 10);
    for (int k = 1; k < 5; k++)
        assert_near((double)f[k].measured_ns * 1e-3, 25 << k, 0.02 * (25 << k));
    free(f);
    exposures_are_true(10);
}

TEST(a_camera_that_rounds_is_taken_at_its_word)
{
    const struct outcome o = capture("round=9us", plan, false);
    assert_int_equal(o.how.code, ERR_NONE); // 25 us become 27 us: within a sixth of a stop
    exposures_are_true(10);
    int n;
    struct session_frame *f = frames(true, &n);
    assert_true(f[0].reported_ns == 27000 && f[0].step.exposure_ns == 25000);
    free(f);
}

TEST(a_camera_that_is_a_frame_late_and_says_so_is_waited_for)
{
    const struct outcome o = capture("late=1", plan, false);
    assert_int_equal(o.how.code, ERR_NONE);
    exposures_are_true(10);
    assert_true(count("wrong-exposure") >= 2);
    assert_true(notes("applies settings late") >= 1);
}

TEST(a_camera_that_is_a_frame_late_and_denies_it_is_found_out_by_its_pixels)
{
    const struct outcome o = capture("late=1,lie=1", plan, false);
    if (o.how.code)
        fail_msg("%s", o.how.msg);
    exposures_are_true(10);
    assert_true(count("wrong-light") >= 2);
}

TEST(a_camera_that_ignores_settings_ends_as_partial)
{
    struct outcome o = capture("ignore=1", plan, false);
    assert_int_equal(o.how.code, ERR_PARTIAL);
    assert_non_null(strstr(o.how.msg, "wrong-exposure 4 times: the camera exposed for 77 us"));
    exposures_are_true(0);
    o = capture("ignore=1,lie=1", plan, false);
    assert_int_equal(o.how.code, ERR_PARTIAL);
    if (!strstr(o.how.msg, "wrong-light"))
        fail_msg("%s", o.how.msg);
}

TEST(damage_and_missing_light_are_shot_again)
{
    static const struct {
        const char *camera, *verdict;
    } faults[] = {{"damage=3", "damaged"}, {"dark=3", "wrong-light"}, {"dark=1", "wrong-light"}};
    for (size_t k = 0; k < 3; k++) {
        const struct outcome o = capture(faults[k].camera, plan, false);
        if (o.how.code)
            fail_msg("%s: %s", faults[k].camera, o.how.msg);
        assert_true(count(faults[k].verdict) >= 1);
        exposures_are_true(10);
    }
}

TEST(stale_frames_are_thrown_away)
{
    const struct outcome o = capture("stale=4", plan, false);
    assert_int_equal(o.how.code, ERR_NONE);
    assert_int_equal(notes("thrown away: made for another shot"), 1);
    exposures_are_true(10);
}

TEST(a_lost_frame_is_shot_again)
{
    const struct outcome o = capture("lose=2", plan, false); // waits 2 s for it
    assert_int_equal(o.how.code, ERR_NONE);
    assert_int_equal(notes("no frame for shot 2"), 1);
    exposures_are_true(10);
}

TEST(an_unplugged_camera_leaves_what_was_taken_and_resume_goes_on)
{
    struct outcome o = capture("gone=5", plan, false);
    assert_int_equal(o.how.code, ERR_PARTIAL);
    assert_non_null(strstr(o.how.msg, "of 10 frames are kept: camera toy: is gone"));
    const int before = count("good");
    assert_true(before >= 1 && before <= 4);
    // The session was begun with this very rig: the camera is back.
    write_rig("gone=5");
    o = capture("gone=5", plan, true); // and unplugged again later
    assert_true(count("good") > before);
    o = capture("gone=1", plan, false);
    assert_int_equal(o.how.code, ERR_DEVICE);
}

static void go_on(void *ctx)
{
    struct outcome *o = ctx;
    if (strcmp(shooter_state(o->shooter), "paused") != 0) { // a busy machine takes its time
        loop_arm(o->timer, clock_boot_ns() + 100000000);
        return;
    }
    assert_int_equal(toy_light, 0);
    o->pause_after = 0;
    shooter_continue(o->shooter);
}

TEST(pause_keeps_the_light_off_and_continue_completes)
{
    enter_scratch("shooter");
    struct err e = {0};
    struct outcome o = {.loop = loop_new(), .pause_after = 3};
    assert_true(outfile_write("plan.yaml", plan, strlen(plan), &e));
    write_rig("");
    const struct shooter_order order = {.rig = "rig.yaml",
                                        .plan = "plan.yaml",
                                        .session = "s",
                                        .drivers = &toy_drivers,
                                        .kept = kept,
                                        .end = ended,
                                        .ctx = &o};
    o.shooter = shooter_new(o.loop, &order, &e);
    assert_non_null(o.shooter);
    o.timer = loop_timer(o.loop, go_on, &o);
    loop_arm(o.timer, clock_boot_ns() + 300000000);
    assert_true(loop_run(o.loop, &e));
    assert_int_equal(o.how.code, ERR_NONE);
    shooter_free(o.shooter);
    loop_free(o.loop);
    exposures_are_true(10);
}

TEST_MAIN(cmocka_unit_test(a_good_camera_needs_one_shot_a_step),
          cmocka_unit_test(a_camera_that_rounds_is_taken_at_its_word),
          cmocka_unit_test(a_camera_that_is_a_frame_late_and_says_so_is_waited_for),
          cmocka_unit_test(a_camera_that_is_a_frame_late_and_denies_it_is_found_out_by_its_pixels),
          cmocka_unit_test(a_camera_that_ignores_settings_ends_as_partial),
          cmocka_unit_test(damage_and_missing_light_are_shot_again),
          cmocka_unit_test(stale_frames_are_thrown_away),
          cmocka_unit_test(a_lost_frame_is_shot_again),
          cmocka_unit_test(an_unplugged_camera_leaves_what_was_taken_and_resume_goes_on),
          cmocka_unit_test(pause_keeps_the_light_off_and_continue_completes))
