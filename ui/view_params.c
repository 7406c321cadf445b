// view_params.c - the table of what can be set.
#define _GNU_SOURCE
#include "ui/view_params.h"
#include <math.h>
#include <string.h>

#define DEG (M_PI / 180)
static const char kinds[] = "none\0table\0slits\0G04\0";

const struct param_info param_info[PARAMS] = {
    [PARAM_EXPOSURE] = {"exposure", "exposure", -30, 30, 0, 1, "%+.1f EV", .cost = COST_SHOW},
    [PARAM_OFFSET] = {"offset", "offset", -1, 1, 0, 1, "%+.2f", .cost = COST_SHOW},
    [PARAM_LOOK] = {"look", "colours", 0, 1, 0, 1, .choices = "as seen\0false colour\0"},
    [PARAM_DECADES] = {"decades", "scale", 1, 10, 4, 1, "%.1f decades"},
    [PARAM_COMPARE] = {"compare", "compare", 0, 2, 0, 1, .choices = "off\0split\0difference\0",
                       .cost = COST_DRAW},
    [PARAM_SPLIT] = {"split", NULL, 0, 1, 0.5, 1, "%.2f"},
    [PARAM_ZEBRA] = {"zebra", NULL, 0, 1, 0, 1, "%.0f"},
    [PARAM_ORDERS] = {"orders", NULL, 0, 1, 0, 1, "%.0f"},
    [PARAM_PITCH] = {"pitch", "pitch", 0.2e-6, 200e-6, 25e-6, 1e-6, "%.2f µm", .log = true},
    [PARAM_LAMBDA] = {"lambda", "wavelength", 380e-9, 780e-9, 530e-9, 1e-9, "%.0f nm"},
    [PARAM_H_PER_PX] = {"h-per-pixel", "h per pixel", 1e-5, 1e-1, 7.2e-4, 1e-3, "%.4f /1000",
                        .log = true},
    [PARAM_KIND] = {"kind", "sample", 0, 3, 1, 1, .choices = kinds, .cost = COST_DRAW},
    [PARAM_AGAINST] = {"against", "against", 0, 3, 0, 1, .choices = kinds, .cost = COST_DRAW},
    [PARAM_TABLES] = {"tables", NULL, 0, 1000, 0, 1, "%.0f", .cost = COST_DRAW},
    [PARAM_GAIN] = {"gain", "gain", 0, 100, 1, 1, "%.2f", .log = true, .cost = COST_DRAW},
    [PARAM_ROUGHNESS] = {"roughness", "roughness", 0.01, 1, 0.25, 1, "%.3f", .log = true,
                         .cost = COST_DRAW},
    [PARAM_LIGHT_EV] = {"light", "light", -10, 10, 0, 1, "%+.1f EV", .cost = COST_DRAW},
    [PARAM_LIGHT_YAW] = {"light-yaw", "light turn", -M_PI, M_PI, 0, DEG, "%.1f°",
                         .cost = COST_DRAW},
    [PARAM_LIGHT_PITCH] = {"light-rise", "light rise", -M_PI / 2, M_PI / 2, 0, DEG, "%.1f°",
                           .cost = COST_DRAW},
    [PARAM_YAW] = {"yaw", "turn", -M_PI, M_PI, 0, DEG, "%.1f°", .cost = COST_DRAW},
    [PARAM_RISE] = {"rise", "rise", -M_PI, M_PI, 0, DEG, "%.1f°", .cost = COST_DRAW},
    [PARAM_DISTANCE] = {"distance", "distance", 0.05, 20, 1, 1, "x %.2f", .log = true,
                        .cost = COST_DRAW},
    [PARAM_PAN_X] = {"pan-x", NULL, -5, 5, 0, 1, "%.3f", .cost = COST_DRAW},
    [PARAM_PAN_Y] = {"pan-y", NULL, -5, 5, 0, 1, "%.3f", .cost = COST_DRAW},
    [PARAM_ROOM_TURN] = {"room-turn", "room turn", -M_PI, M_PI, 0, DEG, "%.0f°", .cost = COST_ROOM},
    [PARAM_SPECTRUM] = {"spectrum", "spectrum", 0, 6, 0, 1,
                        .choices = "the scene's\0E\0A\0D65\0F1\0F11\0inverse-A\0",
                        .cost = COST_ROOM},
    [PARAM_ROOM_EV] = {"room", "room light", -10, 10, 0, 1, "%+.1f EV", .cost = COST_ROOM},
};

struct params params_start(void)
{
    struct params p;
    for (int k = 0; k < PARAMS; k++)
        p.v[k] = param_info[k].start;
    return p;
}

const char *param_choice(const struct params *p, enum param k)
{
    const char *name = param_info[k].choices;
    for (int i = (int)p->v[k]; i > 0; i--)
        name += strlen(name) + 1;
    return name;
}

int param_find(const char *name)
{
    for (int k = 0; k < PARAMS; k++)
        if (!strcmp(param_info[k].name, name))
            return k;
    return -1;
}

bool param_set(struct params *p, enum param k, double value)
{
    const struct param_info *i = &param_info[k];
    const double before = p->v[k];
    if (i->lo == -M_PI && i->hi == M_PI)
        value = remainder(value, 2 * M_PI);
    p->v[k] = isnan(value) ? before : fmax(i->lo, fmin(i->hi, value));
    return p->v[k] < before || p->v[k] > before;
}

int params_differ(const struct params *a, const struct params *b, enum param *first)
{
    int cost = -1;
    for (int k = PARAMS - 1; k >= 0; k--)
        if (a->v[k] < b->v[k] || a->v[k] > b->v[k]) {
            cost = cost > (int)param_info[k].cost ? cost : (int)param_info[k].cost;
            if (first)
                *first = (enum param)k;
        }
    return cost;
}
