// test_fault.c - faults happen when their schedule says, as they say, and only then.
#include "tests/test.h"

#include "sim/schedule.h"
#include "sim/sim.h"
#include <poll.h>
#include <sys/stat.h>

static const struct cam_driver *const cams[] = {&sim_cam, &fault_cam, NULL};
static const struct trig_driver *const trigs[] = {&sim_trig, &fault_trig, NULL};

enum { N = 16 * 12, MOST = 20 };

struct seen {
    int n;
    struct cam_frame frame[MOST];
    uint16_t raw[MOST][N];
};

static void keep(void *ctx, const struct cam_frame *f)
{
    struct seen *s = ctx;
    assert_true(s->n < MOST);
    s->frame[s->n] = *f;
    memcpy(s->raw[s->n++], f->raw, sizeof s->raw[0]);
}

static struct cam *open_cam(const char *uri, struct seen *s)
{
    struct err e = {0};
    *s = (struct seen){0};
    struct cam *cam = cam_open(cams, uri, keep, s, &e);
    if (!cam)
        fail_msg("%s", e.msg);
    return cam;
}

// Shoots and pumps until a frame came or `wait_ms` passed; false when the camera failed.
static bool take(struct cam *cam, struct seen *s, int64_t exposure_ns, int wait_ms, struct err *e)
{
    static uint64_t id;
    const struct cam_shot shot = {++id, exposure_ns, 1, NAN};
    const int before = s->n;
    if (!cam_shoot(cam, &shot, e))
        return false;
    for (int k = 0; k < wait_ms && s->n == before; k++) {
        struct pollfd p = {cam->fd, POLLIN, 0};
        if (poll(&p, 1, 1) && !cam_pump(cam, e))
            return false;
    }
    return true;
}

static void take_three(const char *uri, struct seen *s)
{
    struct err e = {0};
    struct cam *cam = open_cam(uri, s);
    for (int k = 1; k <= 3; k++)
        if (!take(cam, s, k * 1000000, 60, &e))
            fail_msg("%s: %s", uri, e.msg);
    cam_close(cam);
}

TEST(a_lost_frame_is_a_gap_in_seq)
{
    struct seen s;
    take_three("fault:drop=2,in=sim:w=16,h=12", &s);
    assert_int_equal(s.n, 2);
    assert_int_equal(s.frame[0].seq, 0);
    assert_int_equal(s.frame[1].seq, 2);
}

TEST(frames_are_spoiled_as_they_say)
{
    struct seen clean, s;
    take_three("fault:in=sim:w=16,h=12", &clean);
    assert_int_equal(clean.n, 3);

    take_three("fault:duplicate=2,in=sim:w=16,h=12", &s);
    assert_memory_equal(s.raw[1], clean.raw[0], sizeof s.raw[0]);
    assert_int_equal(s.frame[1].seq, 1);

    take_three("fault:twice=2,in=sim:w=16,h=12", &s);
    assert_int_equal(s.n, 4);
    assert_int_equal(s.frame[1].seq, s.frame[2].seq);

    take_three("fault:torn=2,in=sim:w=16,h=12", &s);
    assert_memory_equal(s.raw[1], clean.raw[1], sizeof s.raw[0] / 2);
    assert_memory_equal(s.raw[1] + N / 2, clean.raw[0] + N / 2, sizeof s.raw[0] / 2);

    take_three("fault:damaged=3,in=sim:w=16,h=12", &s);
    assert_true(s.frame[2].damaged && !s.frame[1].damaged);

    take_three("fault:late=1,delay=20ms,in=sim:w=16,h=12", &s);
    assert_int_equal(s.n, 3);
}

TEST(wrong_exposures_are_told_or_hidden)
{
    static const struct {
        const char *fault;
        int64_t reported[3]; // of 1, 2 and 3 ms
        double light_as[3];  // ms that the counts are of
    } cases[] = {
        {"exposure=2,factor=4", {1000000, 2000000, 3000000}, {1, 8, 3}},
        {"rounds=2,factor=4", {1000000, 8000000, 3000000}, {1, 8, 3}},
        {"lag=2-3", {1000000, 1000000, 2000000}, {1, 1, 2}},
        {"ignores=2", {1000000, 2000000, 3000000}, {1, 1, 3}},
    };
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        char uri[100];
        struct seen s;
        double light[3] = {0};
        snprintf(uri, sizeof uri, "fault:%s,in=sim:w=16,h=12", cases[c].fault);
        take_three(uri, &s);
        assert_int_equal(s.n, 3);
        for (int k = 0; k < 3; k++) {
            assert_int_equal(s.frame[k].exposure_ns, cases[c].reported[k]);
            for (int i = 0; i < N; i++)
                if (s.raw[0][i] < 600) // what no exposure here saturates
                    light[k] += s.raw[k][i] - 256;
        }
        for (int k = 1; k < 3; k++)
            assert_near(light[k] / light[0], cases[c].light_as[k] / cases[c].light_as[0],
                        0.15 * cases[c].light_as[k]);
    }
}

TEST(a_camera_that_fails_says_so)
{
    struct seen s;
    struct err e = {0};
    struct cam *cam = open_cam("fault:busy=1,in=sim:w=16,h=12", &s);
    assert_false(take(cam, &s, 1000000, 60, &e));
    assert_string_equal(e.msg, "camera fault: busy");
    assert_true(take(cam, &s, 1000000, 1000, &e));
    assert_int_equal(s.n, 1);
    cam_close(cam);

    cam = open_cam("fault:stall=2,in=sim:w=16,h=12", &s);
    for (int k = 0; k < 3; k++)
        assert_true(take(cam, &s, 1000000, 30, &e));
    assert_int_equal(s.n, 1);
    cam_close(cam);
}

TEST(an_unplugged_camera_comes_back_with_its_count)
{
    struct seen s;
    struct err e = {0};
    remove("fault.state");
    const char *const uri = "fault:unplug=2,state=fault.state,in=sim:w=16,h=12";
    struct cam *cam = open_cam(uri, &s);
    assert_true(take(cam, &s, 1000000, 1000, &e));
    assert_false(take(cam, &s, 1000000, 1000, &e));
    assert_string_equal(e.msg, "camera fault: unplugged");
    assert_int_equal(e.code, ERR_DEVICE);
    assert_false(take(cam, &s, 1000000, 1000, &e));
    cam_close(cam);
    cam = open_cam(uri, &s);
    for (int k = 0; k < 3; k++)
        assert_true(take(cam, &s, 1000000, 1000, &e));
    assert_int_equal(s.n, 3);
    cam_close(cam);
    remove("fault.state");
}

TEST(a_full_disk_lets_no_file_grow)
{
    struct seen s;
    struct err e = {0};
    struct cam *cam = open_cam("fault:disk-full=2,in=sim:w=16,h=12", &s);
    FILE *f = fopen("fault.disk", "w");
    setbuf(f, NULL);
    assert_true(take(cam, &s, 1000000, 1000, &e));
    assert_int_equal(fputc('x', f), 'x');
    assert_true(take(cam, &s, 1000000, 1000, &e));
    assert_int_equal(fputc('x', f), EOF);
    cam_close(cam);
    clearerr(f);
    assert_int_equal(fputc('x', f), 'x');
    fclose(f);
    remove("fault.disk");
}

// Light in a frame of the camera while the trigger is told to switch on.
static double light_of(struct cam *cam, struct seen *s, struct trig *t, uint32_t state)
{
    struct err e = {0};
    double sum = 0;
    s->n = 0;
    assert_true(trig_set(t, state, &e));
    usleep(1000);
    if (!take(cam, s, 4000000, 1000, &e))
        fail_msg("%s", e.msg);
    for (int i = 0; i < N; i++)
        sum += s->raw[0][i] - 256;
    if (t->caps.lines)
        assert_true(trig_set(t, 0, &e));
    return sum;
}

TEST(lights_fail_by_schedule_and_claim_that_they_did_not)
{
    struct seen s;
    struct err e = {0};
    struct cam *cam = open_cam("sim:w=16,h=12,world=test-fault", &s);
    struct trig *t =
        trig_open(trigs, "fault:miss=2,early=3,flash=100us,in=sim:lines=1,world=test-fault", &e);
    assert_non_null(t);
    const double lit = light_of(cam, &s, t, 1);
    assert_true(lit > 1000);
    assert_true(light_of(cam, &s, t, 1) < 0.1 * lit);
    assert_true(light_of(cam, &s, t, 1) < 0.1 * lit);
    assert_near(light_of(cam, &s, t, 1) / lit, 1, 0.1);
    trig_close(t);
    t = trig_open(trigs, "fault:fail=1,in=sim:lines=1,world=test-fault", &e);
    assert_false(trig_set(t, 1, &e));
    assert_string_equal(e.msg, "trigger fault: does not answer");
    trig_close(t);
    cam_close(cam);
}

TEST(a_stuck_wheel_shows_the_filter_of_before)
{
    struct seen s;
    struct err e = {0};
    struct cam *cam = open_cam("sim:w=16,h=12,world=test-stuck", &s);
    struct trig *t = trig_open(trigs, "fault:stuck=2,in=sim:positions=3,world=test-stuck", &e);
    assert_non_null(t);
    const double green = light_of(cam, &s, t, 0), stuck = light_of(cam, &s, t, 1),
                 red = light_of(cam, &s, t, 1);
    assert_near(stuck / green, 1, 0.05);
    assert_true(fabs(red / green - 1) > 0.1);
    trig_close(t);
    cam_close(cam);
}

TEST(a_chopped_light_makes_bands_and_a_drifting_one_fades)
{
    struct seen s;
    struct err e = {0};
    struct cam *cam = open_cam("sim:w=16,h=12,world=test-pwm", &s);
    struct trig *t = trig_open(trigs, "sim:lines=1,pwm=10kHz,duty=0.3,world=test-pwm", &e);
    assert_non_null(t);
    assert_true(trig_set(t, 1, &e));
    assert_true(take(cam, &s, 30000, 1000, &e)); // a third of a period, rows 10 us apart
    double row[12] = {0}, least = INFINITY, most = 0;
    for (int i = 0; i < N; i++)
        row[i / 16] += s.raw[0][i] - 256;
    for (int j = 4; j < 8; j++) { // the bright middle
        least = fmin(least, row[j]);
        most = fmax(most, row[j]);
    }
    assert_true(most > 2 * fmax(1, least));
    trig_close(t);
    t = trig_open(trigs, "sim:lines=1,drift=0.5,flaws=2-100,world=test-pwm", &e);
    assert_non_null(t);
    double light[12];
    for (int k = 0; k < 12; k++)
        light[k] = light_of(cam, &s, t, 1);
    assert_true(light[10] > 1.2 * light[0]);
    trig_close(t);
    cam_close(cam);
}

TEST(schedules_are_lists_or_chances)
{
    struct schedule s;
    struct err e = {0};
    assert_true(schedule_parse(&s, "2+5-7", &e));
    const char *const hits = ".x..xxx..";
    for (int k = 1; k < 9; k++)
        assert_int_equal(schedule_hits(&s, 1, 0, k), hits[k - 1] == 'x');
    assert_true(schedule_parse(&s, "10%", &e));
    int count = 0;
    for (int k = 1; k <= 10000; k++)
        count += schedule_hits(&s, 3, 2, k);
    assert_in_range(count, 900, 1100); // 3 standard deviations are 90
    static const char *const bad[] = {"0", "x", "5-2", "3+", "5%+2", "101%", "-1"};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        assert_false(schedule_parse(&s, bad[k], &e));
        assert_int_equal(e.code, ERR_DATA);
    }
    assert_null(cam_open(cams, "fault:drop=x,in=sim:", keep, NULL, &e));
    assert_string_equal(e.msg, "camera fault: drop: 'x' is not a schedule such as 2, 3+7-9 or 5%");
    assert_null(cam_open(cams, "fault:in=rose:", keep, NULL, &e));
}

TEST_MAIN(cmocka_unit_test(a_lost_frame_is_a_gap_in_seq),
          cmocka_unit_test(frames_are_spoiled_as_they_say),
          cmocka_unit_test(wrong_exposures_are_told_or_hidden),
          cmocka_unit_test(a_camera_that_fails_says_so),
          cmocka_unit_test(an_unplugged_camera_comes_back_with_its_count),
          cmocka_unit_test(a_full_disk_lets_no_file_grow),
          cmocka_unit_test(lights_fail_by_schedule_and_claim_that_they_did_not),
          cmocka_unit_test(a_stuck_wheel_shows_the_filter_of_before),
          cmocka_unit_test(a_chopped_light_makes_bands_and_a_drifting_one_fades),
          cmocka_unit_test(schedules_are_lists_or_chances))
