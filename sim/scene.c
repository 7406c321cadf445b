// scene.c - reading a simulated world.
#define _GNU_SOURCE
#include "sim/scene.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

const char sim_scene_default[] = "sample: {kind: lcd, pitch: 25um}\n";

static bool read_sensor(struct sim_sensor *s, struct ynode *root, const struct rig *rig,
                        struct err *e)
{
    struct ynode *y = NULL;
    int color = 0;
    *s = (struct sim_sensor){
        .bits = 12,
        .black = 256,
        .responsivity = 4e5,
        .electrons_per_count = 2.5,
        .shot_noise = true,
        .full_well = 10500,
        .blooming = 0.5,
        .read_noise = 2.5,
        .dark_current = 4,
        .hot_pixels = 1e-4,
        .hot_current = 2000,
        .prnu = 0.005,
        .fixed_pattern = 0.4,
        .column_pattern = 0.3,
        .black_drift = 0.3,
        .row_s = 10e-6,
        .exposure_step_s = 1e-6,
        .exposure_min_s = 10e-6,
        .exposure_max_s = 10,
    };
    if (rig && rig->camera.bits)
        s->bits = rig->camera.bits;
    if (rig && !isnan(rig->camera.black))
        s->black = rig->camera.black;
    if (rig && rig->camera.responsivity > 0)
        s->responsivity = rig->camera.responsivity;
    if (!ymap_map(root, "sensor", Y_OPTIONAL, &y, e))
        return false;
    if (!y)
        return true;
    if (!ymap_int(y, "bits", Y_OPTIONAL, 8, 16, &s->bits, e) ||
        !ymap_num(y, "black", Y_OPTIONAL, UNIT_NONE, 0, 0.5 * (1 << s->bits), &s->black, e) ||
        !ymap_num(y, "responsivity", Y_OPTIONAL, UNIT_NONE, 1e-9, 1e12, &s->responsivity, e) ||
        !ymap_num(y, "electrons-per-count", Y_OPTIONAL, UNIT_NONE, 1e-3, 1e4,
                  &s->electrons_per_count, e) ||
        !ymap_bool(y, "shot-noise", Y_OPTIONAL, &s->shot_noise, e) ||
        !ymap_num(y, "row-time", Y_OPTIONAL, UNIT_S, 0, 1e-3, &s->row_s, e) ||
        !ymap_num(y, "exposure-step", Y_OPTIONAL, UNIT_S, 1e-9, 1e-2, &s->exposure_step_s, e) ||
        !ymap_num(y, "exposure-min", Y_OPTIONAL, UNIT_S, 1e-9, 10, &s->exposure_min_s, e) ||
        !ymap_num(y, "exposure-max", Y_OPTIONAL, UNIT_S, s->exposure_min_s, 3600,
                  &s->exposure_max_s, e) ||
        !ymap_choice(y, "color", Y_OPTIONAL, "mono|bayer", &color, e))
        return false;
    s->bayer = color == 1;
    const struct {
        const char *key;
        double lo, hi, *at;
    } flaws[] = {
        {"full-well", 1, 1e9, &s->full_well},
        {"blooming", 0, 1, &s->blooming},
        {"read-noise", 0, 1e6, &s->read_noise},
        {"dark-current", 0, 1e9, &s->dark_current},
        {"hot-pixels", 0, 1, &s->hot_pixels},
        {"hot-current", 0, 1e9, &s->hot_current},
        {"prnu", 0, 0.5, &s->prnu},
        {"fixed-pattern", 0, 1000, &s->fixed_pattern},
        {"column-pattern", 0, 1000, &s->column_pattern},
        {"black-drift", 0, 1000, &s->black_drift},
    };
    for (size_t k = 0; k < sizeof flaws / sizeof *flaws; k++)
        if (!ymap_num(y, flaws[k].key, Y_OPTIONAL, UNIT_NONE, flaws[k].lo, flaws[k].hi, flaws[k].at,
                      e))
            return false;
    return true;
}

static bool read_all(struct sim_scene *s, struct yaml *y, const struct rig *rig, struct err *e)
{
    struct ynode *root = yaml_root(y), *sample = NULL;
    int target = SIM_SAMPLE;
    const bool ok = ymap_choice(root, "target", Y_OPTIONAL, "sample|board|ball|even", &target, e) &&
                    ymap_map(root, "sample", Y_NEEDED, &sample, e) &&
                    sample_read(&s->sample, sample, s->path, e) &&
                    read_sensor(&s->sensor, root, rig, e) &&
                    view_read(&s->view, root, &s->sample, e) && bokeh_read(&s->bokeh, root, e) &&
                    board_read(&s->board, root, s->path, e) && ball_read(&s->ball, root, e);
    s->target = (enum sim_target)target;
    struct err ignored;
    return yaml_close(y, ok, ok ? e : &ignored) && ok;
}

static bool finish_reading(struct sim_scene *s, const char *name, struct yaml *y,
                           const struct rig *rig, struct err *e)
{
    struct sim_scene got = {.path = xstrdup(name)};
    if (!read_all(&got, y, rig, e)) {
        sim_scene_finish(&got);
        return false;
    }
    *s = got;
    return true;
}

bool sim_scene_open(struct sim_scene *s, const char *path, const struct rig *rig, struct err *e)
{
    struct yaml *y = NULL;
    return yaml_open(&y, path, e) && finish_reading(s, path, y, rig, e);
}

bool sim_scene_open_text(struct sim_scene *s, const char *name, const char *text,
                         const struct rig *rig, struct err *e)
{
    struct yaml *y = NULL;
    return yaml_open_text(&y, name, text, e) && finish_reading(s, name, y, rig, e);
}

void sim_scene_finish(struct sim_scene *s)
{
    if (!s)
        return;
    free(s->path);
    sample_finish(&s->sample);
    image_finish(&s->board.picture);
    *s = (struct sim_scene){0};
}
