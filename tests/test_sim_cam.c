// test_sim_cam.c - the simulated camera and lights through their driver tables.
#include "tests/test.h"

#include "sim/sim.h"
#include <omp.h>
#include <poll.h>

static const struct cam_driver *const cams[] = {&sim_cam, NULL};
static const struct trig_driver *const trigs[] = {&sim_trig, NULL};

struct taken {
    struct cam_frame frame;
    uint16_t *raw;
    int n;
};

static void keep(void *ctx, const struct cam_frame *frame)
{
    struct taken *t = ctx;
    const size_t size = (size_t)frame->w * (size_t)frame->h * sizeof *t->raw;
    t->frame = *frame;
    t->raw = realloc(t->raw, size);
    memcpy(t->raw, frame->raw, size);
    t->n++;
}

static struct cam *open_or_fail(const char *uri, struct taken *t)
{
    struct err e = {0};
    struct cam *cam = cam_open(cams, uri, keep, t, &e);
    if (!cam)
        fail_msg("%s", e.msg);
    return cam;
}

static void take(struct cam *cam, struct taken *t, int64_t exposure_ns)
{
    static uint64_t id;
    struct err e = {0};
    const struct cam_shot shot = {.id = ++id, .exposure_ns = exposure_ns, .gain = 1};
    const int before = t->n;
    if (!cam_shoot(cam, &shot, &e))
        fail_msg("%s", e.msg);
    while (t->n == before) {
        struct pollfd p = {cam->fd, POLLIN, 0};
        assert_int_equal(poll(&p, 1, 20000), 1);
        if (!cam_pump(cam, &e))
            fail_msg("%s", e.msg);
    }
    assert_int_equal(t->frame.shot, id);
}

static double mean(const struct taken *t)
{
    double sum = 0;
    const int n = t->frame.w * t->frame.h;
    for (int k = 0; k < n; k++)
        sum += t->raw[k];
    return sum / n;
}

TEST(counts_are_black_plus_responsivity_times_exposure_times_radiance)
{
    struct taken t = {0};
    struct lab lab;
    struct err e = {0};
    const struct image *l;
    struct cam *cam = open_or_fail("sim:w=64,h=64", &t);
    take(cam, &t, 100000);
    assert_true(lab_open(&lab, NULL, NULL, &e));
    view_resize(&lab.scene.view, 64, 64);
    assert_true(lab_photo(&lab, 0, 0, &l, &e));
    double expected = 0, seen = 0, variance = 0;
    for (int k = 0; k < 64 * 64; k++) {
        const double counts = lab.scene.sensor.responsivity * 1e-4 * (double)l->px[k];
        expected += counts;
        seen += t.raw[k] - lab.scene.sensor.black;
        variance += counts / lab.scene.sensor.electrons_per_count + 2;
    }
    // Shot and read noise of the sum, and the drift of the black level, at most 0.3 counts.
    assert_near(seen, expected, 5 * sqrt(variance) + 0.4 * 64 * 64 + 0.002 * expected);
    lab_finish(&lab);
    cam_close(cam);
    free(t.raw);
}

TEST(a_lit_frame_needs_a_light_and_knows_its_filter)
{
    struct taken t = {0};
    struct err e = {0};
    struct cam *cam = open_or_fail("sim:w=64,h=64,world=test-lit", &t);
    struct trig *lights = trig_open(trigs, "sim:lines=2,world=test-lit", &e);
    struct trig *wheel = trig_open(trigs, "sim:positions=4,world=test-lit", &e);
    assert_non_null(lights);
    assert_non_null(wheel);
    take(cam, &t, 10000000);
    const double dark = mean(&t);
    assert_near(dark, 256, 1);
    assert_true(trig_set(lights, 1, &e));
    take(cam, &t, 10000000);
    const double lit = mean(&t);
    assert_true(lit > dark + 10);
    assert_true(t.frame.device_ns >= lights->changed_ns);
    assert_true(trig_set(wheel, 1, &e));
    take(cam, &t, 10000000);
    assert_true(fabs(mean(&t) - lit) > 1); // red makes another picture
    assert_true(trig_set(wheel, 0, &e) && trig_set(lights, 0, &e));
    take(cam, &t, 10000000);
    assert_near(mean(&t), dark, 1);
    assert_true(trig_pulse(lights, 1, 5000000, &e)); // half the exposure
    take(cam, &t, 10000000);
    assert_true(mean(&t) > dark + 0.2 * (lit - dark) && mean(&t) < dark + 0.9 * (lit - dark));
    trig_close(wheel);
    trig_close(lights);
    cam_close(cam);
    free(t.raw);
}

TEST(the_same_seed_gives_the_same_bytes_on_any_number_of_threads)
{
    uint16_t *first = NULL;
    for (int threads = 1; threads <= 3; threads++) {
        struct taken t = {0};
        omp_set_num_threads(threads);
        struct cam *cam = open_or_fail("sim:w=50,h=40,seed=7", &t);
        for (int k = 0; k < 3; k++)
            take(cam, &t, 1000000);
        if (first)
            assert_memory_equal(first, t.raw, 50 * 40 * sizeof *t.raw);
        else
            first = memcpy(malloc(50 * 40 * sizeof *t.raw), t.raw, 50 * 40 * sizeof *t.raw);
        cam_close(cam);
        free(t.raw);
    }
    free(first);
}

TEST(the_virtual_clock_does_not_wait)
{
    struct taken t = {0};
    struct cam *cam = open_or_fail("sim:w=8,h=8", &t);
    int64_t last = 0;
    for (int k = 0; k < 10; k++) {
        take(cam, &t, 5000000000); // 50 s together
        assert_true(t.frame.device_ns >= last);
        last = t.frame.device_ns + t.frame.exposure_ns;
    }
    cam_close(cam);
    free(t.raw);
}

TEST(options_that_cannot_be_are_refused)
{
    static const struct {
        const char *uri, *msg;
    } bad[] = {
        {"sim:w=0", "camera sim: w=0: must be 1 to 1.638e+04"},
        {"sim:absent.yaml", "camera sim: absent.yaml: No such file or directory"},
        {"sim:noise=3", "camera sim: no option 'noise'; there are scene, rig, world, w, h, seed, "
                        "realtime, grace, settle, dead"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        struct err e = {0};
        assert_null(cam_open(cams, bad[k].uri, keep, NULL, &e));
        assert_string_equal(e.msg, bad[k].msg);
    }
    struct err e = {0};
    assert_null(trig_open(trigs, "sim:", &e));
    assert_string_equal(e.msg, "trigger sim: give either lines= or positions=");
}

TEST_MAIN(cmocka_unit_test(counts_are_black_plus_responsivity_times_exposure_times_radiance),
          cmocka_unit_test(a_lit_frame_needs_a_light_and_knows_its_filter),
          cmocka_unit_test(the_same_seed_gives_the_same_bytes_on_any_number_of_threads),
          cmocka_unit_test(the_virtual_clock_does_not_wait),
          cmocka_unit_test(options_that_cannot_be_are_refused))
