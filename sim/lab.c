// lab.c - rig and scene together, and the photographs that they make.
#define _GNU_SOURCE
#include "sim/lab.h"
#include "core/mem.h"
#include <libgen.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

bool lab_open(struct lab *lab, const char *scene, const char *rig, struct err *e)
{
    struct rig r = {0};
    const bool with_rig = rig && *rig;
    if (with_rig && !rig_open(&r, rig, e))
        return false;
    struct sim_scene s = {0};
    bool ok;
    if (!scene || !*scene) {
        ok = sim_scene_open_text(&s, "built-in scene", sim_scene_default, with_rig ? &r : NULL, e);
    } else {
        char *folder = xstrdup(with_rig ? rig : "x");
        char *path = *scene == '/' ? xstrdup(scene) : xasprintf("%s/%s", dirname(folder), scene);
        ok = sim_scene_open(&s, !with_rig ? scene : path, with_rig ? &r : NULL, e);
        free(path);
        free(folder);
    }
    if (!ok) {
        rig_finish(&r);
        return false;
    }
    *lab = (struct lab){.rig = r, .scene = s, .focus_per_m = NAN};
    return true;
}

static void drop_photos(struct lab *lab)
{
    for (int l = 0; l < LAB_LINES; l++)
        for (int f = 0; f < LAB_POSITIONS; f++)
            image_finish(&lab->shot[l][f]);
}

void lab_finish(struct lab *lab)
{
    if (!lab)
        return;
    drop_photos(lab);
    rig_finish(&lab->rig);
    sim_scene_finish(&lab->scene);
}

static int light_on(const struct rig *r, int line)
{
    for (int k = 0; k < r->n_lights; k++)
        if (r->light[k].line == line)
            return k;
    return -1;
}

static int filter_at(const struct rig *r, int position)
{
    for (int k = 0; k < r->n_filters; k++)
        if (r->filter[k].position == position)
            return k;
    return -1;
}

bool lab_band(const struct lab *lab, int line, int position, struct band *b, struct err *e)
{
    static const double builtin_nm[3] = {530, 650, 450};
    const bool bayer = lab->scene.sensor.bayer;
    if (!lab->rig.path) {
        const bool narrow = position >= 0 && position < 3;
        return band_gaussian(b, narrow ? builtin_nm[position] * 1e-9 : 560e-9,
                             narrow ? 10e-9 : 180e-9, 1, bayer, e);
    }
    const int light = light_on(&lab->rig, line);
    if (light < 0)
        return err_set(e, ERR_DATA, "%s: no light is on line %d", lab->rig.path, line);
    return band_of_rig(b, &lab->rig, light, filter_at(&lab->rig, position), bayer, e);
}

void lab_focus(struct lab *lab, double focus_per_m)
{
    const bool same =
        isnan(focus_per_m) ? isnan(lab->focus_per_m) : focus_per_m == lab->focus_per_m;
    if (!same)
        drop_photos(lab);
    lab->focus_per_m = focus_per_m;
}

bool lab_photo(struct lab *lab, int line, int position, const struct image **out, struct err *e)
{
    if (line < 0 || line >= LAB_LINES || position < -1 || position >= LAB_POSITIONS)
        return err_set(e, ERR_DATA, "no line %d or no position %d", line, position);
    struct image *kept = &lab->shot[line][position < 0 ? LAB_POSITIONS - 1 : position];
    struct band b = {0};
    const bool ok = kept->px || (lab_band(lab, line, position, &b, e) &&
                                 photo_focused(&lab->scene, &b, lab->focus_per_m, kept, e));
    band_finish(&b);
    if (ok)
        *out = kept;
    return ok;
}
