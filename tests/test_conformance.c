// test_conformance.c - every driver keeps the promises of its table; so do real devices, named by
// TEST_CAM=v4l2:/dev/video0 or TEST_TRIG=gpiod:... in the environment.
#include "tests/test.h"

#include "sim/sim.h"
#include "tests/conformance.h"

static const struct cam_driver *const cams[] = {&sim_cam, &fault_cam, NULL};
static const struct trig_driver *const trigs[] = {&sim_trig, &fault_trig, NULL};

TEST(cameras_keep_their_promises)
{
    static const char *const uris[] = {
        "sim:w=16,h=12",
        "sim:w=16,h=12,realtime=1",
        "fault:in=sim:w=16,h=12",
        "fault:in=fault:in=sim:w=16,h=12",
    };
    const char *own = getenv("TEST_CAM");
    for (size_t k = 0; k < sizeof uris / sizeof *uris && !own; k++)
        conform_cam(cams, uris[k]);
    if (own)
        conform_cam(cams, own);
}

TEST(lights_and_wheels_keep_their_promises)
{
    static const char *const uris[] = {
        "sim:lines=3",          "sim:lines=32",
        "sim:positions=5",      "sim:positions=3,settle=5ms",
        "fault:in=sim:lines=2", "fault:in=sim:positions=3,settle=5ms",
    };
    const char *own = getenv("TEST_TRIG");
    for (size_t k = 0; k < sizeof uris / sizeof *uris && !own; k++)
        conform_trig(trigs, uris[k]);
    if (own)
        conform_trig(trigs, own);
}

TEST_MAIN(cmocka_unit_test(cameras_keep_their_promises),
          cmocka_unit_test(lights_and_wheels_keep_their_promises))
