// uvc_describe.h - what the test camera says that it is: a USB device with one video function, a
// camera with exposure and gain, and one stream of 16-bit grey pictures over a bulk endpoint.
#pragma once
#include <linux/usb/ch9.h>
#include <stddef.h>
#include <stdint.h>

enum { W = 160, H = 120, FRAME = 2 * W * H, HEADER = 2 }; // pixels; bytes
enum { FASTEST = 500000, SLOWEST = 1000000 };             // 100 ns from frame to frame
enum { CAMERA = 1, PROCESSING = 2, OUTPUT = 3 };          // entities

extern const struct usb_endpoint_descriptor uvc_bulk;

// The descriptor that wValue of a request names, at most 256 bytes; 0: there is none.
size_t uvc_describe(uint16_t value, uint8_t *data);
