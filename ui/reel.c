// reel.c - a session as a strip of frames.
#define _GNU_SOURCE
#include "ui/reel.h"
#include "core/mem.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool reel_read(struct reel *r, const char *folder, struct err *e)
{
    struct session *s = NULL;
    struct session_frame *frame = NULL;
    struct session_report report;
    int n = 0;
    const bool ok = session_open(&s, folder, SESSION_READ, e) && session_status(s, &report, e) &&
                    session_frames(s, false, &frame, &n, e);
    session_close(s);
    if (!ok) {
        free(frame);
        return false;
    }
    const bool was_last = r->at == r->n - 1 || strcmp(r->folder, folder);
    free(r->frame);
    snprintf(r->folder, sizeof r->folder, "%s", folder);
    r->frame = frame;
    r->n = n;
    r->planned = report.planned;
    r->report = report;
    r->at = was_last || r->at >= n ? n - 1 : r->at;
    return true;
}

void reel_finish(struct reel *r)
{
    free(r->frame);
    *r = (struct reel){.at = -1};
}

bool reel_picture(const struct reel *r, int k, struct image *im, int *step, struct err *e)
{
    struct dng d = {0};
    char *path = xasprintf("%s/%s", r->folder, r->frame[k].path);
    const bool ok = dng_read(&d, path, e) && image_init(im, d.w, d.h, 1, e);
    const size_t n = ok ? (size_t)d.w * (size_t)d.h : 0;
    for (size_t i = 0; i < n; i++)
        im->px[i] = (float)((d.raw[i] - d.black) / (d.white - d.black));
    *step = d.pattern == DNG_MONO ? 1 : 2;
    dng_finish(&d);
    free(path);
    return ok;
}

int reel_bracket(const struct reel *r, int k, int *group)
{
    int good = 0;
    if (k < 0 || k >= r->n)
        return 0;
    *group = r->frame[k].step.group;
    for (int i = 0; i <= k; i++)
        good += r->frame[i].step.kind == SESSION_LIGHT && r->frame[i].step.group == *group &&
                !strcmp(r->frame[i].verdict, "good");
    return good;
}
