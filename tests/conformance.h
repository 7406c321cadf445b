// conformance.h - the promises of acquire/camera.h and acquire/trigger.h, checked on any driver.
//
// The same two functions run on simulated devices in every build and on real ones by TEST_CAM and
// TEST_TRIG (test_conformance.c). They fail the running cmocka test with the promise that was
// broken.
#pragma once
#include "acquire/camera.h"
#include "acquire/trigger.h"

void conform_cam(const struct cam_driver *const drivers[], const char *uri);
void conform_trig(const struct trig_driver *const drivers[], const char *uri);
