// gpiod_trig.c - "gpiod:gpiochip0,lines=17+27": light lines on GPIO pins, by libgpiod 1 or 2.
//
// The kernel leaves a line as it is when its holder dies; nacre-lights and the light's own cap see
// to that (acquire/lights.h). The two APIs differ in five functions, which come first.
#define _GNU_SOURCE
#include "acquire/clock.h"
#include "acquire/hardware.h"
#include "acquire/pulse.h"
#include "core/mem.h"
#include <errno.h>
#include <glob.h>
#include <gpiod.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINES = 32 };

struct gpio {
    struct trig base;
    char *chip_name, *names;
    int active_low;
    int64_t settle_ns;

    struct pulse pulse;
    struct gpiod_chip *chip;
    unsigned offset[LINES];
    int n;
#ifdef HAVE_GPIOD2
    struct gpiod_line_request *request;
#else
    struct gpiod_line_bulk lines;
    bool requested;
#endif
};

#ifdef HAVE_GPIOD2
static struct gpiod_chip *chip_open(const char *name)
{
    char *path = *name == '/' ? xstrdup(name) : xasprintf("/dev/%s", name);
    struct gpiod_chip *chip = gpiod_chip_open(path);
    free(path);
    return chip;
}

static int chip_line(struct gpiod_chip *chip, const char *name)
{
    return gpiod_chip_get_line_offset_from_name(chip, name);
}

static void chip_text(struct gpiod_chip *chip, char *text, size_t size)
{
    struct gpiod_chip_info *info = gpiod_chip_get_info(chip);
    snprintf(text, size, "%s, %zu lines", info ? gpiod_chip_info_get_label(info) : "?",
             info ? gpiod_chip_info_get_num_lines(info) : 0);
    gpiod_chip_info_free(info);
}

static bool request(struct gpio *g)
{
    struct gpiod_line_settings *s = gpiod_line_settings_new();
    struct gpiod_line_config *lines = gpiod_line_config_new();
    struct gpiod_request_config *who = gpiod_request_config_new();
    if (s && lines && who) {
        gpiod_line_settings_set_direction(s, GPIOD_LINE_DIRECTION_OUTPUT);
        gpiod_line_settings_set_output_value(s, GPIOD_LINE_VALUE_INACTIVE);
        gpiod_line_settings_set_active_low(s, g->active_low);
        gpiod_request_config_set_consumer(who, "nacre");
        if (!gpiod_line_config_add_line_settings(lines, g->offset, (size_t)g->n, s))
            g->request = gpiod_chip_request_lines(g->chip, who, lines);
    }
    const int why = errno;
    gpiod_line_settings_free(s);
    gpiod_line_config_free(lines);
    gpiod_request_config_free(who);
    errno = why;
    return g->request;
}

static bool write_lines(struct gpio *g, uint32_t mask)
{
    enum gpiod_line_value value[LINES];
    for (int k = 0; k < g->n; k++)
        value[k] = mask >> k & 1 ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE;
    return !gpiod_line_request_set_values(g->request, value);
}

static bool is_held(const struct gpio *g)
{
    return g->request;
}

static void release(struct gpio *g)
{
    gpiod_line_request_release(g->request);
}
#else
static struct gpiod_chip *chip_open(const char *name)
{
    return gpiod_chip_open_lookup(name);
}

static int chip_line(struct gpiod_chip *chip, const char *name)
{
    struct gpiod_line *line = gpiod_chip_find_line(chip, name);
    return line ? (int)gpiod_line_offset(line) : -1;
}

static void chip_text(struct gpiod_chip *chip, char *text, size_t size)
{
    snprintf(text, size, "%s, %u lines", gpiod_chip_label(chip), gpiod_chip_num_lines(chip));
}

static bool request(struct gpio *g)
{
    static const int off[LINES];
    const int flags = g->active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
    g->requested = !gpiod_chip_get_lines(g->chip, g->offset, (unsigned)g->n, &g->lines) &&
                   !gpiod_line_request_bulk_output_flags(&g->lines, "nacre", flags, off);
    return g->requested;
}

static bool write_lines(struct gpio *g, uint32_t mask)
{
    int value[LINES];
    for (int k = 0; k < g->n; k++)
        value[k] = mask >> k & 1;
    return !gpiod_line_set_value_bulk(&g->lines, value);
}

static bool is_held(const struct gpio *g)
{
    return g->requested;
}

static void release(struct gpio *g)
{
    gpiod_line_release_bulk(&g->lines);
}
#endif

static bool fault(const struct gpio *g, const char *what, struct err *e)
{
    return err_set(e, ERR_DEVICE, "%s: %s: %s", g->chip_name, what,
                   errno == ENODEV  ? "it is gone (unplugged?)"
                   : errno == EBUSY ? "another program holds it"
                                    : strerror(errno));
}

// "17+led": offsets or names.
static bool parse_lines(struct gpio *g, struct err *e)
{
    char *copy = xstrdup(g->names), *rest = copy;
    bool ok = *copy || err_set(e, ERR_DATA, "lines: name them, as in lines=17+27");
    for (char *name; ok && (name = strsep(&rest, "+"));) {
        char *end;
        const long number = strtol(name, &end, 10);
        const bool is_number = end != name && !*end;
        const int at = is_number ? (int)number : chip_line(g->chip, name);
        if (g->n == LINES)
            ok = err_set(e, ERR_DATA, "lines=%.100s: more than %d", g->names, LINES);
        else if (at < 0)
            ok = err_set(e, ERR_DATA, "lines: %s has no line '%.40s'", g->chip_name, name);
        for (int k = 0; ok && k < g->n; k++)
            if (g->offset[k] == (unsigned)at)
                ok = err_set(e, ERR_DATA, "lines: '%.40s' is there twice", name);
        if (ok)
            g->offset[g->n++] = (unsigned)at;
    }
    free(copy);
    return ok;
}

static void end_pulse(void *ctx)
{
    struct gpio *g = ctx;
    if (!write_lines(g, 0))
        pulse_arm(&g->pulse, clock_boot_ns() + 10000000); // light must not stay on: try again
}

static bool gpio_open(struct trig *t, struct err *e)
{
    struct gpio *g = (struct gpio *)t;
    if (!*g->chip_name)
        return err_set(e, ERR_DATA, "chip: name it, as in gpiod:gpiochip0,lines=17");
    if (!(g->chip = chip_open(g->chip_name)))
        return fault(g, "open", e);
    if (!parse_lines(g, e))
        return false;
    if (!request(g))
        return fault(g, "lines", e);
    snprintf(t->caps.model, sizeof t->caps.model, "GPIO lines of %.40s", g->chip_name);
    t->caps.lines = g->n;
    t->caps.settle_ns = g->settle_ns;
    t->changed_ns = clock_boot_ns();
    return pulse_init(&g->pulse, end_pulse, g, e);
}

// A line that goes on is on for sure after the call and its settling; one that goes off is so from
// the call on.
static bool switch_to(struct gpio *g, uint32_t mask, int64_t pulse_ns, struct err *e)
{
    struct trig *t = &g->base;
    pulse_lock(&g->pulse);
    const int64_t before = clock_boot_ns();
    const bool ok = write_lines(g, mask) || fault(g, "lines", e);
    const int64_t at = mask ? clock_boot_ns() + g->settle_ns : before;
    t->changed_ns = at > t->changed_ns ? at : t->changed_ns;
    t->ends_ns = t->changed_ns + pulse_ns;
    pulse_arm(&g->pulse, ok && pulse_ns ? t->ends_ns : 0);
    pulse_unlock(&g->pulse);
    return ok;
}

static bool gpio_set(struct trig *t, uint32_t mask, struct err *e)
{
    return switch_to((struct gpio *)t, mask, 0, e);
}

static bool gpio_pulse(struct trig *t, uint32_t mask, int64_t duration_ns, struct err *e)
{
    return switch_to((struct gpio *)t, mask, duration_ns, e);
}

static void gpio_close(struct trig *t)
{
    struct gpio *g = (struct gpio *)t;
    pulse_finish(&g->pulse);
    if (is_held(g)) {
        (void)write_lines(g, 0);
        release(g);
    }
    if (g->chip)
        gpiod_chip_close(g->chip);
}

static void gpio_find(found_fn *found, void *ctx)
{
    glob_t all;
    if (glob("/dev/gpiochip*", 0, NULL, &all))
        return;
    for (size_t k = 0; k < all.gl_pathc; k++) {
        char *uri = xasprintf("gpiod:%s,lines=", all.gl_pathv[k] + strlen("/dev/")), text[80];
        struct gpiod_chip *chip = chip_open(all.gl_pathv[k]);
        if (chip) {
            chip_text(chip, text, sizeof text);
            gpiod_chip_close(chip);
            found(ctx, &(struct found){uri, text, NULL});
        } else {
            found(ctx, &(struct found){uri, "GPIO chip",
                                       errno == EACCES
                                           ? "install the udev rules, or join the group 'gpio'"
                                           : strerror(errno)});
        }
        free(uri);
    }
    globfree(&all);
}

#define AT(field) offsetof(struct gpio, field)
static const struct devopt options[] = {
    {"chip", DEVOPT_TEXT, AT(chip_name), .def = "", .help = "gpiochip0, or a path"},
    {"lines", DEVOPT_TEXT, AT(names), .def = "",
     .help = "offsets or names, in the order of the rig's lines: 17+27 or led+flash"},
    {"active-low", DEVOPT_INT, AT(active_low), UNIT_NONE, 0, 1, "0", "1: low is on"},
    {"settle", DEVOPT_NS, AT(settle_ns), UNIT_S, 0, 10, "0", "from the switch to full light"},
    {0},
};

const struct trig_driver gpiod_trig = {
    .name = "gpiod",
    .summary = "light lines on GPIO pins",
    .size = sizeof(struct gpio),
    .options = options,
    .open = gpio_open,
    .set = gpio_set,
    .pulse = gpio_pulse,
    .close = gpio_close,
    .find = gpio_find,
};
