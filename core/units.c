// units.c - parsing and printing quantities with units.
#define _GNU_SOURCE
#include "core/units.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct suffix {
    enum unit unit;
    const char *text;
    double si;
};

// Within a unit the printable ones come in falling order.
static const struct suffix suffixes[] = {
    {UNIT_M, "m", 1},
    {UNIT_M, "mm", 1e-3},
    {UNIT_M, "um", 1e-6},
    {UNIT_M, "nm", 1e-9},
    {UNIT_M, "pm", 1e-12},
    {UNIT_M, "\u00b5m", 1e-6},
    {UNIT_M, "\u03bcm", 1e-6},
    {UNIT_RAD, "deg", M_PI / 180},
    {UNIT_RAD, "rad", 1},
    {UNIT_RAD, "mrad", 1e-3},
    {UNIT_S, "s", 1},
    {UNIT_S, "ms", 1e-3},
    {UNIT_S, "us", 1e-6},
    {UNIT_S, "ns", 1e-9},
    {UNIT_S, "\u00b5s", 1e-6},
    {UNIT_S, "min", 60},
    {UNIT_S, "h", 3600},
    {UNIT_PER_M, "/mm", 1e3},
    {UNIT_PER_M, "/um", 1e6},
    {UNIT_PER_M, "/m", 1},
    {UNIT_PX, "px", 1},
    {UNIT_HZ, "Hz", 1},
    {UNIT_HZ, "kHz", 1e3},
    {UNIT_HZ, "MHz", 1e6},
    {UNIT_K, "K", 1},
    {UNIT_BYTES, "GB", 1e9},
    {UNIT_BYTES, "MB", 1e6},
    {UNIT_BYTES, "kB", 1e3},
    {UNIT_BYTES, "B", 1},
    {UNIT_BYTES, "KiB", 1024},
    {UNIT_BYTES, "MiB", 1048576},
    {UNIT_BYTES, "GiB", 1073741824},
};
enum { N_SUFFIXES = sizeof suffixes / sizeof *suffixes };

const char *unit_example(enum unit unit)
{
    switch (unit) {
    case UNIT_M: return "a length such as 530nm or 0.25um";
    case UNIT_RAD: return "an angle such as 13deg";
    case UNIT_S: return "a time such as 1/60s or 20ms";
    case UNIT_PER_M: return "lines per length such as 600/mm";
    case UNIT_PX: return "pixels such as 1.9px";
    case UNIT_HZ: return "a rate such as 30Hz";
    case UNIT_K: return "a temperature such as 300K";
    case UNIT_BYTES: return "a size such as 2GB";
    case UNIT_NONE: break;
    }
    return "a number such as 0.35";
}

bool quantity_parse(const char *text, enum unit unit, double *si, struct err *e)
{
    char *end;
    double value = strtod(text, &end);
    bool ok = end != text;
    if (ok && *end == '/' && strchr("0123456789.", end[1]) && end[1]) {
        const char *below = end + 1;
        value /= strtod(below, &end);
        ok = end != below;
    }
    while (ok && *end == ' ')
        end++;
    if (ok && *end) {
        ok = false;
        for (int k = 0; k < N_SUFFIXES && !ok; k++)
            if (suffixes[k].unit == unit && !strcmp(end, suffixes[k].text)) {
                value *= suffixes[k].si;
                ok = true;
            }
    }
    if (!ok || !isfinite(value))
        return err_set(e, ERR_USAGE, "'%.60s' is not %s", text, unit_example(unit));
    *si = value;
    return true;
}

char *quantity_text(double si, enum unit unit, char *buf, size_t size)
{
    const struct suffix *best = NULL;
    for (int k = 0; k < N_SUFFIXES && unit != UNIT_NONE; k++) {
        const struct suffix *s = &suffixes[k];
        if (s->unit != unit || (unsigned char)s->text[0] >= 0x80 || !strcmp(s->text, "pm"))
            continue;
        if (!best || (fabs(si) < 0.9995 * best->si && s->si < best->si))
            best = s;
    }
    if (!best)
        snprintf(buf, size, "%.4g", si);
    else
        snprintf(buf, size, "%.4g%s%s", si / best->si, best->text[0] == '/' ? "" : " ", best->text);
    return buf;
}
