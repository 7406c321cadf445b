// uvc_describe.c - the bytes, by the specifications of USB 2.0 and UVC 1.0.
#include "tests/vm/uvc_describe.h"
#include <linux/usb/video.h>
#include <string.h>

enum { BULK_IN = USB_DIR_IN | 1 };

#define LE16(v) (v) & 0xff, (v) >> 8 & 0xff
#define LE32(v) LE16((v)&0xffff), LE16((v) >> 16 & 0xffff)

// clang-format off
static const uint8_t interfaces[] = {
    8, USB_DT_INTERFACE_ASSOCIATION, 0, 2, USB_CLASS_VIDEO, 3, 0, 0,
    // Control: camera with automatic mode, its priority, exposure; processing unit with gain; output.
    9, USB_DT_INTERFACE, 0, 0, 0, USB_CLASS_VIDEO, UVC_SC_VIDEOCONTROL, 0, 0,
    13, USB_DT_CS_INTERFACE, UVC_VC_HEADER, LE16(0x0100), LE16(13 + 18 + 11 + 9), LE32(48000000),
        1, 1,
    18, USB_DT_CS_INTERFACE, UVC_VC_INPUT_TERMINAL, CAMERA, LE16(UVC_ITT_CAMERA), 0, 0,
        LE16(0), LE16(0), LE16(0), 3, 0x0e, 0, 0,
    11, USB_DT_CS_INTERFACE, UVC_VC_PROCESSING_UNIT, PROCESSING, CAMERA, LE16(0), 2, 0, 2, 0,
    9, USB_DT_CS_INTERFACE, UVC_VC_OUTPUT_TERMINAL, OUTPUT, LE16(UVC_TT_STREAMING), 0,
        PROCESSING, 0,
    // Streaming: 16 bits grey, one size, two rates.
    9, USB_DT_INTERFACE, 1, 0, 1, USB_CLASS_VIDEO, UVC_SC_VIDEOSTREAMING, 0, 0,
    14, USB_DT_CS_INTERFACE, UVC_VS_INPUT_HEADER, 1, LE16(14 + 27 + 34), BULK_IN, 0, OUTPUT,
        0, 0, 0, 1, 0,
    27, USB_DT_CS_INTERFACE, UVC_VS_FORMAT_UNCOMPRESSED, 1, 1, 'Y', '1', '6', ' ', 0, 0, 0x10, 0,
        0x80, 0, 0, 0xaa, 0, 0x38, 0x9b, 0x71, 16, 1, 0, 0, 0, 0,
    34, USB_DT_CS_INTERFACE, UVC_VS_FRAME_UNCOMPRESSED, 1, 0, LE16(W), LE16(H),
        LE32(FRAME * 8 * 10), LE32(FRAME * 8 * 20), LE32(FRAME), LE32(FASTEST), 2,
        LE32(FASTEST), LE32(SLOWEST),
};
// clang-format on

static const struct usb_device_descriptor device = {
    .bLength = USB_DT_DEVICE_SIZE,
    .bDescriptorType = USB_DT_DEVICE,
    .bcdUSB = 0x0200,
    .bDeviceClass = USB_CLASS_MISC,
    .bDeviceSubClass = 2,
    .bDeviceProtocol = 1, // interfaces are associated
    .bMaxPacketSize0 = 64,
    .idVendor = 0x1d6b,
    .idProduct = 0x0102,
    .iProduct = 1,
    .iSerialNumber = 1,
    .bNumConfigurations = 1,
};

const struct usb_endpoint_descriptor uvc_bulk = {.bLength = USB_DT_ENDPOINT_SIZE,
                                                 .bDescriptorType = USB_DT_ENDPOINT,
                                                 .bEndpointAddress = BULK_IN,
                                                 .bmAttributes = USB_ENDPOINT_XFER_BULK,
                                                 .wMaxPacketSize = 512};

static size_t put(uint8_t *to, size_t at, const void *from, size_t n)
{
    memcpy(to + at, from, n);
    return at + n;
}

size_t uvc_describe(uint16_t value, uint8_t *data)
{
    static const uint8_t language[] = {4, USB_DT_STRING, 0x09, 0x04},
                         name[] = {12, USB_DT_STRING, 'N', 0, 'a', 0, 'c', 0, 'r', 0, 'e', 0};
    static const struct usb_config_descriptor config = {
        .bLength = USB_DT_CONFIG_SIZE,
        .bDescriptorType = USB_DT_CONFIG,
        .wTotalLength = USB_DT_CONFIG_SIZE + sizeof interfaces + USB_DT_ENDPOINT_SIZE,
        .bNumInterfaces = 2,
        .bConfigurationValue = 1,
        .bmAttributes = USB_CONFIG_ATT_ONE,
        .bMaxPower = 50,
    };
    switch (value >> 8) {
    case USB_DT_DEVICE: return put(data, 0, &device, USB_DT_DEVICE_SIZE);
    case USB_DT_CONFIG: {
        size_t n = put(data, 0, &config, USB_DT_CONFIG_SIZE);
        n = put(data, n, interfaces, sizeof interfaces);
        return put(data, n, &uvc_bulk, USB_DT_ENDPOINT_SIZE);
    }
    case USB_DT_STRING:
        return value & 0xff ? put(data, 0, name, sizeof name)
                            : put(data, 0, language, sizeof language);
    default: return 0;
    }
}
