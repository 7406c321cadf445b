// gsf.c - Gwyddion Simple Field: "name = value" lines, NUL padding to a multiple of 4, float32.
//
// Names are identifiers, so that "nacre.version" is "nacre_version" in the file.
#define _GNU_SOURCE
#include "core/hcodec.h"
#include "core/infile.h"
#include "core/mem.h"
#include "core/meta_text.h"
#include <ctype.h>
#include <endian.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char MAGIC[] = "Gwyddion Simple Field 1.0";
enum { HEADER_MAX = 1 << 16 };

static char *trim(char *s)
{
    while (isspace((unsigned char)*s))
        s++;
    char *end = s + strlen(s);
    while (end > s && isspace((unsigned char)end[-1]))
        *--end = 0;
    return s;
}

// The text before the first NUL; leaves the file where the samples begin.
static char *read_header(FILE *f, struct err *e)
{
    char *text = xcalloc(HEADER_MAX, 1);
    size_t n = 0;
    for (int c; (c = getc(f)) > 0 && n < HEADER_MAX - 1;)
        text[n++] = (char)c;
    const bool is_gsf = !strncmp(text, MAGIC, sizeof MAGIC - 1);
    if (!is_gsf)
        err_set(e, ERR_DATA, "not a GSF file: must begin with '%s'", MAGIC);
    else if (feof(f) || n == HEADER_MAX - 1)
        err_set(e, ERR_DATA, "bad GSF header: it has no end (a NUL byte)");
    else if (!fseeko(f, (off_t)(n / 4 + 1) * 4, SEEK_SET))
        return text;
    free(text);
    return NULL;
}

static void parse_lines(char *text, struct meta *m)
{
    char *rest = strchr(text, '\n');
    for (char *line; rest && (line = strsep(&rest, "\n"));) {
        char *value = strchr(line, '=');
        if (!value)
            continue;
        *value++ = 0;
        line = trim(line);
        if (!strncmp(line, "nacre_", 6))
            line[5] = '.';
        meta_set_value(m, line, trim(value));
    }
}

static bool take_side(struct meta *m, const char *key, int *n, struct err *e)
{
    double v = NAN;
    if (!meta_num(m, key, &v))
        return err_set(e, ERR_DATA, "bad GSF header: no %s", key);
    if (!(v >= 2 && v <= IMAGE_MAX_SIDE && v == floor(v)))
        return err_set(e, ERR_DATA, "bad GSF header: %s is %g, must be 2 to %d", key, v,
                       IMAGE_MAX_SIDE);
    *n = (int)v;
    return true;
}

// The metres of one unit; 0 when the file states none.
static bool take_unit(struct meta *m, const char *key, double *metres, struct err *e)
{
    const char *unit = meta_text(m, key);
    *metres = 0;
    return !unit || !*unit || length_unit(key, unit, metres, e);
}

static bool take_grid(const struct infile *in, struct hfield *hf, struct meta *m,
                      const struct hfield_hints *hints, double *z_unit, struct err *e)
{
    int nx = 0, ny = 0;
    double xy_unit = 0, real[2] = {NAN, NAN}, offset[2] = {0, 0}, dx = 0, dy = 0;
    const bool told = hints && hints->dx_m > 0, scaled = hints && hints->z_scale_m > 0;
    if (!take_side(m, "XRes", &nx, e) || !take_side(m, "YRes", &ny, e) ||
        (!take_unit(m, "XYUnits", &xy_unit, e) && !told) ||
        (!take_unit(m, "ZUnits", z_unit, e) && !scaled))
        return false;
    if (*z_unit > 0 && scaled)
        return err_set(e, ERR_DATA, "the file states its height unit: leave out --z-scale");
    if (*z_unit == 0 && !scaled)
        return err_set(e, ERR_DATA, "the file states no height unit (ZUnits): give --z-scale");
    *z_unit = scaled ? hints->z_scale_m : *z_unit;
    if (xy_unit > 0 && meta_num(m, "XReal", &real[0]))
        real[0] = real[0] * xy_unit / nx;
    if (xy_unit > 0 && meta_num(m, "YReal", &real[1]))
        real[1] = real[1] * xy_unit / ny;
    if (xy_unit == 0)
        real[0] = real[1] = NAN;
    if (!hfield_spacing(hints, real[0], real[1], &dx, &dy, e) ||
        !infile_holds(in, 4.0 * nx * ny, e) || !hfield_init(hf, nx, ny, dx, dy, e))
        return false;
    const bool shifted = meta_num(m, "XOffset", &offset[0]) | meta_num(m, "YOffset", &offset[1]);
    if (shifted && xy_unit > 0)
        meta_set_nums(m, "nacre.offset_m", (double[]){offset[0] * xy_unit, offset[1] * xy_unit}, 2);
    static const char *const grid[] = {"XRes",    "YRes",    "XReal",   "YReal",
                                       "XOffset", "YOffset", "XYUnits", "ZUnits"};
    for (size_t k = 0; k < sizeof grid / sizeof *grid; k++)
        meta_drop(m, grid[k]);
    meta_copy(&hf->meta, m);
    return true;
}

static bool read_samples(struct infile *in, const struct hfield *hf, double z_unit, struct err *e)
{
    const size_t n = (size_t)hf->nx * (size_t)hf->ny;
    if (fread(hf->z, 4, n, in->f) != n)
        return err_errno(e, "cannot read");
    for (size_t k = 0; k < n; k++) {
        uint32_t bits;
        memcpy(&bits, hf->z + k, 4);
        bits = le32toh(bits);
        memcpy(hf->z + k, &bits, 4);
        if (z_unit != 1)
            hf->z[k] = (float)(z_unit * (double)hf->z[k]);
    }
    return true;
}

bool gsf_read(struct hfield *hf, const char *path, const struct hfield_hints *hints, struct err *e)
{
    struct infile in = {0};
    struct meta m = {0};
    double z_unit = 1;
    if (!infile_open(&in, path, e))
        return false;
    char *text = read_header(in.f, e);
    if (text)
        parse_lines(text, &m);
    const bool ok =
        text && take_grid(&in, hf, &m, hints, &z_unit, e) && read_samples(&in, hf, z_unit, e);
    free(text);
    meta_finish(&m);
    infile_close(&in);
    return ok;
}

static void write_meta(FILE *f, const struct meta *m)
{
    for (int k = 0; k < m->n; k++) {
        if (!strcmp(m->item[k].key, "nacre.offset_m"))
            continue;
        char *name = xstrdup(m->item[k].key), *value = meta_value_text(&m->item[k]);
        for (char *c = name; *c; c++)
            *c = isalnum((unsigned char)*c) ? *c : '_';
        fprintf(f, "%s = %s\n", name, value);
        free(name);
        free(value);
    }
}

// The shortest extent that gives this spacing back when it is read.
static char *extent_text(double spacing_m, int n, char buf[NUMBER_TEXT])
{
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(buf, NUMBER_TEXT, "%.*g", digits, spacing_m * n);
        if (strtod(buf, NULL) / n == spacing_m)
            break;
    }
    return buf;
}

bool gsf_write(const struct hfield *hf, const char *path, const struct hfield_hints *hints,
               struct err *e)
{
    (void)hints;
    FILE *f = fopen(path, "wbe");
    if (!f)
        return err_errno(e, "cannot write");
    char x[NUMBER_TEXT], y[NUMBER_TEXT];
    fprintf(f, "%s\nXRes = %d\nYRes = %d\nXReal = %s\nYReal = %s\nXYUnits = m\nZUnits = m\n", MAGIC,
            hf->nx, hf->ny, extent_text(hf->dx_m, hf->nx, x), extent_text(hf->dy_m, hf->ny, y));
    const struct meta_item *offset = meta_find(&hf->meta, "nacre.offset_m");
    if (offset && offset->n == 2)
        fprintf(f, "XOffset = %s\nYOffset = %s\n", number_text(offset->num[0], x),
                number_text(offset->num[1], y));
    write_meta(f, &hf->meta);
    const size_t pad = 4 - (size_t)ftello(f) % 4;
    fwrite("\0\0\0", 1, pad, f);
    for (size_t k = 0; k < (size_t)hf->nx * (size_t)hf->ny; k++) {
        uint32_t bits;
        memcpy(&bits, hf->z + k, 4);
        bits = htole32(bits);
        fwrite(&bits, 4, 1, f);
    }
    const bool written = !ferror(f);
    return (!fclose(f) && written) || err_errno(e, "cannot write");
}
