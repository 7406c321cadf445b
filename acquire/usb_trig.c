// usb_trig.c - "usb:relay" and "usb:wheel": light lines on HID relay boards, and HID filter wheels.
//
// Plain control and interrupt transfers by libusb, so that no hidraw node and no kernel driver is
// needed; the bytes are those of hid_report.h.
#define _GNU_SOURCE
#include "acquire/clock.h"
#include "acquire/hardware.h"
#include "acquire/hid_report.h"
#include "acquire/mover.h"
#include "acquire/pulse.h"
#include "core/mem.h"
#include <libusb-1.0/libusb.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { TIMEOUT_MS = 300, GET_REPORT = 1, SET_REPORT = 9, OUTPUT = 2 << 8, FEATURE = 3 << 8 };
static const int64_t POLL_US = 50000;

enum kind { RELAY, WHEEL };
static const struct {
    const char *name, *what;
    uint16_t vendor, product;
} kinds[] = {
    {"relay", "relay board", 0x16c0, 0x05df},
    {"wheel", "filter wheel", 0x1278, 0x0920},
};

struct usb {
    struct trig base;
    char *kind_name, *serial, *port;
    int lines, positions;
    int64_t settle_ns, timeout_ns;

    enum kind kind;
    libusb_context *context;
    libusb_device_handle *device;
    uint8_t in, out; // endpoints; 0: reports go by control transfers
    uint32_t on;     // relays
    struct pulse pulse;
    struct mover mover;
};

static bool fault(const struct usb *u, const char *what, int rc, struct err *e)
{
    return err_set(e, ERR_DEVICE, "%s: %s: %s", kinds[u->kind].what, what,
                   rc == LIBUSB_ERROR_NO_DEVICE ? "it is gone (unplugged?)"
                   : rc == LIBUSB_ERROR_BUSY    ? "another program uses it"
                   : rc == LIBUSB_ERROR_ACCESS  ? "not allowed; install the udev rules"
                                                : libusb_strerror((enum libusb_error)rc));
}

// --- reports ---

static int set_report(struct usb *u, int type, uint8_t *bytes, int n)
{
    return libusb_control_transfer(u->device,
                                   LIBUSB_REQUEST_TYPE_CLASS | LIBUSB_RECIPIENT_INTERFACE,
                                   SET_REPORT, (uint16_t)type, 0, bytes, (uint16_t)n, TIMEOUT_MS);
}

static bool read_relays(struct usb *u, struct relay_state *s, struct err *e)
{
    uint8_t in[RELAY_REPORT];
    const int n = libusb_control_transfer(
        u->device, LIBUSB_ENDPOINT_IN | LIBUSB_REQUEST_TYPE_CLASS | LIBUSB_RECIPIENT_INTERFACE,
        GET_REPORT, FEATURE, 0, in, sizeof in, TIMEOUT_MS);
    if (n < 0)
        return fault(u, "read", n, e);
    return relay_read(in, n, s) || err_set(e, ERR_DEVICE, "relay board: answers like none");
}

static bool write_relays(struct usb *u, uint32_t to, struct err *e)
{
    uint8_t report[RELAY_MAX][RELAY_REPORT];
    struct relay_state s;
    const int n = relay_reports(u->on, to, u->base.caps.lines, report);
    for (int k = 0; k < n; k++) {
        const int rc = set_report(u, FEATURE, report[k], RELAY_REPORT);
        if (rc < 0)
            return fault(u, "write", rc, e);
    }
    if (n && !read_relays(u, &s, e))
        return false;
    if (n)
        u->on = s.on & ((1u << u->base.caps.lines) - 1);
    return u->on == to || err_set(e, ERR_DEVICE, "relay board: has 0x%x on, not 0x%x", u->on, to);
}

static bool ask_wheel(struct usb *u, uint8_t report[WHEEL_REPORT], struct wheel_state *s,
                      struct err *e)
{
    uint8_t in[64];
    int n = 0, rc;
    while (!libusb_interrupt_transfer(u->device, u->in, in, sizeof in, &n, 1))
        ; // answers to earlier questions
    if (u->out)
        rc = libusb_interrupt_transfer(u->device, u->out, report, WHEEL_REPORT, &n, TIMEOUT_MS);
    else
        rc = set_report(u, OUTPUT, report, WHEEL_REPORT);
    if (rc < 0)
        return fault(u, "write", rc, e);
    rc = libusb_interrupt_transfer(u->device, u->in, in, sizeof in, &n, TIMEOUT_MS);
    if (rc < 0)
        return fault(u, "read", rc, e);
    return wheel_read(in, n, s) || err_set(e, ERR_DEVICE, "filter wheel: answers like none");
}

// --- finding ---

static char *port_of(libusb_device *d)
{
    uint8_t port[7];
    const int n = libusb_get_port_numbers(d, port, sizeof port);
    char *text = xasprintf("%d", libusb_get_bus_number(d));
    for (int k = 0; k < n; k++) {
        char *longer = xasprintf("%s%c%d", text, k ? '.' : '-', port[k]);
        free(text);
        text = longer;
    }
    return text;
}

static bool is_kind(libusb_device *d, enum kind kind)
{
    struct libusb_device_descriptor about;
    return !libusb_get_device_descriptor(d, &about) && about.idVendor == kinds[kind].vendor &&
           about.idProduct == kinds[kind].product;
}

static void get_strings(libusb_device_handle *h, char product[64], char serial[64])
{
    struct libusb_device_descriptor about;
    *product = *serial = 0;
    if (libusb_get_device_descriptor(libusb_get_device(h), &about))
        return;
    libusb_get_string_descriptor_ascii(h, about.iProduct, (unsigned char *)product, 64);
    libusb_get_string_descriptor_ascii(h, about.iSerialNumber, (unsigned char *)serial, 64);
}

static bool take_interface(struct usb *u, struct err *e)
{
    struct libusb_config_descriptor *c = NULL;
    libusb_set_auto_detach_kernel_driver(u->device, 1);
    int rc = libusb_claim_interface(u->device, 0);
    if (rc < 0)
        return fault(u, "claim", rc, e);
    rc = libusb_get_active_config_descriptor(libusb_get_device(u->device), &c);
    if (rc < 0)
        return fault(u, "descriptor", rc, e);
    const struct libusb_interface_descriptor *i = c->interface[0].altsetting;
    for (int k = 0; k < i->bNumEndpoints; k++) {
        const uint8_t at = i->endpoint[k].bEndpointAddress;
        *(at & LIBUSB_ENDPOINT_IN ? &u->in : &u->out) = at;
    }
    libusb_free_config_descriptor(c);
    return u->kind == RELAY || u->in ||
           err_set(e, ERR_DEVICE, "filter wheel: has no interrupt endpoint");
}

// Opens `d` if it is the one that was asked for: by port, by the letters that a relay board
// answers with, or by the serial number.
static bool open_this(struct usb *u, libusb_device *d, struct err *e)
{
    char product[64], serial[64], *port = port_of(d);
    const bool here = !*u->port || !strcmp(u->port, port);
    free(port);
    if (!here)
        return false;
    const int rc = libusb_open(d, &u->device);
    if (rc < 0)
        return fault(u, "open", rc, e);
    get_strings(u->device, product, serial);
    bool ok = take_interface(u, e);
    struct relay_state s;
    if (ok && u->kind == RELAY) {
        u->base.caps.lines = u->lines ? u->lines : relay_count(product);
        ok = u->base.caps.lines ||
             err_set(e, ERR_DEVICE, "product '%s' is no relay board; or give lines=", product);
        if (ok && (ok = read_relays(u, &s, e)))
            strcpy(serial, s.letters);
    }
    if (ok && *u->serial && strcmp(u->serial, serial))
        ok = err_set(e, ERR_DEVICE, "serial=%s: there is only '%.60s'", u->serial, serial);
    if (!ok) {
        libusb_close(u->device);
        u->device = NULL;
    }
    return ok;
}

static bool open_any(struct usb *u, struct err *e)
{
    libusb_device **all = NULL;
    const int rc = libusb_init(&u->context);
    if (rc < 0) {
        u->context = NULL;
        return fault(u, "libusb", rc, e);
    }
    err_set(e, ERR_DEVICE, "no %s %04x:%04x%s%s is plugged in", kinds[u->kind].what,
            kinds[u->kind].vendor, kinds[u->kind].product, *u->port ? " at port " : "", u->port);
    const ssize_t n = libusb_get_device_list(u->context, &all);
    bool ok = false;
    for (ssize_t k = 0; k < n && !ok; k++)
        ok = is_kind(all[k], u->kind) && open_this(u, all[k], e);
    if (n >= 0)
        libusb_free_device_list(all, 1);
    return ok;
}

// --- relays ---

static void end_pulse(void *ctx)
{
    struct usb *u = ctx;
    struct err e;
    if (!write_relays(u, 0, &e))
        pulse_arm(&u->pulse, clock_boot_ns() + 10000000); // light must not stay on: try again
}

static bool open_relays(struct usb *u, struct err *e)
{
    struct trig *t = &u->base;
    u->on = UINT32_MAX; // whatever they are: the first write goes out
    t->caps.settle_ns = u->settle_ns;
    t->changed_ns = clock_boot_ns();
    return write_relays(u, 0, e) && pulse_init(&u->pulse, end_pulse, u, e);
}

// Closed for sure after the call and the relay's settling; open, as light goes, from the call on.
static bool switch_relays(struct usb *u, uint32_t mask, int64_t pulse_ns, struct err *e)
{
    struct trig *t = &u->base;
    pulse_lock(&u->pulse);
    const int64_t before = clock_boot_ns();
    const bool ok = write_relays(u, mask, e);
    const int64_t at = mask ? clock_boot_ns() + u->settle_ns : before;
    t->changed_ns = at > t->changed_ns ? at : t->changed_ns;
    t->ends_ns = t->changed_ns + pulse_ns;
    pulse_arm(&u->pulse, ok && pulse_ns ? t->ends_ns : 0);
    pulse_unlock(&u->pulse);
    return ok;
}

// --- wheels ---

static bool turn(struct trig *t, int position, struct err *e)
{
    struct usb *u = (struct usb *)t;
    uint8_t report[WHEEL_REPORT];
    struct wheel_state s;
    const int64_t until = clock_boot_ns() + u->timeout_ns;
    wheel_go(position, report);
    if (!ask_wheel(u, report, &s, e))
        return false;
    while (s.position != position) {
        if (mover_told(&u->mover))
            return false;
        if (clock_boot_ns() > until)
            return err_set(e, ERR_DEVICE, "filter wheel: did not reach position %d", position);
        usleep((useconds_t)POLL_US);
        wheel_ask(report);
        if (!ask_wheel(u, report, &s, e))
            return false;
    }
    return true;
}

// A wheel that was just plugged in does not know how many filters it has until it has turned once.
static bool count_filters(struct usb *u, struct err *e)
{
    uint8_t report[WHEEL_REPORT];
    struct wheel_state s;
    const int64_t until = clock_boot_ns() + u->timeout_ns;
    wheel_ask(report);
    if (!ask_wheel(u, report, &s, e))
        return false;
    if (!s.positions && s.position >= 0) {
        wheel_count(report);
        if (!ask_wheel(u, report, &s, e))
            return false;
    }
    while (!s.positions || s.position < 0) {
        if (clock_boot_ns() > until)
            return err_set(e, ERR_DEVICE, "filter wheel: does not say how many filters it has");
        usleep((useconds_t)POLL_US);
        wheel_ask(report);
        if (!ask_wheel(u, report, &s, e))
            return false;
    }
    u->base.caps.positions = s.positions;
    return true;
}

static bool open_wheel(struct usb *u, struct err *e)
{
    struct trig *t = &u->base;
    if (u->positions)
        t->caps.positions = u->positions;
    else if (!count_filters(u, e))
        return false;
    t->caps.settle_ns = u->timeout_ns;
    return mover_init(&u->mover, t, turn, e);
}

// --- the driver ---

static bool usb_open(struct trig *t, struct err *e)
{
    struct usb *u = (struct usb *)t;
    if (!strcmp(u->kind_name, "wheel"))
        u->kind = WHEEL;
    else if (strcmp(u->kind_name, "relay"))
        return err_set(e, ERR_DATA, "kind=%s: must be relay or wheel", u->kind_name);
    if (!open_any(u, e))
        return false;
    snprintf(t->caps.model, sizeof t->caps.model, "USB %s", kinds[u->kind].what);
    return u->kind == RELAY ? open_relays(u, e) : open_wheel(u, e);
}

static bool usb_set(struct trig *t, uint32_t state, struct err *e)
{
    struct usb *u = (struct usb *)t;
    if (u->kind == RELAY)
        return switch_relays(u, state, 0, e);
    mover_go(&u->mover, (int)state);
    return true;
}

static bool usb_pulse(struct trig *t, uint32_t mask, int64_t duration_ns, struct err *e)
{
    return switch_relays((struct usb *)t, mask, duration_ns, e);
}

static void usb_close(struct trig *t)
{
    struct usb *u = (struct usb *)t;
    struct err ignored;
    pulse_finish(&u->pulse);
    mover_finish(&u->mover);
    if (u->device && u->kind == RELAY)
        (void)write_relays(u, 0, &ignored);
    if (u->device) {
        libusb_release_interface(u->device, 0);
        libusb_close(u->device);
    }
    if (u->context)
        libusb_exit(u->context);
}

static void look(libusb_device *d, enum kind kind, found_fn *found, void *ctx)
{
    libusb_device_handle *h;
    char product[64] = "", serial[64] = "", *port = port_of(d);
    char *uri = xasprintf("usb:%s,port=%s", kinds[kind].name, port);
    const int rc = libusb_open(d, &h);
    if (!rc) {
        get_strings(h, product, serial);
        libusb_close(h);
    }
    char *what =
        xasprintf("%s %s%s%s", kinds[kind].what, product, *serial ? ", serial " : "", serial);
    found(ctx,
          &(struct found){uri, what,
                          !rc                         ? NULL
                          : rc == LIBUSB_ERROR_ACCESS ? "not allowed; install the udev rules"
                                                      : libusb_strerror((enum libusb_error)rc)});
    free(what);
    free(uri);
    free(port);
}

static void usb_find(found_fn *found, void *ctx)
{
    libusb_context *context;
    libusb_device **all = NULL;
    if (libusb_init(&context))
        return;
    const ssize_t n = libusb_get_device_list(context, &all);
    for (ssize_t k = 0; k < n; k++)
        for (enum kind kind = RELAY; kind <= WHEEL; kind++)
            if (is_kind(all[k], kind))
                look(all[k], kind, found, ctx);
    if (n >= 0)
        libusb_free_device_list(all, 1);
    libusb_exit(context);
}

#define AT(field) offsetof(struct usb, field)
static const struct devopt options[] = {
    {"kind", DEVOPT_TEXT, AT(kind_name), .def = "", .help = "relay (lights) or wheel (filters)"},
    {"serial", DEVOPT_TEXT, AT(serial), .def = "",
     .help = "which one: a relay board's five letters, a wheel's serial number"},
    {"port", DEVOPT_TEXT, AT(port), .def = "", .help = "or where it is plugged in, as 1-4.2"},
    {"lines", DEVOPT_INT, AT(lines), UNIT_NONE, 1, RELAY_MAX, NULL,
     "relays, instead of what the board's name says"},
    {"positions", DEVOPT_INT, AT(positions), UNIT_NONE, 1, WHEEL_MAX, NULL,
     "filters, instead of what the wheel says"},
    {"settle", DEVOPT_NS, AT(settle_ns), UNIT_S, 0, 10, "10ms",
     "from the order to a relay to full light"},
    {"timeout", DEVOPT_NS, AT(timeout_ns), UNIT_S, 1, 120, "15s", "longest turn of a wheel"},
    {0},
};

const struct trig_driver usb_trig = {
    .name = "usb",
    .summary = "HID relay boards (16c0:05df) for lights, HID filter wheels (1278:0920)",
    .size = sizeof(struct usb),
    .options = options,
    .open = usb_open,
    .set = usb_set,
    .pulse = usb_pulse,
    .close = usb_close,
    .find = usb_find,
};
