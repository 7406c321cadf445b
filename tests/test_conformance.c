// test_conformance.c - every driver keeps the promises of its table; so do real devices, named by
// TEST_CAM=v4l2:/dev/video0 or TEST_TRIG=gpiod:... in the environment.
#include "tests/test.h"

#include "core/outfile.h"
#include "core/session.h"
#include "tests/conformance.h"
#include "ui/drivers.h"
#include <fcntl.h>
#include <pthread.h>

TEST(cameras_keep_their_promises)
{
    static const char *const uris[] = {
        "sim:w=16,h=12",
        "sim:w=16,h=12,realtime=1",
        "fault:in=sim:w=16,h=12",
        "fault:in=fault:in=sim:w=16,h=12",
    };
    const char *own = getenv("TEST_CAM");
    if (!own && getenv("TEST_TRIG"))
        skip();
    for (size_t k = 0; k < sizeof uris / sizeof *uris && !own; k++)
        conform_cam(all_drivers.cameras, uris[k]);
    if (own)
        conform_cam(all_drivers.cameras, own);
}

// A session with the exposures that the promises ask for: four of 1 ms, two of 4 ms.
static void record(const char *folder)
{
    char path[220];
    struct err e = {0};
    struct rig rig;
    struct session *s = NULL;
    uint16_t raw[6] = {1, 2, 3, 4, 5, 6};
    const struct dng picture = {.w = 3, .h = 2, .white = 4095, .gain = 1, .raw = raw};
    snprintf(path, sizeof path, "%s.plan", folder);
    assert_true(outfile_write(path, "name: p\n", 8, &e));
    if (!rig_open(&rig, SOURCE_DIR "/rigs/sim.yaml", &e) ||
        !session_create(&s, folder, &rig, path, &e))
        fail_msg("%s", e.msg);
    rig_finish(&rig);
    unlink(path);
    for (int k = 0; k < 6; k++) {
        const struct session_step step = {
            .index = k, .exposure_ns = k < 4 ? 1000000 : 4000000, .gain = 1, .focus_per_m = NAN};
        struct session_frame f = {.id = session_next_id(s),
                                  .step = step,
                                  .attempt = 1,
                                  .reported_ns = step.exposure_ns,
                                  .gain = 1,
                                  .focus_per_m = NAN,
                                  .temperature_k = NAN,
                                  .measured_sigma = NAN,
                                  .w = 3,
                                  .h = 2,
                                  .white = 4095};
        strcpy(f.verdict, "good");
        if (!session_add_steps(s, &step, 1, k == 5, &e) || !session_add_frame(s, &f, &picture, &e))
            fail_msg("%s", e.msg);
    }
    session_close(s);
}

TEST(a_recorded_session_keeps_them_too)
{
    char folder[] = "/tmp/nacre_test_XXXXXX", line[200], uri[100];
    if (getenv("TEST_CAM") || getenv("TEST_TRIG"))
        skip();
    assert_non_null(mkdtemp(folder));
    snprintf(line, sizeof line, "%s/s", folder);
    record(line);
    snprintf(uri, sizeof uri, "replay:%s/s", folder);
    conform_cam(all_drivers.cameras, uri);
    snprintf(uri, sizeof uri, "fault:in=replay:%s/s", folder);
    conform_cam(all_drivers.cameras, uri);
    snprintf(line, sizeof line, "rm -rf %s", folder);
    assert_int_equal(system(line), 0);
}

TEST(lights_and_wheels_keep_their_promises)
{
    static const char *const uris[] = {
        "sim:lines=3",          "sim:lines=32",
        "sim:positions=5",      "sim:positions=3,settle=5ms",
        "fault:in=sim:lines=2", "fault:in=sim:positions=3,settle=5ms",
    };
    const char *own = getenv("TEST_TRIG");
    if (!own && getenv("TEST_CAM"))
        skip();
    for (size_t k = 0; k < sizeof uris / sizeof *uris && !own; k++)
        conform_trig(all_drivers.triggers, uris[k]);
    if (own)
        conform_trig(all_drivers.triggers, own);
}

static int terminal;

static void *answer(void *arg)
{
    char text[200];
    ssize_t n;
    (void)arg;
    while ((n = read(terminal, text, sizeof text)) > 0)
        if (memchr(text, ':', (size_t)n) && write(terminal, "\n", 1) != 1)
            break;
    return NULL;
}

TEST(a_person_keeps_them_too)
{
    char uri[100], path[64];
    pthread_t person;
    if (getenv("TEST_CAM") || getenv("TEST_TRIG"))
        skip();
    terminal = posix_openpt(O_RDWR | O_NOCTTY);
    assert_true(terminal >= 0 && !grantpt(terminal) && !unlockpt(terminal) &&
                !ptsname_r(terminal, path, sizeof path));
    const int other_end = open(path, O_RDWR | O_NOCTTY); // until it closes, the person stays
    assert_true(other_end >= 0);
    assert_int_equal(pthread_create(&person, NULL, answer, NULL), 0);
    snprintf(uri, sizeof uri, "prompt:positions=3,patience=5s,tty=%s", path);
    conform_trig(all_drivers.triggers, uri);
    close(other_end);
    pthread_join(person, NULL);
    close(terminal);
}

TEST_MAIN(cmocka_unit_test(cameras_keep_their_promises),
          cmocka_unit_test(a_recorded_session_keeps_them_too),
          cmocka_unit_test(lights_and_wheels_keep_their_promises),
          cmocka_unit_test(a_person_keeps_them_too))
