// test_v4l2.c - v4l2: on the kernel's own test camera, which fails when it is told to. Needs
// TEST_VIVID=/dev/videoN (a vivid webcam), and TEST_VIVID_HDMI for a source that changes; tests/vm
// has both. Everywhere else it is skipped.
#include "tests/test.h"

#include "acquire/clock.h"
#include "acquire/hardware.h"
#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>

static const struct cam_driver *const drivers[] = {&v4l2_cam, NULL};
static uint64_t shots;

struct seen {
    int n, damaged;
    uint64_t first_seq, last_seq;
    double mean; // of the last frame, 0 to 1
    const struct cam *cam;
};

static const char *vivid(void)
{
    const char *path = getenv("TEST_VIVID");
    if (!path) {
        print_message("skipped: no TEST_VIVID in the environment\n");
        skip();
    }
    return path ? path : ""; // skip() does not return
}

// Sets a control by its name, as vivid has many of its own.
static void set_control(const char *path, const char *name, int value)
{
    const int fd = open(path, O_RDWR | O_CLOEXEC);
    struct v4l2_query_ext_ctrl q = {.id = V4L2_CTRL_FLAG_NEXT_CTRL};
    assert_true(fd >= 0);
    while (!ioctl(fd, VIDIOC_QUERY_EXT_CTRL, &q) && strcmp(q.name, name))
        q.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    struct v4l2_control c = {.id = q.id, .value = value};
    if (strcmp(q.name, name) || ioctl(fd, VIDIOC_S_CTRL, &c))
        fail_msg("%s: control '%s': %s", path, name, strerror(errno));
    close(fd);
}

static void on_frame(void *ctx, const struct cam_frame *f)
{
    struct seen *s = ctx;
    double sum = 0;
    for (int k = 0; k < f->w * f->h; k++)
        sum += f->raw[k];
    s->mean = sum / f->w / f->h / ((1 << s->cam->caps.bits) - 1);
    s->first_seq = s->n ? s->first_seq : f->seq;
    s->last_seq = f->seq;
    s->damaged += f->damaged;
    s->n++;
}

static struct cam *open_cam(const char *path, const char *more, struct seen *s)
{
    char uri[200];
    struct err e = {0};
    snprintf(uri, sizeof uri, "v4l2:%s%s", path, more);
    *s = (struct seen){0};
    struct cam *cam = cam_open(drivers, uri, on_frame, s, &e);
    if (!cam)
        fail_msg("%s: %s", uri, e.msg);
    s->cam = cam;
    return cam;
}

static void shoot(struct cam *cam)
{
    struct err e = {0};
    const struct cam_shot shot = {++shots, cam->caps.exposure_min_ns, 1, NAN};
    assert_true(cam_shoot(cam, &shot, &e));
}

// Pumps until there is another frame; false: the camera failed, or 10 s have passed.
static bool await(struct cam *cam, const struct seen *s, struct err *e)
{
    const int n = s->n;
    const int64_t until = clock_boot_ns() + INT64_C(10000000000);
    *e = (struct err){0};
    while (s->n == n && clock_boot_ns() < until) {
        struct pollfd p = {cam->fd, POLLIN, 0};
        if (poll(&p, 1, 100) == 1 && !cam_pump(cam, e))
            return false;
    }
    return s->n > n;
}

TEST(counts_are_the_same_share_of_full_scale_in_every_format)
{
    static const char *const names[] = {"BA81", "GBRG", "RGGB", "BG10", "GB12", "RG12",
                                        "BYR2", "GREY", "Y10",  "Y12",  "Y16",  "YUYV"};
    const char *path = vivid();
    set_control(path, "OSD Text Mode", 2);
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        for (int white = 0; white < 2; white++) {
            char more[80];
            struct seen s;
            struct err e;
            snprintf(more, sizeof more, ",format=%s,w=320,h=180", names[k]);
            set_control(path, "Test Pattern", white ? 6 : 5);
            struct cam *cam = open_cam(path, more, &s);
            shoot(cam);
            assert_true(await(cam, &s, &e));
            const bool is_limited = cam->caps.for_looking; // YUV: from 16 to 235
            cam_close(cam);
            assert_near(s.mean, is_limited ? (white ? 235 / 255. : 16 / 255.) : white, 0.01);
        }
}

TEST(every_shot_gets_a_frame_though_buffers_are_dropped)
{
    struct seen s;
    struct err e;
    const char *path = vivid();
    struct cam *cam = open_cam(path, "", &s);
    set_control(path, "Percentage of Dropped Buffers", 50);
    for (int k = 0; k < 10; k++) {
        shoot(cam);
        if (!await(cam, &s, &e))
            fail_msg("shot %d: %s", k, e.msg);
    }
    set_control(path, "Percentage of Dropped Buffers", 0);
    cam_close(cam);
    assert_true(s.last_seq - s.first_seq >= 10); // numbers of lost frames are left out
    assert_int_equal(s.damaged, 0);
}

TEST(a_buffer_with_an_error_is_a_damaged_frame)
{
    struct seen s;
    struct err e;
    const char *path = vivid();
    struct cam *cam = open_cam(path, "", &s);
    for (int k = 0; k < 50 && !s.damaged; k++) {
        shoot(cam);
        usleep(20000); // the frame that was under way before the shot does not count
        set_control(path, "Inject V4L2_BUF_FLAG_ERROR", 1);
        assert_true(await(cam, &s, &e));
    }
    cam_close(cam);
    assert_int_equal(s.damaged, 1);
}

TEST(two_programs_cannot_have_it)
{
    struct seen s;
    struct err e = {0};
    char uri[200];
    const char *path = vivid();
    struct cam *cam = open_cam(path, "", &s);
    snprintf(uri, sizeof uri, "v4l2:%s", path);
    assert_null(cam_open(drivers, uri, on_frame, &s, &e));
    assert_int_equal(e.code, ERR_DEVICE);
    assert_non_null(strstr(e.msg, "another program uses it"));
    cam_close(cam);
}

TEST(what_fails_at_the_start_is_told)
{
    static const char *const faults[] = {"Inject VIDIOC_REQBUFS Error",
                                         "Inject VIDIOC_STREAMON Error"};
    const char *path = vivid();
    for (size_t k = 0; k < sizeof faults / sizeof *faults; k++) {
        struct seen s;
        struct err e = {0};
        char uri[200];
        snprintf(uri, sizeof uri, "v4l2:%s", path);
        set_control(path, faults[k], 1);
        assert_null(cam_open(drivers, uri, on_frame, &s, &e));
        assert_int_equal(e.code, ERR_DEVICE);
        cam_close(open_cam(path, "", &s));
    }
}

static void fails(const char *path, const char *more, const char *control, int value)
{
    struct seen s;
    struct err e;
    struct cam *cam = open_cam(path, more, &s);
    shoot(cam);
    assert_true(await(cam, &s, &e));
    const int64_t from = clock_boot_ns();
    set_control(path, control, value);
    while (clock_boot_ns() - from < INT64_C(5000000000)) {
        shoot(cam);
        if (!await(cam, &s, &e))
            break;
    }
    assert_int_equal(e.code, ERR_DEVICE);
    print_message("%s: after %.0f ms: %s\n", control, 1e-6 * (double)(clock_boot_ns() - from),
                  e.msg);
    cam_close(cam);
}

TEST(a_fatal_error_ends_it_and_it_can_be_opened_again)
{
    struct seen s;
    const char *path = vivid();
    fails(path, "", "Inject Fatal Streaming Error", 1);
    cam_close(open_cam(path, "", &s));
}

TEST(a_source_that_changes_ends_it)
{
    const char *path = getenv("TEST_VIVID_HDMI");
    if (!path)
        skip();
    fails(path, ",format=GREY", "DV Timings Signal Mode", 1); // no signal
}

TEST(a_camera_that_is_unplugged_is_gone)
{
    fails(vivid(), "", "Disconnect", 1);
}

TEST_MAIN(cmocka_unit_test(counts_are_the_same_share_of_full_scale_in_every_format),
          cmocka_unit_test(every_shot_gets_a_frame_though_buffers_are_dropped),
          cmocka_unit_test(a_buffer_with_an_error_is_a_damaged_frame),
          cmocka_unit_test(two_programs_cannot_have_it),
          cmocka_unit_test(what_fails_at_the_start_is_told),
          cmocka_unit_test(a_fatal_error_ends_it_and_it_can_be_opened_again),
          cmocka_unit_test(a_source_that_changes_ends_it),
          cmocka_unit_test(a_camera_that_is_unplugged_is_gone))
