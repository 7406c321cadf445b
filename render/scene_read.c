// scene_read.c - scene files: YAML with units, errors with file and line (docs/render.md).
#define _GNU_SOURCE
#include "core/mem.h"
#include "core/spectrum.h"
#include "core/yaml.h"
#include "render/scene.h"
#include <stdlib.h>
#include <string.h>

static const double FAR_M = 1e6;

static bool read_nums(struct ynode *map, const char *key, enum yneed need, enum unit unit, int n,
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

static bool read_vec(struct ynode *map, const char *key, enum yneed need, enum unit unit,
                     struct vec3 *out, struct err *e)
{
    double v[3] = {out->x, out->y, out->z};
    if (!read_nums(map, key, need, unit, 3, -FAR_M, FAR_M, v, e))
        return false;
    *out = v3(v[0], v[1], v[2]);
    return true;
}

// One number for all channels, or [r, g, b].
static bool read_color(struct ynode *map, const char *key, double hi, double out[3], struct err *e)
{
    struct ynode *n = ymap_find(map, key);
    if (n && ynode_is_list(n))
        return read_nums(map, key, Y_NEEDED, UNIT_NONE, 3, 0, hi, out, e);
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
        !read_vec(map, "eye", Y_NEEDED, UNIT_M, &c->eye_m, e) ||
        !read_vec(map, "target", Y_OPTIONAL, UNIT_M, &c->target_m, e) ||
        !read_vec(map, "up", Y_OPTIONAL, UNIT_NONE, &c->up, e) ||
        !ymap_num(map, "fov", Y_OPTIONAL, UNIT_RAD, 1e-4, 3, &c->fov_rad, e))
        return false;
    struct frame f;
    return frame_from(c->up, v3_sub(c->target_m, c->eye_m), &f) ||
           yaml_bad(map, e, "eye and target must differ, and up must not lie along the view");
}

static bool read_light(struct ynode *map, struct light *l, struct err *e)
{
    *l = (struct light){.power = 1};
    if (!ynode_is_map(map))
        return yaml_bad(map, e, "a light is a map with 'at' (near) or 'towards' (far)");
    struct ynode *at = ymap_find(map, "at"), *towards = ymap_find(map, "towards");
    if (!at == !towards)
        return yaml_bad(map, e,
                        "a light needs one of 'at' (a near point) and 'towards' (the "
                        "direction of a far light)");
    l->is_far = towards != NULL;
    if (at)
        return read_vec(map, "at", Y_NEEDED, UNIT_M, &l->at, e) &&
               ymap_num(map, "intensity", Y_OPTIONAL, UNIT_NONE, 0, INFINITY, &l->power, e) &&
               ymap_num(map, "radius", Y_OPTIONAL, UNIT_M, 0, FAR_M, &l->radius_m, e);
    if (!read_vec(map, "towards", Y_NEEDED, UNIT_NONE, &l->at, e) ||
        !ymap_num(map, "irradiance", Y_OPTIONAL, UNIT_NONE, 0, INFINITY, &l->power, e) ||
        !ymap_num(map, "radius", Y_OPTIONAL, UNIT_RAD, 0, 1, &l->radius_m, e))
        return false;
    if (!(v3_norm(l->at) > 0))
        return yaml_bad(towards, e, "must not be zero");
    l->at = v3_unit(l->at);
    return true;
}

static bool read_lights(struct ynode *root, struct scene *s, struct err *e)
{
    struct ynode *list = NULL;
    if (!ymap_list(root, "lights", Y_NEEDED, &list, e))
        return false;
    const int n = ylist_count(list);
    if (n < 1 || n > SCENE_MAX_LIGHTS)
        return yaml_bad(list, e, "has %d lights: 1 to %d are possible", n, SCENE_MAX_LIGHTS);
    s->light = xcalloc((size_t)n, sizeof *s->light);
    for (s->n_lights = 0; s->n_lights < n; s->n_lights++)
        if (!read_light(ylist_at(list, s->n_lights), &s->light[s->n_lights], e))
            return false;
    return true;
}

static bool read_shape(struct ynode *map, struct shape *s, struct err *e)
{
    int kind = SHAPE_PLANE;
    double size[2] = {0.1, 0.1};
    struct vec3 normal = v3(0, 0, 1), tangent = v3(1, 0, 0);
    *s = (struct shape){.radius_m = 0.06, .span_rad = 2 * M_PI};
    if (!ymap_choice(map, "shape", Y_OPTIONAL, "plane|disc|cylinder|sphere", &kind, e) ||
        !read_vec(map, "at", Y_OPTIONAL, UNIT_M, &s->at_m, e) ||
        !read_vec(map, "normal", Y_OPTIONAL, UNIT_NONE, &normal, e) ||
        !read_vec(map, "tangent", Y_OPTIONAL, UNIT_NONE, &tangent, e))
        return false;
    s->kind = (enum shape_kind)kind;
    if (!frame_from(tangent, normal, &s->frame))
        return yaml_bad(map, e, "normal and tangent must not be zero or parallel");
    switch (s->kind) {
    case SHAPE_PLANE:
        if (!read_nums(map, "size", Y_OPTIONAL, UNIT_M, 2, 1e-9, FAR_M, size, e))
            return false;
        break;
    case SHAPE_DISC: {
        int tangents = 0;
        if (!ymap_num(map, "radius", Y_OPTIONAL, UNIT_M, 1e-9, FAR_M, &s->radius_m, e) ||
            !ymap_num(map, "inner", Y_OPTIONAL, UNIT_M, 0, s->radius_m, &s->inner_m, e) ||
            !ymap_choice(map, "tangents", Y_OPTIONAL, "radial|fixed", &tangents, e))
            return false;
        s->fixed_tangent = tangents == 1;
        break;
    }
    case SHAPE_CYLINDER:
        if (!ymap_num(map, "radius", Y_OPTIONAL, UNIT_M, 1e-9, FAR_M, &s->radius_m, e) ||
            !ymap_num(map, "height", Y_OPTIONAL, UNIT_M, 1e-9, FAR_M, &size[1], e) ||
            !ymap_num(map, "span", Y_OPTIONAL, UNIT_RAD, 1e-6, 2 * M_PI, &s->span_rad, e))
            return false;
        break;
    case SHAPE_SPHERE:
        if (!ymap_num(map, "radius", Y_OPTIONAL, UNIT_M, 1e-9, FAR_M, &s->radius_m, e))
            return false;
        break;
    }
    s->width_m = size[0];
    s->height_m = size[1];
    return true;
}

// `name` beside the file `beside`, unless it is absolute.
static char *path_beside(const char *beside, const char *name)
{
    const char *slash = strrchr(beside, '/');
    if (*name == '/' || !slash)
        return xstrdup(name);
    return xasprintf("%.*s/%s", (int)(slash - beside), beside, name);
}

static bool read_table(struct ynode *map, const char *scene_path, const char *instead, double r0,
                       struct material *m, struct err *e)
{
    const char *name = NULL;
    struct table_nodes nodes = {NAN, 1};
    if (!ymap_text(map, "table", Y_OPTIONAL, &name, e) ||
        !ymap_num(map, "range", Y_OPTIONAL, UNIT_NONE, 1e-9, 2, &nodes.range, e) ||
        !ymap_int(map, "power", Y_OPTIONAL, 1, 99, &nodes.power, e))
        return false;
    if (!name && !instead)
        return true;
    struct table t;
    char *path = instead ? xstrdup(instead) : path_beside(scene_path, name);
    const bool ok = table_read(&t, path, isnan(nodes.range) ? NULL : &nodes, e);
    free(path);
    if (!ok)
        return instead ? false
                       : err_in(e, "%s:%d", scene_path, ynode_line(ymap_find(map, "table")));
    material_take_table(m, &t, r0);
    return true;
}

static bool read_material(struct ynode *map, const char *scene_path, const char *instead,
                          struct material *m, struct err *e)
{
    material_init(m);
    double r0 = NAN, gain = 1;
    if (!read_color(map, "diffuse", 1, m->diffuse, e) ||
        !read_color(map, "specular", 1, m->specular, e) ||
        !ymap_num(map, "roughness", Y_OPTIONAL, UNIT_NONE, 1e-4, 2, &m->roughness, e) ||
        !ymap_num(map, "coat", Y_OPTIONAL, UNIT_NONE, 1, 4, &m->coat_ior, e) ||
        !ymap_num(map, "r0", Y_OPTIONAL, UNIT_NONE, 0, 1, &r0, e) ||
        !ymap_num(map, "gain", Y_OPTIONAL, UNIT_NONE, 0, INFINITY, &gain, e) ||
        !ymap_int(map, "tables", Y_OPTIONAL, 1, 1000, &m->tables_used, e) ||
        !read_table(map, scene_path, instead, r0, m, e))
        return false;
    m->gain *= gain;
    return true;
}

static bool read_objects(struct ynode *root, struct scene *s, const char *instead, struct err *e)
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
        struct object *o = &s->object[k];
        struct ynode *map = k ? ylist_at(others, k - 1) : sample;
        const char *name = k ? "object" : "sample";
        if (!ynode_is_map(map))
            return yaml_bad(map, e, "an object is a map with 'shape' and its material");
        if (!ymap_text(map, "name", Y_OPTIONAL, &name, e))
            return false;
        o->name = xstrdup(name);
        if (!read_shape(map, &o->shape, e) ||
            !read_material(map, s->path, k ? NULL : instead, &o->material, e))
            return false;
    }
    return true;
}

static bool read_light_color(struct ynode *root, struct scene *s, struct err *e)
{
    const char *name = NULL;
    if (!ymap_text(root, "illuminant", Y_OPTIONAL, &name, e))
        return false;
    struct spectrum p;
    if (!name)
        name = meta_text(&s->object[0].material.table.meta, "nacre.illuminant");
    if (!name)
        name = "E";
    if (!illuminant_get(&p, name, e))
        return err_in(e, "%s", s->path);
    const double scale = illuminant_scale(&p);
    double xyz[3] = {0}, cmf[3];
    for (int nm = CIE_FIRST_NM; nm <= CIE_LAST_NM; nm++) {
        const double end = nm == CIE_FIRST_NM || nm == CIE_LAST_NM ? .5 : 1;
        cie_xyz(nm * 1e-9, cmf);
        for (int c = 0; c < 3; c++)
            xyz[c] += end * 1e-9 * scale * cmf[c] * spectrum_at(&p, nm * 1e-9);
    }
    spectrum_finish(&p);
    xyz_to_rgb(xyz, s->light_color);
    return true;
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
    if (!read_nums(root, "size", Y_OPTIONAL, UNIT_NONE, 2, 1, 16384, size, e) ||
        !read_color(root, "background", INFINITY, s->background, e) ||
        !read_camera(root, &s->camera, e) || !read_lights(root, s, e) ||
        !read_objects(root, s, o->table, e) || !read_light_color(root, s, e))
        return false;
    s->w = o->w ? o->w : (int)size[0];
    s->h = o->h ? o->h : (int)size[1];
    if (o->exposure_auto || !isnan(o->exposure_ev))
        s->exposure_ev = o->exposure_ev;
    return true;
}

bool scene_read(struct scene *out, const char *path, const struct scene_options *o, struct err *e)
{
    struct scene s = {.path = xstrdup(path)};
    struct yaml *y = NULL;
    struct err ignored;
    bool ok = yaml_open(&y, path, e) && read_all(yaml_root(y), &s, o, e);
    ok = yaml_close(y, ok, ok ? e : &ignored) && ok;
    if (!ok) {
        scene_finish(&s);
        return false;
    }
    *out = s;
    return true;
}
