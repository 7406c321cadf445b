// doctor_devices.c - nacre doctor --devices: every driver of this build, its options, and what it
// sees on this machine.
#define _GNU_SOURCE
#include "core/mem.h"
#include "ui/doctor.h"
#include "ui/drivers.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const char *const unit_symbol[] = {
    [UNIT_NONE] = "", [UNIT_M] = "m",   [UNIT_RAD] = "rad", [UNIT_S] = "s",     [UNIT_PER_M] = "/m",
    [UNIT_PX] = "px", [UNIT_HZ] = "Hz", [UNIT_K] = "K",     [UNIT_BYTES] = "B",
};

struct driver { // what cameras and triggers have in common
    const char *kind, *name, *summary;
    const struct devopt *options;
    void (*find)(found_fn *found, void *ctx);
};

struct listing {
    struct cli *cli;
    struct doc *item; // of the driver, under --json
    const struct driver *driver;
};

static bool is_number(const struct devopt *o)
{
    return o->kind != DEVOPT_TEXT && o->kind != DEVOPT_REST;
}

static enum unit unit_of(const struct devopt *o)
{
    return o->kind == DEVOPT_NS ? UNIT_S : o->unit;
}

static void option_as_json(const struct devopt *o, struct doc *item)
{
    static const char *const types[] = {
        [DEVOPT_NUM] = "number", [DEVOPT_INT] = "integer", [DEVOPT_NS] = "number",
        [DEVOPT_TEXT] = "text",  [DEVOPT_REST] = "text",
    };
    doc_text(item, "name", o->name);
    doc_text(item, "type", types[o->kind]);
    if (is_number(o)) {
        doc_text(item, "unit", unit_symbol[unit_of(o)]);
        doc_num(item, "min", o->lo);
        doc_num(item, "max", o->hi);
    }
    doc_text(item, "default", o->def);
    doc_text(item, "help", o->help);
}

// "65536 px": quantity_text() would round that to four digits.
static char *limit_text(const struct devopt *o, double x, char *buf, size_t size)
{
    const char *symbol = unit_symbol[unit_of(o)];
    if (*symbol && fabs(x) < 1)
        return quantity_text(x, unit_of(o), buf, size);
    snprintf(buf, size, "%.6g%s%s", x, *symbol ? " " : "", symbol);
    return buf;
}

static char *option_as_line(const struct devopt *o)
{
    char lo[40], hi[40], *range = NULL;
    if (is_number(o))
        range = xasprintf(" (%s to %s)", limit_text(o, o->lo, lo, sizeof lo),
                          limit_text(o, o->hi, hi, sizeof hi));
    const bool has_default = o->def && *o->def;
    char *line = xasprintf("%s%s%s%s%s", o->help, range ? range : "", has_default ? " [" : "",
                           has_default ? o->def : "", has_default ? "]" : "");
    free(range);
    return line;
}

static void on_found(void *ctx, const struct found *f)
{
    struct listing *l = ctx;
    if (l->cli->json) {
        struct doc *item = doc_item(l->item, "devices");
        doc_text(item, "uri", f->uri);
        doc_text(item, "what", f->what);
        doc_text(item, "problem", f->problem);
        return;
    }
    char *key = xasprintf("  found %s", f->uri);
    char *text = xasprintf("%s%s%s", f->what, f->problem ? "; " : "", f->problem ? f->problem : "");
    doc_text(l->cli->doc, key, text);
    free(text);
    free(key);
}

static void list(struct cli *cli, const struct driver *d)
{
    static const struct devopt none[] = {{0}};
    const struct devopt *o = d->options ? d->options : none;
    struct listing l = {cli, NULL, d};
    char *title = xasprintf("%s %s:", d->kind, d->name);
    if (cli->json) {
        l.item = doc_item(cli->doc, "drivers");
        doc_text(l.item, "kind", d->kind);
        doc_text(l.item, "name", d->name);
        doc_text(l.item, "summary", d->summary);
        doc_list(l.item, "options");
        doc_list(l.item, "devices");
        for (; o->name; o++)
            option_as_json(o, doc_item(l.item, "options"));
    } else {
        doc_text(cli->doc, title, d->summary);
        for (; o->name; o++) {
            char *key = xasprintf("%s%s=", title, o->name), *line = option_as_line(o);
            doc_text(cli->doc, key, line);
            free(line);
            free(key);
        }
    }
    if (d->find)
        d->find(on_found, &l);
    free(title);
}

void doctor_devices(struct cli *cli)
{
    for (const struct cam_driver *const *c = all_drivers.cameras; *c; c++)
        list(cli, &(struct driver){"camera", (*c)->name, (*c)->summary, (*c)->options, (*c)->find});
    for (const struct trig_driver *const *t = all_drivers.triggers; *t; t++)
        list(cli,
             &(struct driver){"trigger", (*t)->name, (*t)->summary, (*t)->options, (*t)->find});
}
