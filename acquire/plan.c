// plan.c - reads a plan and turns it into groups and steps.
#define _GNU_SOURCE
#include "acquire/plan.h"
#include "core/mem.h"
#include "core/yaml.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double LONGEST_S = 3600;

static bool get_names(struct ynode *root, const char *key, char ***names, int *n, struct err *e)
{
    struct ynode *list = NULL;
    if (!ymap_list(root, key, Y_OPTIONAL, &list, e))
        return false;
    const int count = list ? ylist_count(list) : 0;
    *names = xcalloc((size_t)count + 1, sizeof **names);
    for (int k = 0; k < count; k++) {
        struct ynode *at = ylist_at(list, k);
        if (!*ynode_text(at))
            return yaml_bad(at, e, "expected a name of the rig's");
        for (int p = 0; p < k; p++)
            if (!strcmp((*names)[p], ynode_text(at)))
                return yaml_bad(at, e, "'%s' is given twice", ynode_text(at));
        (*names)[(*n)++] = xstrdup(ynode_text(at));
    }
    return true;
}

static bool get_list(struct ynode *list, struct plan *p, struct err *e)
{
    const int n = ylist_count(list);
    if (n < 1 || n > PLAN_MAX_EXPOSURES)
        return yaml_bad(list, e, "%d exposures: must be 1 to %d", n, PLAN_MAX_EXPOSURES);
    for (int k = 0; k < n; k++) {
        double s;
        if (!ynode_num(ylist_at(list, k), UNIT_S, 1e-6, LONGEST_S, &s, e))
            return false;
        p->exposure_ns[k] = llround(s * 1e9);
        if (k && p->exposure_ns[k] <= p->exposure_ns[k - 1])
            return yaml_bad(ylist_at(list, k), e, "exposures must rise");
    }
    p->n_exposures = n;
    return true;
}

static bool get_range(struct ynode *map, struct plan *p, struct err *e)
{
    double first = 0, last = 0;
    if (!ymap_num(map, "first", Y_NEEDED, UNIT_S, 1e-6, LONGEST_S, &first, e) ||
        !ymap_num(map, "last", Y_NEEDED, UNIT_S, 1e-6, LONGEST_S, &last, e))
        return false;
    if (last < first)
        return yaml_bad(map, e, "last must not be shorter than first");
    const double n = floor(log2(last / first) / p->step_stops + 1e-6) + 1;
    if (n > PLAN_MAX_EXPOSURES)
        return yaml_bad(map, e, "%.0f exposures: must be 1 to %d", n, PLAN_MAX_EXPOSURES);
    for (int k = 0; k < (int)n; k++)
        p->exposure_ns[k] = llround(1e9 * first * exp2(k * p->step_stops));
    p->n_exposures = (int)n;
    return true;
}

static bool get_exposures(struct ynode *root, struct plan *p, struct err *e)
{
    struct ynode *at = ymap_find(root, "exposures");
    double meter = 0;
    p->step_stops = 1;
    p->span_stops = 8;
    if (!at)
        return yaml_bad(root, e, "needs the key 'exposures'");
    if (ynode_is_list(at))
        return get_list(at, p, e);
    if (!ynode_is_map(at))
        return yaml_bad(at, e,
                        "expected a list of times, or first, last and step, or meter, step "
                        "and span");
    if (!ymap_num(at, "step", Y_OPTIONAL, UNIT_NONE, 0.1, 6, &p->step_stops, e))
        return false;
    if (!ymap_find(at, "meter"))
        return get_range(at, p, e);
    if (!ymap_num(at, "meter", Y_NEEDED, UNIT_S, 1e-6, LONGEST_S, &meter, e) ||
        !ymap_num(at, "span", Y_OPTIONAL, UNIT_NONE, 0, 24, &p->span_stops, e))
        return false;
    p->meter_ns = llround(meter * 1e9);
    return p->span_stops / p->step_stops + 1 <= PLAN_MAX_EXPOSURES ||
           yaml_bad(at, e, "more than %d exposures", PLAN_MAX_EXPOSURES);
}

static bool get_focus(struct ynode *root, struct plan *p, struct err *e)
{
    struct ynode *list = NULL;
    if (!ymap_list(root, "focus", Y_OPTIONAL, &list, e))
        return false;
    const int n = list ? ylist_count(list) : 0;
    p->focus_per_m = xcalloc((size_t)n + 1, sizeof *p->focus_per_m);
    for (; p->n_focus < n; p->n_focus++)
        if (!ynode_num(ylist_at(list, p->n_focus), UNIT_NONE, 0, 1000, &p->focus_per_m[p->n_focus],
                       e))
            return false;
    return true;
}

bool plan_open(struct plan *out, const char *path, struct err *e)
{
    struct yaml *y;
    struct err ignored;
    struct plan p = {.path = xstrdup(path), .repeats = 1, .retries = 3, .gain = NAN};
    const char *name = "";
    if (!yaml_open(&y, path, e)) {
        plan_finish(&p);
        return false;
    }
    struct ynode *root = yaml_root(y);
    const bool read = ymap_text(root, "name", Y_NEEDED, &name, e) &&
                      get_names(root, "lights", &p.light, &p.n_lights, e) &&
                      get_names(root, "filters", &p.filter, &p.n_filters, e) &&
                      get_exposures(root, &p, e) && get_focus(root, &p, e) &&
                      ymap_int(root, "repeats", Y_OPTIONAL, 1, 10000, &p.repeats, e) &&
                      ymap_int(root, "darks", Y_OPTIONAL, 0, 1000, &p.darks, e) &&
                      ymap_int(root, "retries", Y_OPTIONAL, 0, 20, &p.retries, e) &&
                      ymap_num(root, "gain", Y_OPTIONAL, UNIT_NONE, 1e-3, 1e4, &p.gain, e);
    p.name = xstrdup(name);
    const bool ok = yaml_close(y, read, read ? e : &ignored) && read;
    if (ok)
        *out = p;
    else
        plan_finish(&p);
    return ok;
}

void plan_finish(struct plan *p)
{
    for (int k = 0; k < p->n_lights; k++)
        free(p->light[k]);
    for (int k = 0; k < p->n_filters; k++)
        free(p->filter[k]);
    free(p->light);
    free(p->filter);
    free(p->focus_per_m);
    free(p->name);
    free(p->path);
    *p = (struct plan){0};
}

int plan_groups(const struct plan *p, const struct rig *rig, struct plan_group **out)
{
    const int lights = p->n_lights ? p->n_lights : 1, filters = p->n_filters ? p->n_filters : 1;
    const int focus = p->n_focus ? p->n_focus : 1;
    struct plan_group *g = xcalloc((size_t)(lights * filters * focus) + 1, sizeof *g);
    int n = 0;
    for (int z = 0; z < focus; z++)
        for (int l = 0; l < lights; l++)
            for (int f = 0; f < filters; f++, n++)
                g[n] = (struct plan_group){
                    .index = n,
                    .light = p->n_lights ? rig_light_index(rig, p->light[l]) : -1,
                    .filter = p->n_filters ? rig_filter_index(rig, p->filter[f]) : -1,
                    .focus_per_m = p->n_focus ? p->focus_per_m[z] : rig->camera.focus_per_m,
                    .kind = SESSION_LIGHT,
                };
    if (p->darks)
        g[n] = (struct plan_group){n, -1, -1, NAN, SESSION_DARK}, n++;
    *out = g;
    return n;
}

int64_t plan_round(const struct cam_caps *c, int64_t ns)
{
    if (c->exposure_step_ns > 0)
        ns = (ns + c->exposure_step_ns / 2) / c->exposure_step_ns * c->exposure_step_ns;
    ns = ns > c->exposure_max_ns ? c->exposure_max_ns : ns;
    return ns < c->exposure_min_ns ? c->exposure_min_ns : ns;
}

int64_t plan_on_ns(const struct cam_caps *c, const struct rig_light *light, int64_t exposure_ns)
{
    return llround(1e9 * (light->lead_s + light->lag_s)) + exposure_ns + c->row_ns * (c->h - 1);
}

int plan_bracket(const struct plan *p, const struct cam_caps *c, const struct rig_light *light,
                 int64_t first_ns, int64_t out[PLAN_MAX_EXPOSURES])
{
    const int most = (int)floor(p->span_stops / p->step_stops + 1e-6) + 1;
    int n = 0;
    for (int k = 0; k < most; k++) {
        const double asked_ns = (double)first_ns * exp2(k * p->step_stops);
        if (asked_ns > (double)c->exposure_max_ns)
            break;
        const int64_t ns = plan_round(c, llround(asked_ns));
        if (light && plan_on_ns(c, light, ns) > llround(1e9 * light->max_on_s))
            break;
        if (!n || ns > out[n - 1])
            out[n++] = ns;
    }
    return n;
}

int plan_steps(const struct plan *p, const struct rig *rig, const struct plan_group *g,
               const int64_t *exposure_ns, int n, const struct cam_caps *caps, int first,
               struct session_step **out)
{
    const int repeats = g->kind == SESSION_DARK ? p->darks : p->repeats;
    struct session_step *step = xcalloc((size_t)(n * repeats) + 1, sizeof *step);
    for (int k = 0; k < n * repeats; k++) {
        step[k] = (struct session_step){
            .index = first + k,
            .group = g->index,
            .repeat = k / n,
            .kind = g->kind,
            .exposure_ns = plan_round(caps, exposure_ns[k % n]),
            .gain = isnan(p->gain) ? rig->camera.gain : p->gain,
            .focus_per_m = g->focus_per_m,
        };
        snprintf(step[k].light, SESSION_NAME, "%s", g->light < 0 ? "" : rig->light[g->light].name);
        snprintf(step[k].filter, SESSION_NAME, "%s",
                 g->filter < 0 ? "" : rig->filter[g->filter].name);
    }
    *out = step;
    return n * repeats;
}
