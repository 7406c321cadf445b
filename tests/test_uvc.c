// test_uvc.c - v4l2: on a USB camera under the kernel's driver of such cameras, whose exposure and
// gain are real and which writes into its first two pixels what it used. Needs TEST_UVC, a command
// that acts the camera until it is killed; tests/vm has it. Everywhere else it is skipped.
#include "tests/test.h"

#include "acquire/clock.h"
#include "acquire/hardware.h"
#include "acquire/shooter.h"
#include "core/outfile.h"
#include "tests/run.h"
#include <poll.h>
#include <signal.h>

static const char node[] = "/dev/video0", options[] = ",bits=12,black=64,unity=16";
static const double UNIT_NS = 1e5, UNITY = 16; // of the camera's controls
static const struct cam_driver *const cams[] = {&v4l2_cam, NULL};
static const struct trig_driver *const trigs[] = {NULL};
static const struct drivers drivers = {cams, trigs, false};
static pid_t camera;

static void await_node(bool there)
{
    for (int k = 0; k < 300 && (access(node, R_OK | W_OK) == 0) != there; k++)
        usleep(100000);
    if ((access(node, R_OK | W_OK) == 0) != there)
        fail_msg("%s has not %s", node, there ? "come" : "gone");
}

static void plug_in(const char *flaws)
{
    char line[300];
    const char *command = getenv("TEST_UVC");
    if (!command) {
        print_message("skipped: no TEST_UVC in the environment\n");
        skip();
    }
    snprintf(line, sizeof line, "exec %s %s", command, flaws);
    if (!(camera = fork()))
        execl("/bin/sh", "sh", "-c", line, (char *)NULL);
    await_node(true);
}

static int unplug(void **state)
{
    (void)state;
    if (camera > 0) {
        kill(camera, SIGKILL);
        waitpid(camera, NULL, 0);
        camera = 0;
        await_node(false);
    }
    return 0;
}

// --- the camera alone ---

struct seen {
    int n;
    double truth_ns, truth_gain, reported_ns, reported_gain, light; // of the last frame
    int64_t start_ns, came_ns;                                      // CLOCK_MONOTONIC
};

static int64_t mono_ns(void)
{
    return clock_boot_ns() - clock_mono_to_boot_ns();
}

static void on_frame(void *ctx, const struct cam_frame *f)
{
    struct seen *s = ctx;
    double sum = 0;
    for (int k = 2; k < f->w * f->h; k++)
        sum += f->raw[k] - 64.;
    *s = (struct seen){.n = s->n + 1,
                       .truth_ns = UNIT_NS * f->raw[0],
                       .truth_gain = f->raw[1] / UNITY,
                       .reported_ns = (double)f->exposure_ns,
                       .reported_gain = f->gain,
                       .light = sum / f->w / f->h,
                       .start_ns = f->device_ns,
                       .came_ns = mono_ns()};
}

static struct cam *open_cam(struct seen *s)
{
    char uri[100];
    struct err e = {0};
    snprintf(uri, sizeof uri, "v4l2:%s%s", node, options);
    *s = (struct seen){0};
    struct cam *cam = cam_open(cams, uri, on_frame, s, &e);
    if (!cam)
        fail_msg("%s: %s", uri, e.msg);
    return cam;
}

static bool shoot(struct cam *cam, struct seen *s, double exposure_ns, double gain, struct err *e)
{
    static uint64_t id;
    const struct cam_shot shot = {++id, llround(exposure_ns), gain, NAN};
    const int n = s->n;
    const int64_t until = clock_boot_ns() + INT64_C(10000000000);
    if (!cam_shoot(cam, &shot, e))
        return false;
    while (s->n == n && clock_boot_ns() < until) {
        struct pollfd p = {cam->fd, POLLIN, 0};
        if (poll(&p, 1, 100) == 1 && !cam_pump(cam, e))
            return false;
    }
    return s->n > n || err_set(e, ERR_DEVICE, "no frame");
}

TEST(exposure_and_gain_reach_the_picture_and_frames_say_so)
{
    static const struct {
        double ms, gain;
    } shots[] = {{2, 1}, {4, 1}, {20, 1}, {4, 4}, {1, 16}, {50, 1}, {2, 1}};
    struct seen s;
    struct err e = {0};
    double per_ns = 0;
    plug_in("");
    struct cam *cam = open_cam(&s);
    assert_int_equal(cam->caps.exposure_min_ns, 100000);
    assert_int_equal(cam->caps.exposure_max_ns, 50000000); // from frame to frame
    for (size_t k = 0; k < sizeof shots / sizeof *shots; k++) {
        do
            if (!shoot(cam, &s, 1e6 * shots[k].ms, shots[k].gain, &e))
                fail_msg("shot %zu: %s", k, e.msg);
        while (s.reported_ns == 0);
        assert_near(s.reported_ns, 1e6 * shots[k].ms, 1);
        assert_near(s.truth_ns, 1e6 * shots[k].ms, 1);
        assert_near(s.reported_gain, shots[k].gain, 1e-9);
        assert_near(s.truth_gain, shots[k].gain, 1e-9);
        const double light = s.light / (s.truth_ns * s.truth_gain);
        per_ns = k ? per_ns : light;
        assert_near(light / per_ns, 1, s.truth_ns > 3e7 ? 0.2 : 0.03); // the longest saturates
    }
    cam_close(cam);
}

// The kernel stamps a USB camera's frame when its first bytes arrive: its exposure is over by then.
TEST(an_exposure_has_begun_before_its_frame_arrives)
{
    struct seen s;
    struct err e = {0};
    plug_in("");
    struct cam *cam = open_cam(&s);
    for (int k = 0; k < 8; k++) {
        if (!shoot(cam, &s, 40e6, 1, &e))
            fail_msg("%s", e.msg);
        assert_true(s.start_ns + 40000000 <= s.came_ns);
    }
    cam_close(cam);
}

TEST(a_camera_that_is_unplugged_is_gone_and_comes_back)
{
    struct seen s;
    struct err e = {0};
    plug_in("");
    struct cam *cam = open_cam(&s);
    assert_true(shoot(cam, &s, 1e7, 1, &e));
    const int64_t from = clock_boot_ns();
    kill(camera, SIGKILL);
    while (shoot(cam, &s, 1e7, 1, &e))
        assert_true(clock_boot_ns() - from < INT64_C(5000000000));
    assert_int_equal(e.code, ERR_DEVICE);
    assert_non_null(strstr(e.msg, "unplugged?"));
    print_message("unplugged: after %.0f ms: %s\n", 1e-6 * (double)(clock_boot_ns() - from), e.msg);
    cam_close(cam);
    unplug(NULL);
    plug_in("");
    cam = open_cam(&s);
    assert_true(shoot(cam, &s, 1e7, 1, &e));
    cam_close(cam);
}

// --- captures ---

struct capture {
    struct loop *loop;
    struct err how;
    int unplug_after;
};

static void ended(void *ctx, const struct err *how)
{
    struct capture *c = ctx;
    c->how = *how;
    loop_stop(c->loop);
}

static void kept(void *ctx, const struct session_frame *f, int done, int planned)
{
    const struct capture *c = ctx;
    (void)f;
    (void)planned;
    if (done == c->unplug_after)
        kill(camera, SIGKILL);
}

static struct err take_bracket(bool resume, int unplug_after)
{
    static const char plan[] = "name: p\nexposures: {first: 5ms, last: 40ms}\nretries: 3\n";
    char rig[200];
    struct err e = {0};
    struct capture c = {.loop = loop_new(), .unplug_after = unplug_after};
    const struct shooter_order order = {.rig = "rig.yaml",
                                        .plan = "plan.yaml",
                                        .session = "s",
                                        .resume = resume,
                                        .drivers = &drivers,
                                        .kept = kept,
                                        .end = ended,
                                        .ctx = &c};
    snprintf(rig, sizeof rig, "name: r\ncamera: {uri: 'v4l2:%s%s'}\n", node, options);
    assert_true(outfile_write("rig.yaml", rig, strlen(rig), &e));
    assert_true(outfile_write("plan.yaml", plan, strlen(plan), &e));
    struct shooter *s = shooter_new(c.loop, &order, &e);
    if (!s || !loop_run(c.loop, &e))
        fail_msg("%s", e.msg);
    shooter_free(s);
    loop_free(c.loop);
    return c.how;
}

// Every frame that counts was exposed as the ledger says, by what the camera wrote into it; so was
// one that does not count because the camera said that it was exposed otherwise.
// Returns how many there are; `others` says how many do not count, and why the last of them.
static int true_frames(const char *flaws, int *others, struct session_frame *last)
{
    struct session *s;
    struct session_frame *f;
    struct err e = {0};
    int n, good = 0;
    if (!session_open(&s, "s", SESSION_READ, &e) || !session_frames(s, false, &f, &n, &e))
        fail_msg("%s", e.msg);
    session_close(s);
    *others = 0;
    for (int k = 0; k < n; k++) {
        struct dng d;
        char path[100];
        const bool counts = !strcmp(f[k].verdict, "good");
        good += counts;
        *others += !counts;
        if (!counts)
            *last = f[k];
        if (!counts && strcmp(f[k].verdict, "wrong-exposure") != 0)
            continue;
        snprintf(path, sizeof path, "s/%s", f[k].path);
        if (!dng_read(&d, path, &e))
            fail_msg("%s", e.msg);
        const double said = session_exposure_s(&f[k]), truth = 1e-9 * UNIT_NS * d.raw[0];
        dng_finish(&d);
        if (fabs(truth / said - 1) > 0.1)
            fail_msg("a camera with '%s': the ledger has %s, %s, %g s; the camera %g s", flaws,
                     f[k].path, f[k].verdict, said, truth);
    }
    free(f);
    return good;
}

TEST(what_a_camera_makes_of_its_settings_is_what_the_ledger_says)
{
    static const struct {
        const char *flaws, *verdict; // of those that do not count
        int least, most;             // frames of 4 that count
    } cameras[] = {
        {"", NULL, 4, 4},
        {"step=9", NULL, 4, 4},                // 5.4, 9.9, 19.8, 39.6 ms are what the plan becomes
        {"rounds=40", "wrong-exposure", 0, 2}, // to 4, 12, 20, 40 ms
        {"hides=40", "wrong-light", 0, 2},
        {"late=2", NULL, 4, 4}, // within what is thrown away after a change
        {"late=6", "wrong-light", 4, 4},
        {"stuck=100", "wrong-light", 0, 1},
        {"short=5", NULL, 4, 4}, // the kernel keeps such frames to itself
    };
    for (size_t k = 0; k < sizeof cameras / sizeof *cameras; k++) {
        struct session_frame last = {0};
        const char *flaws = cameras[k].flaws;
        int others;
        enter_scratch("uvc");
        plug_in(flaws);
        const struct err how = take_bracket(false, -1);
        const int good = true_frames(flaws, &others, &last);
        print_message("a camera with '%s': %d of 4 frames count, %d do not%s%s; %s\n", flaws, good,
                      others, others ? ", the last is " : "", last.verdict,
                      how.code ? how.msg : "complete");
        assert_in_range(good, cameras[k].least, cameras[k].most);
        assert_true((how.code == ERR_NONE) == (good == 4));
        if (others)
            assert_string_equal(last.verdict, cameras[k].verdict ? cameras[k].verdict : "none");
        unplug(NULL);
    }
}

TEST(a_capture_without_its_camera_is_partial_and_resumes_when_it_is_back)
{
    struct session_frame last;
    int others;
    enter_scratch("uvc");
    plug_in("");
    const struct err how = take_bracket(false, 2);
    assert_int_equal(how.code, ERR_PARTIAL);
    print_message("%s\n", how.msg);
    assert_int_equal(true_frames("", &others, &last), 2);
    unplug(NULL);
    plug_in("");
    assert_int_equal(take_bracket(true, -1).code, ERR_NONE);
    assert_int_equal(true_frames("", &others, &last), 4);
}

#define WITH_CAMERA(name) cmocka_unit_test_teardown(name, unplug)
TEST_MAIN(WITH_CAMERA(exposure_and_gain_reach_the_picture_and_frames_say_so),
          WITH_CAMERA(an_exposure_has_begun_before_its_frame_arrives),
          WITH_CAMERA(a_camera_that_is_unplugged_is_gone_and_comes_back),
          WITH_CAMERA(what_a_camera_makes_of_its_settings_is_what_the_ledger_says),
          WITH_CAMERA(a_capture_without_its_camera_is_partial_and_resumes_when_it_is_back))
