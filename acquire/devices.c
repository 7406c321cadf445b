// devices.c - opens what a rig names, in an order that is safe.
#define _GNU_SOURCE
#include "acquire/devices.h"
#include "acquire/clock.h"
#include "acquire/lights.h"
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static bool open_trigger(struct trig **t, const struct rig *rig, const char *uri, const char *run,
                         const struct drivers *drivers, struct err *e)
{
    if (!uri)
        return true;
    char *full = rig_uri(rig, uri, run);
    *t = trig_open(drivers->triggers, full, e);
    free(full);
    return *t != NULL;
}

static bool open_lights(struct trig **t, const struct rig *rig, const char *run,
                        const struct drivers *drivers, struct err *e)
{
    if (!rig->lights_uri || !drivers->keep_lights)
        return open_trigger(t, rig, rig->lights_uri, run, drivers, e);
    *t = lights_open(rig, run, e);
    return *t != NULL;
}

bool devices_open(struct devices *out, const struct rig *rig, const struct drivers *drivers,
                  cam_on_frame *on_frame, void *ctx, struct err *e)
{
    struct devices d = {0};
    char run[40]; // unlike that of any other capture on this machine
    snprintf(run, sizeof run, "%x-%llx", (unsigned)getpid(), (unsigned long long)clock_boot_ns());
    bool ok = open_lights(&d.lights, rig, run, drivers, e) &&
              open_trigger(&d.filters, rig, rig->filters_uri, run, drivers, e);
    if (ok) {
        char *uri = rig_uri(rig, rig->camera.uri, run);
        d.cam = cam_open(drivers->cameras, uri, on_frame, ctx, e);
        free(uri);
        ok = d.cam != NULL;
    }
    if (ok)
        *out = d;
    else
        devices_close(&d);
    return ok;
}

void devices_close(struct devices *d)
{
    trig_close(d->lights);
    trig_close(d->filters);
    cam_close(d->cam);
    *d = (struct devices){0};
}

bool devices_filter(struct devices *d, int position, struct err *e)
{
    if (!d->filters)
        return err_set(e, ERR_DATA, "the rig has no filters to change");
    const bool is_wheel = d->filters->caps.positions > 0;
    return trig_set(d->filters, is_wheel ? (uint32_t)position : UINT32_C(1) << position, e);
}
