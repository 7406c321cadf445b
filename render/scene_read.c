// scene_read.c - scene files: YAML with units, errors with file and line (docs/render.md).
#define _GNU_SOURCE
#include "core/mem.h"
#include "core/spectrum.h"
#include "render/scene_fields.h"
#include "render/studio.h"
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

bool field_nums(struct ynode *map, const char *key, enum yneed need, enum unit unit, int n,
                double lo, double hi, double *out, struct err *e)
{
    struct ynode *list = NULL;
    if (!ymap_list(map, key, need, &list, e))
        return false;
    if (!list)
        return true;
    if (ylist_count(list) != n)
        return yaml_bad(list, e, "has %d values, not %d", ylist_count(list), n);
    for (int k = 0; k < n; k++)
        if (!ynode_num(ylist_at(list, k), unit, lo, hi, &out[k], e))
            return false;
    return true;
}

bool field_vec(struct ynode *map, const char *key, enum yneed need, enum unit unit,
               struct vec3 *out, struct err *e)
{
    double v[3] = {out->x, out->y, out->z};
    if (!field_nums(map, key, need, unit, 3, -SCENE_FAR_M, SCENE_FAR_M, v, e))
        return false;
    *out = v3(v[0], v[1], v[2]);
    return true;
}

bool field_color(struct ynode *map, const char *key, double hi, double out[3], struct err *e)
{
    struct ynode *n = ymap_find(map, key);
    if (n && ynode_is_list(n))
        return field_nums(map, key, Y_NEEDED, UNIT_NONE, 3, 0, hi, out, e);
    double grey = NAN;
    if (!ymap_num(map, key, Y_OPTIONAL, UNIT_NONE, 0, hi, &grey, e))
        return false;
    for (int c = 0; c < 3 && !isnan(grey); c++)
        out[c] = grey;
    return true;
}

static bool read_camera(struct ynode *root, struct camera *c, struct err *e)
{
    struct ynode *map = NULL;
    *c = (struct camera){.up = v3(0, 1, 0), .fov_rad = 30 * M_PI / 180};
    if (!ymap_map(root, "camera", Y_NEEDED, &map, e) ||
        !field_vec(map, "eye", Y_NEEDED, UNIT_M, &c->eye_m, e) ||
        !field_vec(map, "target", Y_OPTIONAL, UNIT_M, &c->target_m, e) ||
        !field_vec(map, "up", Y_OPTIONAL, UNIT_NONE, &c->up, e) ||
        !ymap_num(map, "fov", Y_OPTIONAL, UNIT_RAD, 1e-4, 3, &c->fov_rad, e) ||
        !ymap_num(map, "aperture", Y_OPTIONAL, UNIT_M, 0, 1, &c->aperture_m, e) ||
        !ymap_num(map, "focus", Y_OPTIONAL, UNIT_M, 1e-6, SCENE_FAR_M, &c->focus_m, e))
        return false;
    struct frame f;
    return frame_from(c->up, v3_sub(c->target_m, c->eye_m), &f) ||
           yaml_bad(map, e, "eye and target must differ, and up must not lie along the view");
}

static bool read_light(struct ynode *map, struct light *l, struct err *e)
{
    *l = (struct light){.power = 1, .tint = {1, 1, 1}};
    if (!ynode_is_map(map))
        return yaml_bad(map, e, "a light is a map with 'at' (near) or 'towards' (far)");
    struct ynode *at = ymap_find(map, "at"), *towards = ymap_find(map, "towards");
    if (!at == !towards)
        return yaml_bad(map, e,
                        "a light needs one of 'at' (a near point) and 'towards' (the "
                        "direction of a far light)");
    l->is_far = towards != NULL;
    if (!field_color(map, "tint", INFINITY, l->tint, e))
        return false;
    if (at)
        return field_vec(map, "at", Y_NEEDED, UNIT_M, &l->at, e) &&
               ymap_num(map, "intensity", Y_OPTIONAL, UNIT_NONE, 0, INFINITY, &l->power, e) &&
               ymap_num(map, "radius", Y_OPTIONAL, UNIT_M, 0, SCENE_FAR_M, &l->radius_m, e);
    if (!field_vec(map, "towards", Y_NEEDED, UNIT_NONE, &l->at, e) ||
        !ymap_num(map, "irradiance", Y_OPTIONAL, UNIT_NONE, 0, INFINITY, &l->power, e) ||
        !ymap_num(map, "radius", Y_OPTIONAL, UNIT_RAD, 0, 1, &l->radius_m, e))
        return false;
    if (!(v3_norm(l->at) > 0))
        return yaml_bad(towards, e, "must not be zero");
    l->at = v3_unit(l->at);
    return true;
}

// `array: {count: [4, 3], pitch: [10mm, 10mm]}` around `at`, facing `target`: that many LEDs which
// share the intensity.
static bool add_lights(struct ynode *map, struct scene *s, struct err *e)
{
    struct light one;
    struct ynode *array = NULL;
    double count[2] = {1, 1}, pitch_m[2] = {0, 0};
    if (!read_light(map, &one, e) || !ymap_map(map, "array", Y_OPTIONAL, &array, e))
        return false;
    if (array &&
        (!field_nums(array, "count", Y_NEEDED, UNIT_NONE, 2, 1, SCENE_MAX_LIGHTS, count, e) ||
         !field_nums(array, "pitch", Y_NEEDED, UNIT_M, 2, 0, SCENE_FAR_M, pitch_m, e)))
        return false;
    if (array && one.is_far)
        return yaml_bad(array, e, "needs a near light ('at')");
    const int nx = (int)count[0], ny = (int)count[1];
    if (s->n_lights + nx * ny > SCENE_MAX_LIGHTS)
        return yaml_bad(map, e, "makes more than %d lights", SCENE_MAX_LIGHTS);
    struct frame f = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const struct vec3 way = v3_sub(s->camera.target_m, one.at);
    if (array && !frame_from(v3_cross(s->camera.up, way), way, &f))
        return yaml_bad(array, e, "lies along the camera's 'up' from its target");
    s->light = xrealloc(s->light, (size_t)(s->n_lights + nx * ny), sizeof *s->light);
    one.power /= nx * ny;
    for (int k = 0; k < nx * ny; k++) {
        struct light *l = &s->light[s->n_lights++];
        *l = one;
        const double x = (k % nx - (nx - 1) / 2.0) * pitch_m[0];
        const double y = (k / nx - (ny - 1) / 2.0) * pitch_m[1];
        l->at = v3_add(one.at, frame_world(&f, v3(x, y, 0)));
    }
    return true;
}

static bool read_lights(struct ynode *root, struct scene *s, struct err *e)
{
    struct ynode *list = NULL;
    if (!ymap_list(root, "lights", s->surround ? Y_OPTIONAL : Y_NEEDED, &list, e))
        return false;
    if (list && ylist_count(list) < 1)
        return yaml_bad(list, e, "needs at least one light");
    for (int k = 0; list && k < ylist_count(list); k++)
        if (!add_lights(ylist_at(list, k), s, e))
            return false;
    return true;
}

char *scene_file(const struct scene *s, const struct scene_options *o, const char *name)
{
    const char *slash = strrchr(s->path, '/');
    if (*name == '/')
        return xstrdup(name);
    char *beside =
        slash ? xasprintf("%.*s/%s", (int)(slash - s->path), s->path, name) : xstrdup(name);
    char *below = xasprintf("%s/%s", o->tables ? o->tables : ".", name);
    const bool use_below = o->tables && access(beside, R_OK) && !access(below, R_OK);
    free(use_below ? beside : below);
    return use_below ? below : beside;
}

static bool read_surround(struct ynode *root, struct scene *s, const struct scene_options *o,
                          struct err *e)
{
    struct ynode *map = NULL;
    const char *name = NULL;
    double intensity = 1, turn_rad = 0;
    bool shown = true;
    s->seen_size = 1024;
    if (!ymap_map(root, "environment", Y_OPTIONAL, &map, e))
        return false;
    if (!map)
        return true;
    if (!ymap_text(map, "map", Y_NEEDED, &name, e) ||
        !ymap_num(map, "intensity", Y_OPTIONAL, UNIT_NONE, 0, 1e12, &intensity, e) ||
        !ymap_num(map, "turn", Y_OPTIONAL, UNIT_RAD, -100, 100, &turn_rad, e) ||
        !ymap_int(map, "nodes", Y_OPTIONAL, 16, 8192, &s->seen_size, e) ||
        !ymap_bool(map, "shown", Y_OPTIONAL, &shown, e))
        return false;
    struct environment env;
    bool ok;
    if (o->environment || !strcmp(name, "studio")) {
        ok = studio_or_file(&env, o->environment ? o->environment : name, e);
    } else {
        char *path = scene_file(s, o, name);
        ok = environment_read(&env, path, e) ||
             err_in(e, "%s:%d", s->path, ynode_line(ymap_find(map, "map")));
        free(path);
    }
    if (!ok)
        return false;
    s->surround = xcalloc(1, sizeof *s->surround);
    if (o->nodes)
        s->seen_size = o->nodes;
    ok = surround_init(s->surround, &env, intensity, turn_rad, e);
    s->surround->shown = shown;
    return ok;
}

static bool read_objects(struct ynode *root, struct scene *s, const struct scene_options *o,
                         struct err *e)
{
    struct ynode *sample = NULL, *others = NULL;
    if (!ymap_map(root, "sample", Y_NEEDED, &sample, e) ||
        !ymap_list(root, "objects", Y_OPTIONAL, &others, e))
        return false;
    const int n = 1 + (others ? ylist_count(others) : 0);
    if (n > SCENE_MAX_OBJECTS)
        return yaml_bad(others, e, "has more than %d objects", SCENE_MAX_OBJECTS - 1);
    s->object = xcalloc((size_t)n, sizeof *s->object);
    while (s->n_objects < n) {
        const int k = s->n_objects++;
        struct object *object = &s->object[k];
        struct ynode *map = k ? ylist_at(others, k - 1) : sample;
        const char *name = k ? "object" : "sample";
        if (!ynode_is_map(map))
            return yaml_bad(map, e, "an object is a map with 'shape' and its material");
        if (!ymap_text(map, "name", Y_OPTIONAL, &name, e))
            return false;
        object->name = xstrdup(name);
        if (!scene_read_shape(map, s, o, &object->shape, e) ||
            !scene_read_material(map, s, o, k == 0, &object->material, e))
            return false;
    }
    return true;
}

// Tables are summed for one light: another needs the photograph.
static bool check_illuminant(const struct scene *s, const char *name, struct err *e)
{
    for (int k = 0; k < s->n_objects; k++) {
        const struct material *m = &s->object[k].material;
        if (m->table.n && !m->photo)
            return err_set(e, ERR_DATA,
                           "%s: the table of %s cannot be lit by %s: a 'photo' in its place can",
                           s->path, s->object[k].name, name);
    }
    return true;
}

static bool light_object(struct material *m, const struct spectrum *light, struct err *e)
{
    struct table t;
    if (m->slits.n && !slits_light(&m->slits, light, m->slits.n, e))
        return false;
    if (!m->photo || m->table.n) // factors may stand for its table
        return true;
    const enum diffraction chosen = m->diffraction;
    if (!photo_table(m->photo, light, &t, e))
        return false;
    material_take_table(m, &t, m->r0);
    m->diffraction = chosen;
    return true;
}

// The lights' spectrum: as asked, as the scene says, else the one the sample's table was made for.
static bool read_illuminant(struct ynode *root, struct scene *s, const struct scene_options *o,
                            struct err *e)
{
    const char *name = NULL;
    if (!ymap_text(root, "illuminant", Y_OPTIONAL, &name, e) ||
        (o->illuminant && !check_illuminant(s, o->illuminant, e)))
        return false;
    if (o->illuminant)
        name = o->illuminant;
    if (!name)
        name = meta_text(&s->object[0].material.table.meta, "nacre.illuminant");
    struct spectrum p;
    if (!illuminant_get(&p, name ? name : "E", e))
        return err_in(e, "%s", s->path);
    bool ok = light_color(&p, s->light_color, e);
    for (int k = 0; k < s->n_objects && ok; k++)
        ok = light_object(&s->object[k].material, &p, e);
    spectrum_finish(&p);
    return ok || err_in(e, "%s", s->path);
}

static bool read_all(struct ynode *root, struct scene *s, const struct scene_options *o,
                     struct err *e)
{
    double size[2] = {960, 720};
    struct ynode *exposure = ymap_find(root, "exposure");
    s->exposure_ev = NAN;
    if (exposure && strcmp(ynode_text(exposure), "auto") &&
        !ynode_num(exposure, UNIT_NONE, -60, 60, &s->exposure_ev, e))
        return false;
    if (!field_nums(root, "size", Y_OPTIONAL, UNIT_NONE, 2, 1, 16384, size, e) ||
        !field_color(root, "background", INFINITY, s->background, e) ||
        !read_camera(root, &s->camera, e) || !read_surround(root, s, o, e) ||
        !read_lights(root, s, e) || !read_objects(root, s, o, e) || !read_illuminant(root, s, o, e))
        return false;
    s->w = o->w ? o->w : (int)size[0];
    s->h = o->h ? o->h : (int)size[1];
    if (o->exposure_auto || !isnan(o->exposure_ev))
        s->exposure_ev = o->exposure_ev;
    return true;
}

bool scene_read(struct scene *out, const char *path, const struct scene_options *o, struct err *e)
{
    struct scene s = {.path = xstrdup(path), .still = o->still};
    struct yaml *y = NULL;
    struct err ignored;
    bool ok = yaml_open(&y, path, e) && read_all(yaml_root(y), &s, o, e);
    for (int k = 0; k < s.n_objects && !o->still; k++)
        s.object[k].keep = env_keep_new();
    ok = yaml_close(y, ok, ok ? e : &ignored) && ok && scene_prefilter(&s, e);
    if (!ok) {
        scene_finish(&s);
        return false;
    }
    *out = s;
    return true;
}
