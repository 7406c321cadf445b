// bokeh_record.c - a bokeh calibration as YAML.
#include "calib/bokeh_record.h"
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

// Every number of the record: its key and what it may be.
static const struct field {
    const char *key;
    size_t at;
    double lo, hi;
} fields[] = {
#define FIELD(name, lo, hi)                                                                        \
    {                                                                                              \
#name, offsetof(struct bokeh_record, name), lo, hi                                         \
    }
    FIELD(lines_per_m, 1, 1e8), FIELD(blaze_rad, 0, 1.5),     FIELD(cx_px, 0, 1e6),
    FIELD(cy_px, 0, 1e6),       FIELD(radius_px, 1, 1e6),     FIELD(turn_rad, -7, 7),
    FIELD(lines, 1, 1e6),       FIELD(m_per_px, 1e-10, 1e-3), FIELD(m_per_px_sigma, 0, 1e-3),
    FIELD(sigma_px, 0, 1000),   FIELD(gain_m, -1, 1),         FIELD(offset, -1e6, 1e6),
    FIELD(level, 0, 1e9),       FIELD(rmse, 0, 10),
#undef FIELD
};
enum { N_FIELDS = sizeof fields / sizeof *fields };

// What each channel has of its own.
static const struct field channel_fields[] = {
#define FIELD(name, lo, hi)                                                                        \
    {                                                                                              \
#name, offsetof(struct bokeh_channel, name), lo, hi                                        \
    }
    FIELD(sigma_px, 0, 1000), FIELD(gain_m, -1, 1), FIELD(offset, -1e6, 1e6),
    FIELD(level, 0, 1e9),     FIELD(rmse, 0, 10),
#undef FIELD
};
enum { N_CHANNEL_FIELDS = sizeof channel_fields / sizeof *channel_fields };

static double *number_of(const void *of, const struct field *f)
{
    return (double *)(void *)((char *)(uintptr_t)of + f->at);
}

static bool read_others(struct bokeh_record *b, struct ynode *root, struct err *e)
{
    struct ynode *list = NULL;
    if (!ymap_list(root, "others", Y_OPTIONAL, &list, e))
        return false;
    b->n_other = list ? ylist_count(list) : 0;
    if (b->n_other > 2)
        return yaml_bad(list, e, "%d channels beside the first: must be at most 2", b->n_other);
    for (int k = 0; k < b->n_other; k++) {
        struct ynode *map = ylist_at(list, k);
        struct bokeh_channel *c = &b->other[k];
        const char *name;
        if (!ymap_text(map, "name", Y_NEEDED, &name, e) ||
            !ymap_int(map, "iterations", Y_NEEDED, 0, 1000000, &c->iterations, e))
            return false;
        snprintf(c->name, sizeof c->name, "%s", name);
        for (int m = 0; m < N_CHANNEL_FIELDS; m++)
            if (!ymap_num(map, channel_fields[m].key, Y_NEEDED, UNIT_NONE, channel_fields[m].lo,
                          channel_fields[m].hi, number_of(c, &channel_fields[m]), e))
                return false;
    }
    return true;
}

bool bokeh_record_write(const struct bokeh_record *b, const char *command, const char *path,
                        struct err *e)
{
    struct record_file rf;
    record_begin(&rf, &b->head, command);
    fprintf(rf.f, "channel: %s\niterations: %d\n", b->channel, b->iterations);
    for (int k = 0; k < N_FIELDS; k++)
        fprintf(rf.f, "%s: %.9g\n", fields[k].key, *number_of(b, &fields[k]));
    if (!isnan(b->exposure_s))
        fprintf(rf.f, "exposure_s: %.9g\n", b->exposure_s);
    for (int k = 0; k < b->n_other; k++) {
        const struct bokeh_channel *c = &b->other[k];
        fprintf(rf.f, "%s  - {name: %s, iterations: %d", k ? "" : "others:\n", c->name,
                c->iterations);
        for (int m = 0; m < N_CHANNEL_FIELDS; m++)
            fprintf(rf.f, ", %s: %.9g", channel_fields[m].key, *number_of(c, &channel_fields[m]));
        fprintf(rf.f, "}\n");
    }
    return record_end(&rf, path, e);
}

bool bokeh_record_read(struct bokeh_record *out, const char *path, struct err *e)
{
    struct yaml *y;
    struct bokeh_record b = {.exposure_s = NAN};
    const char *channel = "B";
    if (!yaml_open(&y, path, e))
        return false;
    struct ynode *root = yaml_root(y);
    bool ok = record_read(&b.head, root, path, "bokeh", e) &&
              ymap_text(root, "channel", Y_NEEDED, &channel, e) &&
              ymap_int(root, "iterations", Y_NEEDED, 0, 1000000, &b.iterations, e) &&
              ymap_num(root, "exposure_s", Y_OPTIONAL, UNIT_NONE, 1e-9, 1e6, &b.exposure_s, e);
    for (int k = 0; ok && k < N_FIELDS; k++)
        ok = ymap_num(root, fields[k].key, Y_NEEDED, UNIT_NONE, fields[k].lo, fields[k].hi,
                      number_of(&b, &fields[k]), e);
    ok = ok && read_others(&b, root, e);
    snprintf(b.channel, sizeof b.channel, "%s", channel);
    ok = yaml_close(y, ok, e) && ok;
    if (ok)
        *out = b;
    return ok;
}

void bokeh_record_take(struct bokeh_record *b, const struct bokeh_channel *c)
{
    snprintf(b->channel, sizeof b->channel, "%s", c->name);
    b->sigma_px = c->sigma_px;
    b->iterations = c->iterations;
    b->gain_m = c->gain_m;
    b->offset = c->offset;
    b->level = c->level;
    b->rmse = c->rmse;
}

bool bokeh_record_select(struct bokeh_record *b, const char *channel, struct err *e)
{
    char others[32] = "";
    if (!strcmp(b->channel, channel))
        return true;
    for (int k = 0; k < b->n_other; k++) {
        const struct bokeh_channel *c = &b->other[k];
        if (!strcmp(c->name, channel)) {
            bokeh_record_take(b, c);
            return true;
        }
        const size_t n = strlen(others);
        snprintf(others + n, sizeof others - n, ", %s", c->name);
    }
    return err_set(e, ERR_DATA, "channel %s was not calibrated: the record has %s%s", channel,
                   b->channel, others);
}

bool bokeh_record_fits(const struct bokeh_record *b, const char *path, const struct image *photo,
                       struct err *e)
{
    struct record now;
    record_init(&now, "bokeh", "", NAN, "");
    record_from_image(&now, photo);
    now.iso = NAN; // brightness is set by the disc
    return record_fits(&b->head, path, &now, e);
}

double bokeh_record_level(const struct bokeh_record *b, const struct image *im)
{
    double time_s = NAN, iso = NAN, ratio = 1;
    meta_num(&im->meta, "expTime", &time_s);
    meta_num(&im->meta, "isoSpeed", &iso);
    if (!isnan(time_s) && !isnan(b->exposure_s))
        ratio *= time_s / b->exposure_s;
    if (!isnan(iso) && !isnan(b->head.iso))
        ratio *= iso / b->head.iso;
    return b->level * ratio;
}
