// trigger.c - finds the driver of a URI and passes calls on, with the driver's name in every error.
#define _GNU_SOURCE
#include "acquire/trigger.h"
#include "core/mem.h"
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const struct trig_driver *find(const struct trig_driver *const drivers[], const char *uri,
                                      struct err *e)
{
    const size_t len = strcspn(uri, ":");
    char known[200] = "";
    for (; *drivers; drivers++) {
        if (strlen((*drivers)->name) == len && !strncmp((*drivers)->name, uri, len) && uri[len])
            return *drivers;
        if (strlen(known) + strlen((*drivers)->name) + 3 < sizeof known)
            strcat(strcat(strcat(known, *known ? " " : ""), (*drivers)->name), ":");
    }
    err_set(e, ERR_DATA, "trigger '%.80s': no such driver; this build has %s", uri, known);
    return NULL;
}

struct trig *trig_open(const struct trig_driver *const drivers[], const char *uri, struct err *e)
{
    const struct trig_driver *drv = find(drivers, uri, e);
    if (!drv)
        return NULL;
    struct trig *t = xcalloc(1, drv->size);
    *t = (struct trig){drv, drivers, .fd = -1};
    bool ok = devopt_parse(drv->options, uri + strlen(drv->name) + 1, t, e);
    if (ok && !(ok = drv->open(t, e)))
        drv->close(t);
    if (ok)
        return t;
    err_in(e, "trigger %s", drv->name);
    if (t->fd >= 0)
        close(t->fd);
    devopt_finish(drv->options, t);
    free(t);
    return NULL;
}

bool trig_set(struct trig *t, uint32_t state, struct err *e)
{
    const uint64_t limit =
        t->caps.positions ? (uint64_t)t->caps.positions : UINT64_C(1) << t->caps.lines;
    if (state >= limit)
        return err_set(e, ERR_DATA, "trigger %s: state %u, but it has %d %s", t->drv->name, state,
                       t->caps.positions ? t->caps.positions : t->caps.lines,
                       t->caps.positions ? "positions" : "lines");
    return t->drv->set(t, state, e) || err_in(e, "trigger %s", t->drv->name);
}

bool trig_pulse(struct trig *t, uint32_t mask, int64_t duration_ns, struct err *e)
{
    if (!t->caps.lines || !t->drv->pulse)
        return err_set(e, ERR_DATA, "trigger %s: has no lines to pulse", t->drv->name);
    return t->drv->pulse(t, mask, duration_ns, e) || err_in(e, "trigger %s", t->drv->name);
}

bool trig_settled(struct trig *t, struct err *e)
{
    uint64_t count;
    if (t->fd >= 0 && read(t->fd, &count, sizeof count) < 0)
        return err_errno(e, "trigger %s", t->drv->name);
    if (t->moved.code == ERR_NONE)
        return true;
    *e = t->moved;
    return err_in(e, "trigger %s", t->drv->name);
}

void trig_close(struct trig *t)
{
    if (!t)
        return;
    t->drv->close(t);
    if (t->fd >= 0)
        close(t->fd);
    devopt_finish(t->drv->options, t);
    free(t);
}
