// nanoscope.c - Bruker (Digital Instruments) Nanoscope scans, version 4.3 and later.
//
// A text header of "\Key: value" lines in sections, then int16 or int32 samples, last row first.
// Height = sample / 2^(bits) * hard scale (V, "@2:Z scale") * sensitivity (nm/V, "@Sens. ...").
#define _GNU_SOURCE
#include "core/hcodec.h"
#include "core/image.h"
#include "core/infile.h"
#include <endian.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { VALUE = 160 };

// The value of "\key: " between two places of the header; "" when it is not there.
static const char *field(const char *from, const char *to, const char *key, char value[VALUE])
{
    const size_t len = strlen(key);
    *value = 0;
    for (const char *at = from; (at = memchr(at, '\\', (size_t)(to - at))); at++) {
        if ((size_t)(to - at) < len + 3 || strncmp(at + 1, key, len) || at[1 + len] != ':')
            continue;
        const char *v = at + len + 2 + strspn(at + len + 2, " ");
        snprintf(value, VALUE, "%.*s", (int)strcspn(v, "\r\n"), v);
        break;
    }
    return value;
}

static bool whole(const char *from, const char *to, const char *key, double lo, double hi,
                  double *v, struct err *e)
{
    char text[VALUE], *end;
    *v = strtod(field(from, to, key, text), &end);
    if (end == text || !(*v >= lo && *v <= hi && *v == floor(*v)))
        return err_set(e, ERR_DATA, "bad Nanoscope header: '%s' is '%.40s', must be %.0f to %.0f",
                       key, text, lo, hi);
    return true;
}

// The section of the first channel that holds heights.
static const char *find_height(const char *header, const char **end, struct err *e)
{
    static const char SECTION[] = "\\*Ciao image list";
    char seen[VALUE] = "";
    const char *at = strstr(header, SECTION);
    while (at) {
        char value[VALUE], name[64] = "";
        const char *next = strstr(at + 1, "\\*");
        *end = next ? next : at + strlen(at);
        sscanf(field(at, *end, "@2:Image Data", value), "S [%63[^]]]", name);
        if (!strncasecmp(name, "Height", 6) || !strcasecmp(name, "ZSensor"))
            return at;
        snprintf(seen + strlen(seen), sizeof seen - strlen(seen), " %s", *name ? name : "?");
        at = strstr(at + 1, SECTION);
    }
    err_set(e, ERR_DATA, "no height channel: must be Height or ZSensor, has%s",
            *seen ? seen : " none");
    return NULL;
}

// Extent in metres: "10 10 ~m", "10000 nm" (then pixels are square).
static bool extent(const char *text, int nx, int ny, double size_m[2], struct err *e)
{
    char unit[16] = "";
    double metres;
    const bool both = sscanf(text, "%lf %lf %15s", &size_m[0], &size_m[1], unit) == 3;
    if (!both && sscanf(text, "%lf %15s", &size_m[0], unit) != 2)
        return err_set(e, ERR_DATA, "bad Nanoscope header: 'Scan Size' is '%.40s'", text);
    if (!length_unit("Scan Size", unit, &metres, e))
        return false;
    size_m[0] *= metres;
    size_m[1] = both ? size_m[1] * metres : size_m[0] * ny / nx;
    return true;
}

// Metres of a sample that fills the converter's range.
static bool full_scale(const char *header, const char *from, const char *to, double *metres,
                       struct err *e)
{
    char value[VALUE], name[80] = "", key[96], unit[16] = "", hard_unit[16] = "";
    double hard, soft, unit_m;
    const char *end = header + strlen(header);
    if (sscanf(field(from, to, "@2:Z scale", value), "V [%79[^]]] (%*[^)]) %lf %15s", name, &hard,
               hard_unit) != 3 ||
        (strcmp(hard_unit, "V") && strcmp(hard_unit, "mV")))
        return err_set(e, ERR_DATA, "bad Nanoscope header: '@2:Z scale' is '%.60s'", value);
    snprintf(key, sizeof key, "@%s", name);
    if (sscanf(field(header, end, key, value), "V %lf %15[^/]/V", &soft, unit) != 2)
        return err_set(e, ERR_DATA,
                       "bad Nanoscope header: '%s' is '%.60s', must be such as V 20 nm/V", key,
                       value);
    if (!length_unit(key, unit, &unit_m, e))
        return false;
    *metres = hard * (strcmp(hard_unit, "mV") ? 1 : 1e-3) * soft * unit_m;
    return isfinite(*metres) ||
           err_set(e, ERR_DATA, "bad Nanoscope header: height scale %g m", *metres);
}

static void take_rows(struct hfield *hf, const char *data, int bytes, double scale_m)
{
    for (int j = 0; j < hf->ny; j++)
        for (int i = 0; i < hf->nx; i++) {
            const size_t row = (size_t)(hf->ny - 1 - j);
            const char *from = data + (row * (size_t)hf->nx + (size_t)i) * (size_t)bytes;
            uint16_t half;
            uint32_t word;
            double v;
            if (bytes == 2) {
                memcpy(&half, from, 2);
                v = ldexp((int16_t)le16toh(half), -16);
            } else {
                memcpy(&word, from, 4);
                v = ldexp((int32_t)le32toh(word), -32);
            }
            hf->z[(size_t)j * (size_t)hf->nx + (size_t)i] = (float)(v * scale_m);
        }
}

static bool read_scan(const char *data, size_t size, struct hfield *hf,
                      const struct hfield_hints *hints, struct err *e)
{
    if (strncasecmp(data, "\\*File list", 11))
        return err_set(e, ERR_DATA, "not a Nanoscope file: must begin with '\\*File list'");
    if (hints && hints->z_scale_m > 0)
        return err_set(e, ERR_DATA, "a Nanoscope file has its height unit: leave out --z-scale");
    const char *to, *from = find_height(data, &to, e);
    double nx, ny, offset, length, size_m[2], scale_m = 0, dx = 0, dy = 0;
    char value[VALUE];
    if (!from || !whole(from, to, "Samps/line", 2, IMAGE_MAX_SIDE, &nx, e) ||
        !whole(from, to, "Number of lines", 2, IMAGE_MAX_SIDE, &ny, e) ||
        !whole(from, to, "Data offset", 1, (double)size, &offset, e) ||
        !whole(from, to, "Data length", 1, (double)INT64_MAX, &length, e) ||
        !extent(field(from, to, "Scan Size", value), (int)nx, (int)ny, size_m, e) ||
        !full_scale(data, from, to, &scale_m, e))
        return false;
    // Since version 9.2 files may say 2 bytes and hold 4: the length knows.
    const int bytes = length == 4 * nx * ny ? 4 : 2;
    if (length != bytes * nx * ny)
        return err_set(e, ERR_DATA, "%.0f bytes of samples, must be 2 or 4 times %.0f x %.0f",
                       length, nx, ny);
    if (offset + length > (double)size)
        return err_set(e, ERR_DATA, "cut short: samples end at byte %.0f, the file at %zu",
                       offset + length, size);
    if (!hfield_spacing(hints, size_m[0] / nx, size_m[1] / ny, &dx, &dy, e) ||
        !hfield_init(hf, (int)nx, (int)ny, dx, dy, e))
        return false;
    take_rows(hf, data + (size_t)offset, bytes, scale_m);
    return true;
}

bool nanoscope_read(struct hfield *hf, const char *path, const struct hfield_hints *hints,
                    struct err *e)
{
    size_t size = 0;
    char *data = infile_slurp(path, (int64_t)1 << 32, &size, e);
    const bool ok = data && read_scan(data, size, hf, hints, e);
    free(data);
    return ok;
}
