// hid_device.c - acts a relay board or a filter wheel: "hid_device relay|wheel FUNCTIONFS".
//
// The USB side of a HID device in user space, by the kernel's FunctionFS: descriptors, then
// requests on endpoint 0 as the host makes them. Goes into the background when it is ready. Written
// from the makers' documents, not from our driver.
#define _GNU_SOURCE
#include <endian.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/hid.h>
#include <linux/usb/functionfs.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { RELAYS = 4, FILTERS = 5, FEATURE = 3, OUTPUT = 2 };

static const uint8_t relay_report[] = {
    0x06, 0x00, 0xff, 0x09, 0x01, 0xa1, 0x01, 0x15, 0x00, 0x26, 0xff, 0x00, // vendor page, 0 to 255
    0x75, 0x08, 0x95, 0x08, 0x09, 0x00, 0xb2, 0x02, 0x01, 0xc0,             // 8 bytes, feature
};
static const uint8_t wheel_report[] = {
    0x06, 0x00, 0xff, 0x09, 0x01, 0xa1, 0x01, 0x15, 0x00, 0x26,
    0xff, 0x00, 0x75, 0x08, 0x95, 0x02, 0x09, 0x02, 0x81, 0x02, // 2 bytes, input
    0x95, 0x02, 0x09, 0x03, 0x91, 0x02, 0xc0,                   // 2 bytes, output
};

struct hid_about {
    uint8_t bLength, bDescriptorType;
    uint16_t bcdHID;
    uint8_t bCountryCode, bNumDescriptors, bReportType;
    uint16_t wReportLength;
} __attribute__((packed));

struct one_speed {
    struct usb_interface_descriptor interface;
    struct hid_about hid;
    struct usb_endpoint_descriptor_no_audio in;
} __attribute__((packed));

static struct {
    struct usb_functionfs_descs_head_v2 head;
    uint32_t full_count, high_count;
    struct one_speed full, high;
} __attribute__((packed)) descriptors;

static const struct {
    struct usb_functionfs_strings_head head;
    uint16_t language;
    char text[4];
} __attribute__((packed)) strings = {
    .head = {.magic = FUNCTIONFS_STRINGS_MAGIC,
             .length = sizeof strings,
             .str_count = 1,
             .lang_count = 1},
    .language = 0x0409,
    .text = "HID",
};

static struct one_speed speed(size_t report_bytes)
{
    return (struct one_speed){
        .interface = {.bLength = sizeof(struct usb_interface_descriptor),
                      .bDescriptorType = USB_DT_INTERFACE,
                      .bNumEndpoints = 1,
                      .bInterfaceClass = USB_CLASS_HID,
                      .iInterface = 1},
        .hid = {sizeof(struct hid_about), HID_DT_HID, 0x0101, 0, 1, HID_DT_REPORT,
                (uint16_t)report_bytes},
        .in = {.bLength = sizeof(struct usb_endpoint_descriptor_no_audio),
               .bDescriptorType = USB_DT_ENDPOINT,
               .bEndpointAddress = 1 | USB_DIR_IN,
               .bmAttributes = USB_ENDPOINT_XFER_INT,
               .wMaxPacketSize = 8,
               .bInterval = 4},
    };
}

static void must(bool ok, const char *what)
{
    if (!ok) {
        perror(what);
        exit(1);
    }
}

// --- the devices ---

static bool is_wheel;
static uint8_t relays;
static int position = 1, target = 1, filters; // filters: 0 until it has counted them
static struct timespec arrival;

static bool has_arrived(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec > arrival.tv_sec ||
           (now.tv_sec == arrival.tv_sec && now.tv_nsec >= arrival.tv_nsec);
}

static void move_for(int ms)
{
    clock_gettime(CLOCK_MONOTONIC, &arrival);
    const long ns = arrival.tv_nsec + ms * 1000000L;
    arrival.tv_sec += ns / 1000000000;
    arrival.tv_nsec = ns % 1000000000;
}

static void relay_hears(const uint8_t *r)
{
    const uint8_t one = (uint8_t)(r[1] >= 1 && r[1] <= RELAYS ? 1 << (r[1] - 1) : 0);
    switch (r[0]) {
    case 0xff: relays |= one; break;
    case 0xfd: relays &= (uint8_t)~one; break;
    case 0xfe: relays = (1 << RELAYS) - 1; break;
    case 0xfc: relays = 0; break;
    }
}

static void wheel_hears(const uint8_t *r, uint8_t answer[2])
{
    if (has_arrived()) {
        position = target;
        if (filters < 0)
            filters = FILTERS;
    }
    if (r[0] >= 1 && r[0] != position) {
        target = r[0] > FILTERS ? FILTERS : r[0];
        move_for(80);
    } else if (r[0] == 0 && r[1] == 1) {
        filters = -1; // counting
        target = 1;
        move_for(300);
    }
    answer[0] = has_arrived() ? (uint8_t)position : 0;
    answer[1] = filters > 0 ? (uint8_t)filters : 0;
}

// --- endpoint 0 ---

static void control(int ep0, int ep1, const struct usb_ctrlrequest *q)
{
    const uint8_t *report = is_wheel ? wheel_report : relay_report;
    const size_t report_bytes = is_wheel ? sizeof wheel_report : sizeof relay_report;
    const uint16_t length = le16toh(q->wLength), value = le16toh(q->wValue);
    uint8_t data[64] = {0};
    if (q->bRequestType == (USB_DIR_IN | USB_RECIP_INTERFACE) &&
        q->bRequest == USB_REQ_GET_DESCRIPTOR && value >> 8 == HID_DT_REPORT) {
        (void)!write(ep0, report, length < report_bytes ? length : report_bytes);
    } else if (q->bRequestType == (USB_DIR_IN | USB_TYPE_CLASS | USB_RECIP_INTERFACE) &&
               q->bRequest == HID_REQ_GET_REPORT && !is_wheel && value >> 8 == FEATURE) {
        memcpy(data, "NACRE", 5);
        data[7] = relays;
        (void)!write(ep0, data, length < 8 ? length : 8);
    } else if (q->bRequestType == (USB_TYPE_CLASS | USB_RECIP_INTERFACE) &&
               q->bRequest == HID_REQ_SET_REPORT && length <= sizeof data) {
        must(read(ep0, data, length) == length, "report");
        if (!is_wheel && value >> 8 == FEATURE) {
            relay_hears(data);
        } else if (is_wheel && value >> 8 == OUTPUT) {
            uint8_t answer[2];
            wheel_hears(data, answer);
            must(write(ep1, answer, 2) == 2, "answer");
        }
    } else if (q->bRequestType & USB_DIR_IN) { // a read in the wrong direction stalls
        (void)!read(ep0, data, 0);
    } else if (length == 0) { // SET_IDLE
        (void)!read(ep0, data, 0);
    } else {
        (void)!write(ep0, data, 0);
    }
}

int main(int argc, char **argv)
{
    char path[200];
    if (argc != 3)
        return 2;
    is_wheel = !strcmp(argv[1], "wheel");
    snprintf(path, sizeof path, "%s/ep0", argv[2]);
    const int ep0 = open(path, O_RDWR);
    must(ep0 >= 0, path);
    const size_t report_bytes = is_wheel ? sizeof wheel_report : sizeof relay_report;
    descriptors.head.magic = FUNCTIONFS_DESCRIPTORS_MAGIC_V2;
    descriptors.head.length = sizeof descriptors;
    descriptors.head.flags = FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC;
    descriptors.full_count = descriptors.high_count = 3;
    descriptors.full = descriptors.high = speed(report_bytes);
    must(write(ep0, &descriptors, sizeof descriptors) == sizeof descriptors, "descriptors");
    must(write(ep0, &strings, sizeof strings) == sizeof strings, "strings");
    snprintf(path, sizeof path, "%s/ep1", argv[2]);
    const int ep1 = open(path, O_RDWR);
    must(ep1 >= 0, path);
    must(!daemon(1, 1), "daemon"); // whoever waits for this program knows now that it is ready
    for (;;) {
        struct usb_functionfs_event ev;
        const ssize_t n = read(ep0, &ev, sizeof ev);
        if (n < 0 && errno == EINTR)
            continue;
        must(n == sizeof ev, "event");
        if (ev.type == FUNCTIONFS_SETUP)
            control(ep0, ep1, &ev.u.setup);
    }
}
