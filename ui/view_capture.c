// view_capture.c - the plans to choose from, and what is asked of nacred.
#define _GNU_SOURCE
#include "ui/view_capture.h"
#include "core/datapath.h"
#include "core/mem.h"
#include "ui/live.h"
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static void add(struct capture_order *o, char *path)
{
    if (o->n == CAPTURE_PLANS) {
        free(path);
        return;
    }
    char *to = o->names;
    for (int k = 0; k < o->n; k++)
        to += strlen(to) + 1;
    snprintf(to, 63, "%s", basename(path));
    o->plan[o->n++] = path;
}

static int is_plan(const struct dirent *d)
{
    const char *dot = strrchr(d->d_name, '.');
    return dot && !strcmp(dot, ".yaml");
}

void capture_order_init(struct capture_order *o, const char *rig, const char *plan,
                        const char *folder)
{
    struct err e;
    *o = (struct capture_order){.rig = rig, .folder = folder};
    add(o, data_file(plan));
    char *shipped = data_path("rigs/plans", &e);
    struct dirent **list = NULL;
    const int n = shipped ? scandir(shipped, &list, is_plan, alphasort) : 0;
    for (int k = 0; k < n; k++) {
        char *path = xasprintf("%s/%s", shipped, list[k]->d_name);
        if (strcmp(path, o->plan[0]) != 0)
            add(o, path);
        else
            free(path);
        free(list[k]);
    }
    free(list);
    free(shipped);
}

void capture_order_finish(struct capture_order *o)
{
    for (int k = 0; k < o->n; k++)
        free(o->plan[k]);
    *o = (struct capture_order){0};
}

void capture_begin(struct capture_order *o, struct live *l)
{
    char name[64];
    const time_t now = time(NULL);
    struct tm tm;
    strftime(name, sizeof name, "capture-%Y%m%d-%H%M%S", localtime_r(&now, &tm));
    char *rig = data_file(o->rig), *session = xasprintf("%s/%s", o->folder, name);
    live_start(l, rig, o->plan[o->at], session);
    free(rig);
    free(session);
}

void capture_hold(struct live *l)
{
    live_order(l, strcmp(live_status(l)->state, "paused") ? "capture.pause" : "capture.continue");
}
