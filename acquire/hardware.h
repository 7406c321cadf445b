// hardware.h - the drivers of real devices; each is there when its library was at build.
#pragma once
#include "acquire/camera.h"
#include "acquire/trigger.h"

extern const struct cam_driver v4l2_cam;      // "v4l2:/dev/video0"
extern const struct cam_driver libcamera_cam; // HAVE_LIBCAMERA: "libcamera:0"
extern const struct trig_driver gpiod_trig;   // HAVE_GPIOD: "gpiod:gpiochip0,lines=17+27"
extern const struct trig_driver usb_trig;     // HAVE_LIBUSB: "usb:relay", "usb:wheel"
extern const struct trig_driver prompt_trig;  // "prompt:positions=3"
