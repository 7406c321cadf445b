// plan_check.c - judges a plan before any light goes on: names, limits, time, space.
#define _GNU_SOURCE
#include "acquire/plan.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double SPARE_BYTES = 64e6; // left for the ledger and for the rest of the machine
static const double DNG_HEADER = 8192;

static bool check_names(const struct plan *p, const struct rig *rig, struct err *e)
{
    char known[200] = "";
    for (int k = 0; k < p->n_lights; k++)
        if (rig_light_index(rig, p->light[k]) < 0) {
            for (int l = 0; l < rig->n_lights; l++)
                snprintf(known + strlen(known), sizeof known - strlen(known), " %s",
                         rig->light[l].name);
            return err_set(e, ERR_DATA, "%s: light '%s' is not in %s; it has%s", p->path,
                           p->light[k], rig->path, *known ? known : " none");
        }
    for (int k = 0; k < p->n_filters; k++)
        if (rig_filter_index(rig, p->filter[k]) < 0) {
            for (int f = 0; f < rig->n_filters; f++)
                snprintf(known + strlen(known), sizeof known - strlen(known), " %s",
                         rig->filter[f].name);
            return err_set(e, ERR_DATA, "%s: filter '%s' is not in %s; it has%s", p->path,
                           p->filter[k], rig->path, *known ? known : " none");
        }
    return true;
}

static bool check_devices(const struct plan *p, const struct rig *rig, const struct cam_caps *c,
                          const struct trig_caps *lights, const struct trig_caps *filters,
                          struct err *e)
{
    const double gain = isnan(p->gain) ? rig->camera.gain : p->gain;
    if (c->for_looking)
        return err_set(e, ERR_DATA,
                       "camera %s delivers processed pictures: to aim by, not to "
                       "measure with; choose a raw format",
                       c->model);
    if (rig->camera.bits && rig->camera.bits != c->bits)
        return err_set(e, ERR_DATA, "%s: says %d bits, but camera %s has %d", rig->path,
                       rig->camera.bits, c->model, c->bits);
    if (gain < c->gain_min * (1 - 1e-9) || gain > c->gain_max * (1 + 1e-9))
        return err_set(e, ERR_DATA, "gain %g: camera %s has %g to %g", gain, c->model, c->gain_min,
                       c->gain_max);
    for (int k = 0; k < p->n_focus; k++)
        if (p->focus_per_m[k] < c->focus_min_per_m || p->focus_per_m[k] > c->focus_max_per_m)
            return err_set(e, ERR_DATA, "focus %g dioptres: camera %s has %s%g to %g",
                           p->focus_per_m[k], c->model,
                           c->focus_max_per_m > 0 ? "" : "no focus drive: ", c->focus_min_per_m,
                           c->focus_max_per_m);
    for (int k = 0; lights && k < rig->n_lights; k++)
        if (rig->light[k].line >= (lights->lines ? lights->lines : lights->positions))
            return err_set(e, ERR_DATA, "%s: light '%s' is on line %d, but %s has %d", rig->path,
                           rig->light[k].name, rig->light[k].line, lights->model, lights->lines);
    for (int k = 0; filters && k < rig->n_filters; k++)
        if (rig->filter[k].position >= (filters->lines ? filters->lines : filters->positions))
            return err_set(e, ERR_DATA, "%s: filter '%s' is at position %d, but %s has %d",
                           rig->path, rig->filter[k].name, rig->filter[k].position, filters->model,
                           filters->lines ? filters->lines : filters->positions);
    return true;
}

static bool check_exposure(const struct plan *p, const struct rig *rig, const struct cam_caps *c,
                           int64_t ns, struct plan_report *r, struct err *e)
{
    char a[40], b[40], t[40];
    quantity_text(1e-9 * (double)ns, UNIT_S, t, sizeof t);
    if (ns < c->exposure_min_ns || ns > c->exposure_max_ns)
        return err_set(e, ERR_DATA, "exposure %s: camera %s can do %s to %s", t, c->model,
                       quantity_text(1e-9 * (double)c->exposure_min_ns, UNIT_S, a, sizeof a),
                       quantity_text(1e-9 * (double)c->exposure_max_ns, UNIT_S, b, sizeof b));
    for (int k = 0; k < p->n_lights; k++) {
        const struct rig_light *l = &rig->light[rig_light_index(rig, p->light[k])];
        const double on_s = 1e-9 * (double)plan_on_ns(c, l, ns);
        if (on_s > l->max_on_s)
            return err_set(e, ERR_DATA,
                           "exposure %s: light '%s' would be on for %s, its limit is "
                           "%s",
                           t, l->name, quantity_text(on_s, UNIT_S, a, sizeof a),
                           quantity_text(l->max_on_s, UNIT_S, b, sizeof b));
    }
    const int64_t rounded = plan_round(c, ns);
    if (llabs(rounded - ns) > ns / 8) // a sixth of a stop
        return err_set(e, ERR_DATA, "exposure %s: camera %s would make it %s", t, c->model,
                       quantity_text(1e-9 * (double)rounded, UNIT_S, a, sizeof a));
    if (rounded != ns && r->n_rounded < PLAN_MAX_EXPOSURES) {
        r->rounded[r->n_rounded][0] = ns;
        r->rounded[r->n_rounded++][1] = rounded;
    }
    return true;
}

// From one shot to the next, with the pause that the light's duty asks for.
static double shot_s(const struct cam_caps *c, const struct rig_light *l, int64_t exposure_ns)
{
    const double bare_s = 1e-9 * (double)(exposure_ns + c->row_ns * (c->h - 1));
    if (!l)
        return bare_s;
    const double on_s = 1e-9 * (double)plan_on_ns(c, l, exposure_ns);
    return fmax(on_s, bare_s) / l->max_duty;
}

bool plan_check(const struct plan *p, const struct rig *rig, const struct cam_caps *c,
                const struct trig_caps *lights, const struct trig_caps *filters, double free_bytes,
                struct plan_report *out, struct err *e)
{
    struct plan_report r = {.free_bytes = free_bytes};
    if (!check_names(p, rig, e) || !check_devices(p, rig, c, lights, filters, e))
        return false;
    int64_t longest[PLAN_MAX_EXPOSURES];
    int n = p->n_exposures;
    memcpy(longest, p->exposure_ns, sizeof longest);
    for (int k = 0; k < n; k++)
        if (!check_exposure(p, rig, c, longest[k], &r, e))
            return false;
    if (!n) { // automatic: at most as long as camera and lights allow
        if (!check_exposure(p, rig, c, p->meter_ns, &r, e))
            return false;
        n = (int)floor(p->span_stops / p->step_stops + 1e-6) + 1;
        int64_t top = c->exposure_max_ns;
        for (int k = 0; k < p->n_lights; k++) {
            const struct rig_light *l = &rig->light[rig_light_index(rig, p->light[k])];
            const int64_t spare = plan_on_ns(c, l, 0), cap = llround(1e9 * l->max_on_s) - spare;
            top = cap < top ? cap : top;
        }
        for (int k = 0; k < n; k++)
            longest[k] = llround((double)top * exp2(-(n - 1 - k) * p->step_stops));
    }
    struct plan_group *g;
    r.groups = plan_groups(p, rig, &g);
    for (int k = 0; k < r.groups; k++) {
        const int times = g[k].kind == SESSION_DARK ? p->darks : p->repeats;
        r.frames += n * times;
        r.duration_s += filters && g[k].filter >= 0 ? 1e-9 * (double)filters->settle_ns : 0;
        for (int x = 0; x < n; x++)
            r.duration_s +=
                times * shot_s(c, g[k].light < 0 ? NULL : &rig->light[g[k].light], longest[x]);
    }
    free(g);
    r.bytes = r.frames * (2.0 * c->w * c->h + DNG_HEADER);
    if (r.bytes + SPARE_BYTES > free_bytes) {
        char a[40], b[40];
        return err_set(e, ERR_FILE, "%d frames need %s, but only %s are free", r.frames,
                       quantity_text(r.bytes + SPARE_BYTES, UNIT_BYTES, a, sizeof a),
                       quantity_text(free_bytes, UNIT_BYTES, b, sizeof b));
    }
    *out = r;
    return true;
}
