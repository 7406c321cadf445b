// devopt.c - "name=value,name=value" against a table.
#define _GNU_SOURCE
#include "acquire/devopt.h"
#include "core/mem.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static void set_text(void *to, const char *value)
{
    free(*(char **)to);
    *(char **)to = xstrdup(value);
}

static bool set(const struct devopt *o, const char *value, void *into, struct err *e)
{
    void *to = (char *)into + o->at;
    if (o->kind == DEVOPT_TEXT || o->kind == DEVOPT_REST) {
        set_text(to, value);
        return true;
    }
    const enum unit unit = o->kind == DEVOPT_NS ? UNIT_S : o->unit;
    struct err why = {0};
    double x;
    if (!quantity_parse(value, unit, &x, &why))
        return err_set(e, ERR_DATA, "%s=%s: %s", o->name, value, why.msg);
    if (o->kind == DEVOPT_INT && x != floor(x))
        return err_set(e, ERR_DATA, "%s=%s: not a whole number", o->name, value);
    if (x < o->lo || x > o->hi) {
        char lo[40], hi[40];
        return err_set(e, ERR_DATA, "%s=%s: must be %s to %s", o->name, value,
                       quantity_text(o->lo, unit, lo, sizeof lo),
                       quantity_text(o->hi, unit, hi, sizeof hi));
    }
    if (o->kind == DEVOPT_NUM)
        *(double *)to = x;
    else if (o->kind == DEVOPT_INT)
        *(int *)to = (int)x;
    else
        *(int64_t *)to = (int64_t)llround(x * 1e9);
    return true;
}

static const struct devopt *find(const struct devopt *table, const char *name)
{
    for (; table->name; table++)
        if (!strcmp(table->name, name))
            return table;
    return NULL;
}

static bool unknown(const struct devopt *table, const char *name, struct err *e)
{
    char known[200] = "";
    for (; table->name; table++)
        if (strlen(known) + strlen(table->name) + 3 < sizeof known)
            strcat(strcat(known, *known ? ", " : ""), table->name);
    return err_set(e, ERR_DATA, "no option '%.60s'; there are %s", name, *known ? known : "none");
}

bool devopt_parse(const struct devopt *table, const char *args, void *into, struct err *e)
{
    static const struct devopt none[] = {{0}};
    if (!table)
        table = none;
    for (const struct devopt *o = table; o->name; o++)
        if (o->def && !set(o, o->def, into, e))
            return false;
    char *copy = xstrdup(args), *at = copy;
    bool ok = true;
    for (bool first = true; ok && at && *at; first = false) {
        char *end = strchr(at, ','), *equals = strchr(at, '=');
        if (end && equals > end)
            equals = NULL;
        const struct devopt *o = NULL;
        if (equals) {
            *equals = 0;
            o = find(table, at);
        } else if (first && table->name) {
            o = table;
        }
        if (!o) {
            if (end)
                *end = 0;
            ok = unknown(table, at, e);
            break;
        }
        const char *value = equals ? equals + 1 : at;
        if (end && o->kind == DEVOPT_REST)
            end = NULL;
        if (end)
            *end = 0;
        ok = set(o, value, into, e);
        at = end ? end + 1 : NULL;
    }
    free(copy);
    return ok;
}

void devopt_finish(const struct devopt *table, void *into)
{
    for (; table && table->name; table++)
        if (table->kind == DEVOPT_TEXT || table->kind == DEVOPT_REST) {
            char **text = (char **)((char *)into + table->at);
            free(*text);
            *text = NULL;
        }
}
