// uvc_camera.c - acts a USB camera of the video class: "uvc_camera UDC [NAME=VALUE...]".
//
// The USB side of a UVC 1.0 camera in user space, by the kernel's raw gadget: descriptors, requests
// on endpoint 0, and frames on a bulk endpoint. (Its gadgetfs tells the host that a setting has
// arrived before we have it, and forgets it when the next one follows.) Exposure and gain reach the
// picture, and into the first two pixels the camera writes what it really used, which its controls
// need not tell:
//
//   step=N   exposures are multiples of N x 100 us, and the control says so
//   rounds=N they are, and only reading the control back tells
//   hides=N  they are, and nothing tells
//   late=N   settings are in force N frames after they were sent
//   stuck=N  exposure is N x 100 us, whatever is sent
//   short=N  every Nth frame loses its end
//
// It stays plugged in until it is killed. Written from the specification, not from our driver.
#define _GNU_SOURCE
#include "tests/vm/uvc_describe.h"
#include <fcntl.h>
#include <linux/usb/ch9.h>
#include <linux/usb/raw_gadget.h>
#include <linux/usb/video.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

enum { BLACK = 64, WHITE = 4095, HISTORY = 16 };
static const double PER_UNIT = 12; // counts of the brightest spot in 100 us at gain 1
static const int UNITY = 16;       // of the gain control

static void must(bool ok, const char *what)
{
    if (!ok) {
        perror(what);
        exit(1);
    }
}

// --- controls ---

static struct control {
    uint8_t entity, selector, size, info; // info: 1 read, 2 write, 8 changes by itself
    uint32_t lo, hi, step, def;
    _Atomic uint32_t now;
} controls[] = {
    {CAMERA, UVC_CT_AE_MODE_CONTROL, 1, 3, 1, 8, 9, 8, 8}, // 1: by hand, 8: automatic
    {CAMERA, UVC_CT_AE_PRIORITY_CONTROL, 1, 3, 0, 1, 1, 1, 1},
    {CAMERA, UVC_CT_EXPOSURE_TIME_ABSOLUTE_CONTROL, 4, 3, 1, 5000, 1, 100, 100},
    {PROCESSING, UVC_PU_GAIN_CONTROL, 2, 3, 16, 256, 1, 16, 16},
};
enum { MODE, PRIORITY, EXPOSURE, GAIN, CONTROLS };

static struct {
    const char *name;
    uint32_t value;
} options[] = {{"step", 0}, {"rounds", 0}, {"hides", 0}, {"late", 0}, {"stuck", 0}, {"short", 0}};
enum { STEP, ROUNDS, HIDES, LATE, STUCK, SHORT, OPTIONS };

static uint32_t rounded(uint32_t v, uint32_t to)
{
    return to ? (v + to / 2 < to ? to : (v + to / 2) / to * to) : v;
}

static struct control *control_at(uint8_t entity, uint8_t selector)
{
    for (int k = 0; k < CONTROLS; k++)
        if (controls[k].entity == entity && controls[k].selector == selector)
            return &controls[k];
    return NULL;
}

static bool control_says(const struct control *c, uint8_t request, uint32_t *value)
{
    switch (request) {
    case UVC_GET_CUR: *value = c->now; return true;
    case UVC_GET_MIN: *value = c->lo; return true;
    case UVC_GET_MAX: *value = c->hi; return true;
    case UVC_GET_RES: *value = c->step; return true;
    case UVC_GET_DEF: *value = c->def; return true;
    default: return false;
    }
}

static void control_hears(struct control *c, uint32_t value)
{
    c->now = c == &controls[EXPOSURE] ? rounded(value, options[ROUNDS].value) : value;
}

static bool set_option(const char *text)
{
    for (int k = 0; k < OPTIONS; k++) {
        const size_t n = strlen(options[k].name);
        if (strncmp(text, options[k].name, n) != 0 || text[n] != '=')
            continue;
        options[k].value = (uint32_t)strtoul(text + n + 1, NULL, 10);
        return true;
    }
    return false;
}

// --- the picture ---

struct settings {
    uint32_t exposure, gain;
};

static struct settings settings_now(void)
{
    struct settings s = {rounded(controls[EXPOSURE].now, options[HIDES].value), controls[GAIN].now};
    if (controls[MODE].now != 1)
        s.exposure = controls[EXPOSURE].def; // what its automatic mode takes for right
    if (options[STUCK].value)
        s.exposure = options[STUCK].value;
    return s;
}

// A bright spot on a dim slope, and noise: no two frames are the same.
static void draw(const struct settings *s, uint8_t *out)
{
    static float scene[H][W];
    static uint32_t noise = 1;
    if (scene[0][0] == 0)
        for (int j = 0; j < H; j++)
            for (int i = 0; i < W; i++) {
                const double r2 = (i - 90.) * (i - 90.) + (j - 50.) * (j - 50.);
                scene[j][i] = (float)(PER_UNIT * (exp(-r2 / 800) + 1e-3 + 0.1 * i / W));
            }
    const float light = (float)s->exposure * (float)s->gain / (float)UNITY;
    for (int j = 0; j < H; j++)
        for (int i = 0; i < W; i++) {
            noise = noise * 1664525 + 1013904223;
            const int v = (int)(BLACK + light * scene[j][i]) + (int)(noise >> 29) +
                          (int)(noise >> 26 & 7) - 7;
            const uint16_t count = (uint16_t)(v < WHITE ? v : WHITE);
            memcpy(out + 2 * (j * W + i), &count, sizeof count);
        }
    const uint16_t truth[2] = {(uint16_t)s->exposure, (uint16_t)s->gain};
    memcpy(out, truth, sizeof truth);
}

struct transfer {
    struct usb_raw_ep_io io;
    uint8_t data[HEADER + FRAME];
};

static int gadget = -1, endpoint = -1;
static atomic_bool streaming, sending;
static _Atomic uint32_t interval = FASTEST;

static void *stream(void *ignored)
{
    static struct transfer t;
    struct settings history[HISTORY];
    struct timespec next = {0};
    for (int k = 0; k < HISTORY; k++)
        history[k] = settings_now();
    for (unsigned n = 0;; n++) {
        while (!streaming) {
            usleep(1000);
            clock_gettime(CLOCK_MONOTONIC, &next);
        }
        history[n % HISTORY] = settings_now(); // of the exposure that begins now
        next.tv_nsec += 100 * (long)interval;
        next.tv_sec += next.tv_nsec / 1000000000;
        next.tv_nsec %= 1000000000;
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL);
        draw(&history[(n - options[LATE].value) % HISTORY], t.data + HEADER);
        t.data[0] = HEADER;
        t.data[1] = (uint8_t)(UVC_STREAM_EOH | UVC_STREAM_EOF | n % 2);
        const bool cut = options[SHORT].value && n % options[SHORT].value == 0;
        t.io = (struct usb_raw_ep_io){.ep = (uint16_t)endpoint,
                                      .length = HEADER + FRAME - (cut ? FRAME / 3 : 0)};
        sending = true;
        if (streaming && ioctl(gadget, USB_RAW_IOCTL_EP_WRITE, &t) < 0)
            streaming = false; // nobody takes frames any more
        sending = false;
    }
    return ignored;
}

// --- endpoint 0 ---

static struct uvc_streaming_control rate(void)
{
    return (struct uvc_streaming_control){.bmHint = 1,
                                          .bFormatIndex = 1,
                                          .bFrameIndex = 1,
                                          .dwFrameInterval = interval,
                                          .dwMaxVideoFrameSize = FRAME,
                                          .dwMaxPayloadTransferSize = HEADER + FRAME};
}

static size_t give(uint8_t *data, const void *from, size_t n)
{
    memcpy(data, from, n);
    return n;
}

// The answer's bytes; 0: there is none.
static size_t answer(const struct usb_ctrlrequest *q, uint8_t *data)
{
    const struct control *c = control_at((uint8_t)(q->wIndex >> 8), (uint8_t)(q->wValue >> 8));
    const struct uvc_streaming_control r = rate();
    uint32_t number = 0;
    if (q->bRequestType == USB_DIR_IN && q->bRequest == USB_REQ_GET_DESCRIPTOR)
        return uvc_describe(q->wValue, data);
    if (q->bRequestType != (USB_DIR_IN | USB_TYPE_CLASS | USB_RECIP_INTERFACE))
        return 0;
    if (q->bRequest == UVC_GET_INFO && (c || q->wIndex == 1)) {
        data[0] = c ? c->info : 3;
        return 1;
    }
    if (q->wIndex == 1) // probe, commit: 26 bytes in UVC 1.0
        return give(data, &r, 26);
    return c && control_says(c, q->bRequest, &number) ? give(data, &number, c->size) : 0;
}

static bool sets(const struct usb_ctrlrequest *q, uint16_t index, uint8_t selector)
{
    return q->bRequestType == (USB_TYPE_CLASS | USB_RECIP_INTERFACE) &&
           q->bRequest == UVC_SET_CUR && q->wIndex == index && q->wValue >> 8 == selector;
}

static void heard(const struct usb_ctrlrequest *q, const uint8_t *data)
{
    struct uvc_streaming_control r = {0};
    uint32_t number = 0;
    for (int k = 0; k < CONTROLS; k++)
        if (sets(q, (uint16_t)(controls[k].entity << 8), controls[k].selector)) {
            memcpy(&number, data, controls[k].size);
            control_hears(&controls[k], number);
        }
    if (sets(q, 1, UVC_VS_PROBE_CONTROL) || sets(q, 1, UVC_VS_COMMIT_CONTROL)) {
        memcpy(&r, data, 26);
        interval = r.dwFrameInterval >= SLOWEST ? SLOWEST : FASTEST;
    }
    if (sets(q, 1, UVC_VS_COMMIT_CONTROL))
        streaming = true;
}

// A frame that nobody took when the last stream ended must not be the next one's first.
static void stop(pthread_t streamer)
{
    streaming = false;
    while (sending) {
        pthread_kill(streamer, SIGUSR1);
        usleep(1000);
    }
}

static void setup(const struct usb_ctrlrequest *q, pthread_t streamer)
{
    static struct transfer t;
    const bool in = q->bRequestType & USB_DIR_IN;
    const size_t n = in ? answer(q, t.data) : 0;
    t.io = (struct usb_raw_ep_io){.length = in && n < q->wLength ? (uint32_t)n : q->wLength};
    if (sets(q, 1, UVC_VS_COMMIT_CONTROL))
        stop(streamer);
    if (q->bRequestType == 0 && q->bRequest == USB_REQ_SET_CONFIGURATION && endpoint < 0) {
        endpoint = ioctl(gadget, USB_RAW_IOCTL_EP_ENABLE, &uvc_bulk);
        must(endpoint >= 0 && !ioctl(gadget, USB_RAW_IOCTL_CONFIGURE, 0), "endpoint");
    }
    if (in && !n)
        ioctl(gadget, USB_RAW_IOCTL_EP0_STALL, 0);
    else if (in)
        ioctl(gadget, USB_RAW_IOCTL_EP0_WRITE, &t);
    else if (ioctl(gadget, USB_RAW_IOCTL_EP0_READ, &t) >= 0)
        heard(q, t.data);
}

static void wake(int ignored)
{
    (void)ignored;
}

int main(int argc, char **argv)
{
    const struct sigaction interrupt = {.sa_handler = wake};
    struct usb_raw_init init = {.driver_name = "dummy_udc", .speed = USB_SPEED_HIGH};
    pthread_t streamer;
    for (int k = 2; k < argc; k++)
        if (!set_option(argv[k]))
            return 2;
    if (argc < 2)
        return 2;
    controls[EXPOSURE].step = options[STEP].value ? options[STEP].value : 1;
    controls[EXPOSURE].lo = controls[EXPOSURE].step;
    controls[EXPOSURE].info = options[ROUNDS].value ? 3 | 8 : 3;
    must(!sigaction(SIGUSR1, &interrupt, NULL), "sigaction");
    snprintf((char *)init.device_name, sizeof init.device_name, "%s", argv[1]);
    gadget = open("/dev/raw-gadget", O_RDWR | O_CLOEXEC);
    must(gadget >= 0, "/dev/raw-gadget");
    must(!ioctl(gadget, USB_RAW_IOCTL_INIT, &init) && !ioctl(gadget, USB_RAW_IOCTL_RUN, 0),
         argv[1]);
    must(!pthread_create(&streamer, NULL, stream, NULL), "thread");
    for (;;) {
        struct {
            struct usb_raw_event ev;
            struct usb_ctrlrequest setup;
        } got = {.ev = {.length = sizeof got.setup}};
        must(!ioctl(gadget, USB_RAW_IOCTL_EVENT_FETCH, &got), "event");
        if (got.ev.type == USB_RAW_EVENT_CONTROL)
            setup(&got.setup, streamer);
    }
}
