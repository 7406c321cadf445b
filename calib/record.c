// record.c - the head of calibration records, in YAML and in image metadata.
#define _GNU_SOURCE
#include "calib/record.h"
#include "core/date.h"
#include "core/mem.h"
#include "core/outfile.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

// The fields of a record by name, for both kinds of file.
enum field_kind { TEXT, NUMBER, WHOLE };
static const struct field {
    const char *key;
    enum field_kind kind;
    size_t at, size;
} fields[] = {
#define FIELD(name, kind)                                                                          \
    {                                                                                              \
#name, kind, offsetof(struct record, name), sizeof((struct record *)0)->name               \
    }
    FIELD(kind, TEXT),
    FIELD(date, TEXT),
    FIELD(device, TEXT),
    FIELD(lens, TEXT),
    FIELD(iso, NUMBER),
    FIELD(aperture, NUMBER),
    FIELD(focus_per_m, NUMBER),
    FIELD(distance_m, NUMBER),
    FIELD(w, WHOLE),
    FIELD(h, WHOLE),
    FIELD(valid, TEXT),
    FIELD(valid_days, NUMBER),
    FIELD(residual, NUMBER),
    FIELD(residual_unit, TEXT),
#undef FIELD
};
enum { N_FIELDS = sizeof fields / sizeof *fields };

static char *text_of(const struct record *r, const struct field *f)
{
    return (char *)r + f->at;
}
static double *number_of(const struct record *r, const struct field *f)
{
    return (double *)(void *)text_of(r, f);
}
static int *whole_of(const struct record *r, const struct field *f)
{
    return (int *)(void *)text_of(r, f);
}

static void put_text(struct record *r, const struct field *f, const char *text)
{
    snprintf(text_of(r, f), f->size, "%s", text ? text : "");
}

static void clear(struct record *r)
{
    *r = (struct record){0};
    for (int k = 0; k < N_FIELDS; k++)
        if (fields[k].kind == NUMBER)
            *number_of(r, &fields[k]) = NAN;
}

static void today(char *to, size_t size)
{
    const time_t now = (time_t)date_in_file(time(NULL));
    struct tm tm;
    gmtime_r(&now, &tm);
    strftime(to, size, "%Y-%m-%dT%H:%M:%SZ", &tm);
}

// Sensors, lenses, filters age over a year; what stands on a bench is moved within a month.
static double days_of(const char *kind)
{
    return !strcmp(kind, "light") || !strcmp(kind, "geometry") ? 30 : 365;
}

void record_init(struct record *r, const char *kind, const char *valid, double residual,
                 const char *residual_unit)
{
    clear(r);
    snprintf(r->kind, sizeof r->kind, "%s", kind);
    snprintf(r->valid, sizeof r->valid, "%s", valid);
    snprintf(r->residual_unit, sizeof r->residual_unit, "%s", residual_unit);
    r->residual = residual;
    r->valid_days = days_of(kind);
    today(r->date, sizeof r->date);
}

// EXIF's "2011:03:24 18:12:10" as ISO 8601; other forms as they are.
static void iso_date(const char *from, char *to, size_t size)
{
    snprintf(to, size, "%s", from);
    if (strlen(to) == 19 && to[4] == ':' && to[7] == ':' && to[10] == ' ') {
        to[4] = to[7] = '-';
        to[10] = 'T';
    }
}

void record_from_image(struct record *r, const struct image *im)
{
    const char *text;
    if ((text = meta_text(&im->meta, "capDate")))
        iso_date(text, r->date, sizeof r->date);
    if ((text = meta_text(&im->meta, "cameraModel")))
        snprintf(r->device, sizeof r->device, "%s", text);
    if ((text = meta_text(&im->meta, "lensModel")))
        snprintf(r->lens, sizeof r->lens, "%s", text);
    meta_num(&im->meta, "isoSpeed", &r->iso);
    meta_num(&im->meta, "aperture", &r->aperture);
    meta_num(&im->meta, "nacre.focus_per_m", &r->focus_per_m);
    meta_num(&im->meta, "nacre.distance_m", &r->distance_m);
    r->w = im->w;
    r->h = im->h;
}

void record_settings(struct record *r, const struct record *from)
{
    struct record all = *from;
    memcpy(all.kind, r->kind, sizeof all.kind);
    memcpy(all.valid, r->valid, sizeof all.valid);
    memcpy(all.residual_unit, r->residual_unit, sizeof all.residual_unit);
    all.residual = r->residual;
    all.valid_days = r->valid_days;
    if (!*all.date)
        memcpy(all.date, r->date, sizeof all.date);
    *r = all;
}

static void print_text(FILE *f, const char *key, const char *text)
{
    fprintf(f, "%s: \"", key);
    for (; *text; text++)
        if (*text == '"' || *text == '\\')
            fprintf(f, "\\%c", *text);
        else if ((unsigned char)*text >= ' ')
            fputc(*text, f);
    fputs("\"\n", f);
}

void record_begin(struct record_file *rf, const struct record *r, const char *command)
{
    rf->f = open_memstream(&rf->text, &rf->size);
    fprintf(rf->f, "# calibration record of nacre\n");
    for (int k = 0; k < N_FIELDS; k++) {
        const struct field *f = &fields[k];
        if (f->kind == TEXT && *text_of(r, f))
            print_text(rf->f, f->key, text_of(r, f));
        else if (f->kind == NUMBER && !isnan(*number_of(r, f)))
            fprintf(rf->f, "%s: %.9g\n", f->key, *number_of(r, f));
        else if (f->kind == WHOLE && *whole_of(r, f))
            fprintf(rf->f, "%s: %d\n", f->key, *whole_of(r, f));
    }
    print_text(rf->f, "version", NACRE_VERSION);
    print_text(rf->f, "command", command);
}

void record_list(FILE *f, const char *key, const double *value, int n)
{
    fprintf(f, "%s: [", key);
    for (int k = 0; k < n; k++)
        fprintf(f, "%s%.9g", !k ? "" : k % 8 ? ", " : ",\n  ", value[k]);
    fputs("]\n", f);
}

bool record_end(struct record_file *rf, const char *path, struct err *e)
{
    fclose(rf->f);
    const bool ok = outfile_write(path, rf->text, rf->size, e);
    free(rf->text);
    *rf = (struct record_file){0};
    return ok;
}

static bool check_kind(const struct record *r, const char *path, const char *kind, struct err *e)
{
    return !strcmp(r->kind, kind) ||
           err_set(e, ERR_DATA, "%s: is %s%s record, not a %s record", path,
                   *r->kind ? "a " : "no calibration", r->kind, kind);
}

bool record_read(struct record *out, struct ynode *root, const char *path, const char *kind,
                 struct err *e)
{
    struct record r;
    const char *ignored = NULL;
    clear(&r);
    for (int k = 0; k < N_FIELDS; k++) {
        const struct field *f = &fields[k];
        const char *text = NULL;
        if (f->kind == TEXT && !ymap_text(root, f->key, Y_OPTIONAL, &text, e))
            return false;
        if (f->kind == TEXT)
            put_text(&r, f, text);
        if (f->kind == NUMBER &&
            !ymap_num(root, f->key, Y_OPTIONAL, UNIT_NONE, -1e30, 1e30, number_of(&r, f), e))
            return false;
        if (f->kind == WHOLE &&
            !ymap_int(root, f->key, Y_OPTIONAL, 0, IMAGE_MAX_SIDE, whole_of(&r, f), e))
            return false;
    }
    if (!check_kind(&r, path, kind, e) || !ymap_text(root, "version", Y_OPTIONAL, &ignored, e) ||
        !ymap_text(root, "command", Y_OPTIONAL, &ignored, e))
        return false;
    *out = r;
    return true;
}

bool record_read_list(struct ynode *map, const char *key, double lo, double hi, double *out, int n,
                      struct err *e)
{
    struct ynode *list;
    if (!ymap_list(map, key, Y_NEEDED, &list, e))
        return false;
    if (ylist_count(list) != n)
        return yaml_bad(list, e, "has %d numbers, must have %d", ylist_count(list), n);
    for (int k = 0; k < n; k++)
        if (!ynode_num(ylist_at(list, k), UNIT_NONE, lo, hi, &out[k], e))
            return false;
    return true;
}

static const char *meta_key(const struct field *f, char *buf, size_t size)
{
    snprintf(buf, size, "nacre.calib.%s", f->key);
    return buf;
}

void record_to_meta(const struct record *r, struct meta *m)
{
    char key[64];
    for (int k = 0; k < N_FIELDS; k++) {
        const struct field *f = &fields[k];
        meta_key(f, key, sizeof key);
        if (f->kind == TEXT && *text_of(r, f))
            meta_set_text(m, key, text_of(r, f));
        else if (f->kind == NUMBER && !isnan(*number_of(r, f)))
            meta_set_num(m, key, *number_of(r, f));
        else if (f->kind == WHOLE && *whole_of(r, f))
            meta_set_num(m, key, *whole_of(r, f));
    }
}

bool record_from_meta(struct record *out, const struct meta *m, const char *path, const char *kind,
                      struct err *e)
{
    struct record r;
    char key[64];
    clear(&r);
    for (int k = 0; k < N_FIELDS; k++) {
        const struct field *f = &fields[k];
        double v = 0;
        meta_key(f, key, sizeof key);
        if (f->kind == TEXT)
            put_text(&r, f, meta_text(m, key));
        else if (f->kind == NUMBER)
            meta_num(m, key, number_of(&r, f));
        else if (meta_num(m, key, &v))
            *whole_of(&r, f) = (int)v;
    }
    if (!check_kind(&r, path, kind, e))
        return false;
    *out = r;
    return true;
}
