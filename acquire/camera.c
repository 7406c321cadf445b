// camera.c - finds the driver of a URI and passes calls on, with the driver's name in every error.
#define _GNU_SOURCE
#include "acquire/camera.h"
#include "core/mem.h"
#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const struct cam_driver *find(const struct cam_driver *const drivers[], const char *uri,
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
    err_set(e, ERR_DATA, "camera '%.80s': no such driver; this build has %s", uri, known);
    return NULL;
}

struct cam *cam_open(const struct cam_driver *const drivers[], const char *uri,
                     cam_on_frame *on_frame, void *ctx, struct err *e)
{
    const struct cam_driver *drv = find(drivers, uri, e);
    if (!drv)
        return NULL;
    struct cam *cam = xcalloc(1, drv->size);
    *cam = (struct cam){drv, drivers, .fd = -1, .on_frame = on_frame, .ctx = ctx};
    bool ok = devopt_parse(drv->options, uri + strlen(drv->name) + 1, cam, e);
    if (ok && !(ok = drv->open(cam, e)))
        drv->close(cam);
    if (ok)
        return cam;
    err_in(e, "camera %s", drv->name);
    if (cam->fd >= 0)
        close(cam->fd);
    devopt_finish(drv->options, cam);
    free(cam);
    return NULL;
}

bool cam_shoot(struct cam *cam, const struct cam_shot *shot, struct err *e)
{
    assert(shot->id && shot->exposure_ns > 0);
    return cam->drv->shoot(cam, shot, e) || err_in(e, "camera %s", cam->drv->name);
}

bool cam_pump(struct cam *cam, struct err *e)
{
    return cam->drv->pump(cam, e) || err_in(e, "camera %s", cam->drv->name);
}

void cam_close(struct cam *cam)
{
    if (!cam)
        return;
    cam->drv->close(cam);
    if (cam->fd >= 0)
        close(cam->fd);
    devopt_finish(cam->drv->options, cam);
    free(cam);
}

void cam_deliver(struct cam *cam, const struct cam_frame *frame)
{
    cam->on_frame(cam->ctx, frame);
}
