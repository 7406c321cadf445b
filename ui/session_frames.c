// session_frames.c - choosing a bracket in a session, and what the rig knows of it.
#define _GNU_SOURCE
#include "ui/session_frames.h"
#include "calib/bracket.h"
#include "core/imgfile.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/session.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

bool is_session(const char *path)
{
    char *ledger = xasprintf("%s/ledger.db", path);
    const bool there = !access(ledger, F_OK);
    free(ledger);
    return there;
}

static bool wanted(const struct session_frame *f, const struct session_choice *c)
{
    return f->step.kind == SESSION_LIGHT && (c->group < 0 || f->step.group == c->group) &&
           (!c->light || !strcmp(c->light, f->step.light)) &&
           (!c->filter || !strcmp(c->filter, f->step.filter));
}

static const char *or_none(const char *name)
{
    return *name ? name : "none";
}

// The frames of one group, moved to the front; false when the choice leaves none or several.
static bool choose(struct session_frame *frame, int *n, const struct session_choice *c,
                   const char *folder, struct err *e)
{
    int kept = 0, groups = 0;
    char list[240] = "";
    for (int k = 0; k < *n; k++) {
        if (!wanted(&frame[k], c))
            continue;
        bool known = false;
        for (int m = 0; m < kept; m++)
            known |= frame[m].step.group == frame[k].step.group;
        if (!known) {
            groups++;
            const size_t used = strlen(list);
            snprintf(list + used, sizeof list - used, "%s%d (light %s, filter %s)",
                     used ? ", " : "", frame[k].step.group, or_none(frame[k].step.light),
                     or_none(frame[k].step.filter));
        }
        const struct session_frame move = frame[k];
        frame[k] = frame[kept];
        frame[kept++] = move;
    }
    *n = c->first > 0 && c->first < kept ? c->first : kept;
    if (!groups)
        return err_set(e, ERR_DATA, "%s: no good frames of such a light, filter or group", folder);
    if (groups > 1)
        return err_set(e, ERR_DATA,
                       "%s: holds %d brackets: choose by --group, --filter or --light: %s", folder,
                       groups, list);
    for (int k = 1; k < *n; k++)
        if (frame[k].gain != frame[0].gain)
            return err_set(e, ERR_DATA, "%s: frames of different gain (%g and %g) in one bracket",
                           folder, frame[0].gain, frame[k].gain);
    return true;
}

// What the rig says about these frames: units, wavelength.
static bool from_rig(struct frames *f, struct session *s, const struct session_frame *first,
                     struct err *e)
{
    struct rig rig = {0};
    char *path = session_path(s, "rig.yaml");
    bool ok = rig_open(&rig, path, e);
    free(path);
    if (!ok)
        return false;
    const int light = *first->step.light ? rig_light_index(&rig, first->step.light) : -1;
    const int filter = *first->step.filter ? rig_filter_index(&rig, first->step.filter) : -1;
    const double irradiance = light >= 0 ? rig_irradiance(&rig, light, filter) : 0;
    if (rig.camera.responsivity > 0 && irradiance > 0)
        f->brdf_scale = 1 / (rig.camera.responsivity * first->gain * irradiance);
    struct err ignored;
    if (!rig_wavelength(&rig, light, filter, &f->lambda_m, &f->lambda_sigma_m, &ignored))
        f->lambda_m = f->lambda_sigma_m = 0;
    rig_finish(&rig);
    snprintf(f->group, sizeof f->group, "light %s, filter %s", or_none(first->step.light),
             or_none(first->step.filter));
    return true;
}

static bool read_darks(struct dark *dark, struct session *s, const struct session_frame *frame,
                       int n, double gain, struct err *e)
{
    struct dark_sums sums = {0};
    struct image first = {0};
    bool ok = true;
    for (int k = 0; ok && k < n; k++) {
        if (frame[k].step.kind != SESSION_DARK || (gain > 0 && frame[k].gain != gain))
            continue;
        struct image im = {0};
        char *path = session_path(s, frame[k].path);
        ok = image_read(&im, path, e) && (sums.frames || dark_begin(&sums, im.w, im.h, e)) &&
             ((im.nc == 1 && im.w == sums.w && im.h == sums.h) ||
              err_set(e, ERR_DATA, "%s: is not of the size of the other dark frames", path));
        if (ok)
            dark_add(&sums, im.px, session_exposure_s(&frame[k]));
        free(path);
        if (ok && !first.px)
            first = im;
        else
            image_finish(&im);
    }
    *dark = (struct dark){0};
    if (ok && sums.frames >= 2) {
        ok = dark_end(&sums, dark, e);
        if (ok)
            record_from_image(&dark->head, &first);
    } else {
        dark_drop(&sums);
    }
    image_finish(&first);
    return ok;
}

static bool read_group(struct frames *f, struct session *s, const struct session_frame *frame,
                       int n, struct err *e)
{
    char **path = xcalloc((size_t)n, sizeof *path);
    for (int k = 0; k < n; k++)
        path[k] = session_path(s, frame[k].path);
    const bool ok = frames_read(f, n, path, e);
    for (int k = 0; k < n; k++) {
        if (ok)
            f->time_s[k] = session_exposure_s(&frame[k]);
        free(path[k]);
    }
    free(path);
    if (!ok)
        return false;
    f->repeats = true;
    f->now.focus_per_m = frame[0].focus_per_m;
    return true;
}

bool session_frames_read(struct frames *f, struct dark *dark, const char *folder,
                         const struct session_choice *choice, struct err *e)
{
    struct session *s = NULL;
    struct session_frame *frame = NULL;
    int n = 0, kept;
    struct session_report report;
    *dark = (struct dark){0};
    bool ok = session_open(&s, folder, SESSION_READ, e) && session_status(s, &report, e) &&
              session_frames(s, true, &frame, &n, e);
    if (ok && report.state != SESSION_COMPLETE)
        log_warn("%s: the session is %s", folder, session_state_name[report.state]);
    kept = n;
    ok = ok && choose(frame, &kept, choice, folder, e) && read_group(f, s, frame, kept, e) &&
         from_rig(f, s, frame, e) && read_darks(dark, s, frame, n, frame[0].gain, e);
    if (!ok)
        frames_finish(f);
    free(frame);
    session_close(s);
    return ok;
}

bool session_dark_read(struct dark *dark, const char *folder, struct err *e)
{
    struct session *s = NULL;
    struct session_frame *frame = NULL;
    int n = 0;
    bool ok = session_open(&s, folder, SESSION_READ, e) && session_frames(s, true, &frame, &n, e) &&
              read_darks(dark, s, frame, n, 0, e);
    if (ok && !dark->frames)
        ok = err_set(e, ERR_DATA, "%s: has fewer than two good dark frames", folder);
    free(frame);
    session_close(s);
    return ok;
}
