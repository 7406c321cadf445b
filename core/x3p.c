// x3p.c - X3P surfaces (ISO 25178-72, once ISO 5436-2): a zip of main.xml, samples, checksums.
//
// Everything is in metres. Samples are int16 (I), int32 (L), float32 (F) or float64 (D), x fastest;
// integers are multiples of CZ's increment. Missing nodes are NaN or a zero bit in the valid-points
// file.
#define _GNU_SOURCE
#include "core/x3p.h"
#include "core/hcodec.h"
#include "core/infile.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/meta_text.h"
#include "core/sha256.h"
#include <endian.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <time.h>
#include <zip.h>

struct member { // a file inside the zip
    char *data; // owned, a zero byte behind it
    size_t size;
};

static bool read_member(zip_t *z, const char *name, double max, struct member *m, struct err *e)
{
    zip_stat_t st;
    if (zip_stat(z, name, 0, &st) || !(st.valid & ZIP_STAT_SIZE))
        return err_set(e, ERR_DATA, "no '%.100s' inside", name);
    if ((double)st.size > max)
        return err_set(e, ERR_DATA, "'%.100s' has %.0f bytes, must be at most %.0f", name,
                       (double)st.size, max);
    zip_file_t *f = zip_fopen(z, name, 0);
    m->size = (size_t)st.size;
    m->data = malloc(m->size + 1);
    const bool ok = f && m->data && zip_fread(f, m->data, m->size) == (zip_int64_t)m->size &&
                    zip_fread(f, m->data + m->size, 1) == 0; // the end: here the CRC is judged
    if (f)
        zip_fclose(f);
    if (!ok) {
        free(m->data);
        *m = (struct member){0};
        return err_set(e, ERR_DATA, "damaged: '%.100s' cannot be unpacked", name);
    }
    m->data[m->size] = 0;
    return true;
}

static bool check_md5(const struct member *m, const char *name, const char *want, struct err *e)
{
    char hex[MD5_TEXT];
    md5_of(m->data, m->size, hex);
    return strlen(want) != MD5_TEXT - 1 || !*hex || !strcasecmp(want, hex) ||
           err_set(e, ERR_DATA, "damaged: '%.100s' does not have the MD5 that main.xml states",
                   name);
}

// md5checksum.hex: "<32 digits> *main.xml". Some writers get it wrong: a note, not a refusal.
static void check_document(zip_t *z, const struct x3p_doc *d, const struct member *xml)
{
    struct member sum = {0};
    struct err ignored;
    char hex[MD5_TEXT];
    if (!*d->checksum_link || !read_member(z, d->checksum_link, 4096, &sum, &ignored))
        return;
    md5_of(xml->data, xml->size, hex);
    if (strncasecmp(sum.data, hex, MD5_TEXT - 1))
        log_warn("main.xml inside does not have the MD5 of %s", d->checksum_link);
    free(sum.data);
}

static bool number(const char *what, const char *text, double *v, struct err *e)
{
    char *end;
    *v = strtod(text, &end);
    return (*text && !*end && isfinite(*v)) ||
           err_set(e, ERR_DATA, "main.xml: %s is '%.30s', must be a number", what, text);
}

static bool side(const char *what, const char *text, int *n, struct err *e)
{
    double v;
    if (!number(what, text, &v, e))
        return false;
    if (!(v >= 2 && v <= IMAGE_MAX_SIDE && v == floor(v)))
        return err_set(e, ERR_DATA, "main.xml: %s is %g, must be 2 to %d", what, v, IMAGE_MAX_SIDE);
    *n = (int)v;
    return true;
}

struct layout {
    int nx, ny;
    double dx_m, dy_m, offset_m[2], z_step_m, z_offset_m;
    char type; // I, L, F, D
    size_t sample_size;
};

static bool get_layout(const struct x3p_doc *d, struct layout *l, struct err *e)
{
    if (strcmp(d->feature, "SUR"))
        return err_set(e, ERR_DATA, "main.xml: feature type '%s': must be SUR (a surface)",
                       d->feature);
    if (strcmp(d->x_axis, "I") || strcmp(d->y_axis, "I") || strcmp(d->z_axis, "A"))
        return err_set(e, ERR_DATA, "main.xml: axis types '%s', '%s', '%s': must be I, I, A",
                       d->x_axis, d->y_axis, d->z_axis);
    static const struct {
        char type;
        size_t size;
    } types[] = {{'I', 2}, {'L', 4}, {'F', 4}, {'D', 8}};
    *l = (struct layout){.type = strlen(d->z_type) == 1 ? *d->z_type : 0, .z_step_m = 1};
    for (size_t k = 0; k < 4; k++)
        if (types[k].type == l->type)
            l->sample_size = types[k].size;
    if (!l->sample_size)
        return err_set(e, ERR_DATA, "main.xml: data type '%s': must be I, L, F or D", d->z_type);
    double layers = 1;
    if (!side("SizeX", d->nx, &l->nx, e) || !side("SizeY", d->ny, &l->ny, e) ||
        (*d->nz && !number("SizeZ", d->nz, &layers, e)) ||
        !number("CX increment", d->dx, &l->dx_m, e) ||
        !number("CY increment", d->dy, &l->dy_m, e) ||
        (*d->dz && !number("CZ increment", d->dz, &l->z_step_m, e)) ||
        (*d->x_offset && !number("CX offset", d->x_offset, &l->offset_m[0], e)) ||
        (*d->y_offset && !number("CY offset", d->y_offset, &l->offset_m[1], e)) ||
        (*d->z_offset && !number("CZ offset", d->z_offset, &l->z_offset_m, e)))
        return false;
    if (layers != 1)
        return err_set(e, ERR_DATA, "main.xml: %g layers (SizeZ): must be 1", layers);
    if (d->has_list || !*d->data_link)
        return err_set(e, ERR_DATA, "samples inside main.xml are not supported: must be a link");
    if (!*d->dz && (l->type == 'I' || l->type == 'L'))
        return err_set(e, ERR_DATA, "main.xml: integer heights without a CZ increment");
    return true;
}

static double sample(const struct layout *l, const char *data, size_t k)
{
    uint64_t bits = 0;
    memcpy(&bits, data + k * l->sample_size, l->sample_size);
    bits = le64toh(bits);
    const uint32_t low = (uint32_t)bits;
    float f;
    double d;
    switch (l->type) {
    case 'I': return (int16_t)(uint16_t)low;
    case 'L': return (int32_t)low;
    case 'F': memcpy(&f, &low, sizeof f); return (double)f;
    default: memcpy(&d, &bits, sizeof d); return d;
    }
}

static bool fill(struct hfield *hf, const struct layout *l, const struct member *data,
                 const struct member *valid, struct err *e)
{
    const size_t n = (size_t)l->nx * (size_t)l->ny;
    if (data->size != n * l->sample_size)
        return err_set(e, ERR_DATA, "%zu bytes of samples, must be %zu for %d x %d", data->size,
                       n * l->sample_size, l->nx, l->ny);
    if (valid->data && valid->size < (n + 7) / 8)
        return err_set(e, ERR_DATA, "%zu bytes of valid points, must be %zu", valid->size,
                       (n + 7) / 8);
    for (size_t k = 0; k < n; k++) {
        const bool measured = !valid->data || ((unsigned char)valid->data[k / 8] >> k % 8 & 1);
        const double z = sample(l, data->data, k) * l->z_step_m + l->z_offset_m;
        hf->z[k] = measured ? (float)z : NAN;
    }
    return true;
}

static void take_comment(struct meta *m, char *comment)
{
    for (char *rest = comment, *line; (line = strsep(&rest, "\n"));) {
        char *equal = strstr(line, " = ");
        if (!equal || equal == line || strcspn(line, " \t") < (size_t)(equal - line))
            continue; // not one of our lines
        *equal = 0;
        meta_set_value(m, line, equal + 3);
    }
}

static bool read_surface(zip_t *z, struct hfield *hf, const struct hfield_hints *hints,
                         int64_t file_size, struct err *e)
{
    struct member xml = {0}, data = {0}, valid = {0};
    struct x3p_doc *doc = xcalloc(1, sizeof *doc);
    struct layout l;
    double dx = 0, dy = 0;
    bool ok = read_member(z, "main.xml", 1 << 20, &xml, e) &&
              x3p_doc_parse(doc, xml.data, xml.size, e) && get_layout(doc, &l, e);
    if (ok)
        check_document(z, doc, &xml);
    if (ok && hints && hints->z_scale_m > 0)
        ok = err_set(e, ERR_DATA, "an X3P file is in metres: leave out --z-scale");
    ok = ok && infile_claim(file_size, (double)l.nx * l.ny, e) &&
         hfield_spacing(hints, l.dx_m, l.dy_m, &dx, &dy, e) &&
         hfield_init(hf, l.nx, l.ny, dx, dy, e) &&
         read_member(z, doc->data_link, (double)l.nx * l.ny * (double)l.sample_size, &data, e) &&
         check_md5(&data, doc->data_link, doc->data_md5, e);
    if (ok && *doc->valid_link)
        ok = read_member(z, doc->valid_link, (double)l.nx * l.ny, &valid, e) &&
             check_md5(&valid, doc->valid_link, doc->valid_md5, e);
    ok = ok && fill(hf, &l, &data, &valid, e);
    if (ok) {
        take_comment(&hf->meta, doc->comment);
        if (l.offset_m[0] != 0 || l.offset_m[1] != 0)
            meta_set_nums(&hf->meta, "nacre.offset_m", l.offset_m, 2);
    }
    free(doc);
    free(xml.data);
    free(data.data);
    free(valid.data);
    return ok;
}

bool x3p_read(struct hfield *hf, const char *path, const struct hfield_hints *hints, struct err *e)
{
    struct infile in = {0};
    if (!infile_open(&in, path, e))
        return false;
    const int64_t size = in.size;
    infile_close(&in);
    int code;
    zip_t *z = zip_open(path, ZIP_RDONLY, &code);
    if (!z)
        return err_set(e, ERR_DATA, "not an X3P file, or cut short: it is no zip archive");
    const bool ok = read_surface(z, hf, hints, size, e);
    zip_discard(z);
    return ok;
}

static bool add_member(zip_t *z, const char *name, const void *data, size_t size)
{
    struct tm fixed = {.tm_year = 80, .tm_mday = 2, .tm_isdst = -1}; // same input, same bytes
    zip_source_t *s = zip_source_buffer(z, data, size, 0);
    const zip_int64_t at = s ? zip_file_add(z, name, s, ZIP_FL_ENC_UTF_8) : -1;
    if (s && at < 0)
        zip_source_free(s);
    return at >= 0 && !zip_file_set_mtime(z, (zip_uint64_t)at, mktime(&fixed), 0);
}

bool x3p_write(const struct hfield *hf, const char *path, const struct hfield_hints *hints,
               struct err *e)
{
    (void)hints;
    const size_t n = (size_t)hf->nx * (size_t)hf->ny;
    uint32_t *samples = sample_alloc(n, sizeof *samples, "height field", e);
    if (!samples)
        return false;
    memcpy(samples, hf->z, n * sizeof *samples);
    for (size_t k = 0; k < n; k++)
        samples[k] = htole32(samples[k]);
    char hex[MD5_TEXT];
    md5_of(samples, n * sizeof *samples, hex);
    char *xml = x3p_doc_text(hf, hex);
    md5_of(xml, strlen(xml), hex);
    char *sum = xasprintf("%s *main.xml", hex);
    int code;
    zip_t *z = zip_open(path, ZIP_CREATE | ZIP_TRUNCATE, &code);
    const bool filled = z && add_member(z, "main.xml", xml, strlen(xml)) &&
                        add_member(z, "bindata/data.bin", samples, n * sizeof *samples) &&
                        add_member(z, "md5checksum.hex", sum, strlen(sum));
    const bool ok = filled && !zip_close(z); // on failure the archive is still open
    if (z && !ok)
        zip_discard(z);
    free(samples);
    free(xml);
    free(sum);
    return ok || err_set(e, ERR_FILE, "cannot write");
}
