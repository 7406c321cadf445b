// bokeh_record.c - a bokeh calibration as YAML.
#include "calib/bokeh_record.h"
#include <math.h>
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
    FIELD(level, 0, 1e9),    FIELD(rmse, 0, 10),
#undef FIELD
};
enum { N_FIELDS = sizeof fields / sizeof *fields };

static double *number_of(const struct bokeh_record *b, const struct field *f)
{
    return (double *)(void *)((char *)b + f->at);
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
    snprintf(b.channel, sizeof b.channel, "%s", channel);
    ok = yaml_close(y, ok, e) && ok;
    if (ok)
        *out = b;
    return ok;
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
