// scene_object.c - shapes and materials of a scene file (docs/render.md).
#define _GNU_SOURCE
#include "core/imgfile.h"
#include "core/mem.h"
#include "process/factor.h"
#include "render/scene_fields.h"
#include <stdlib.h>
#include <string.h>

static bool read_mesh(struct ynode *map, const struct scene *s, const struct scene_options *o,
                      bool fixed, struct vec3 tangent, struct shape *shape, struct err *e)
{
    const char *name = NULL;
    double scale = 1;
    if (!ymap_text(map, "file", Y_NEEDED, &name, e) ||
        !ymap_num(map, "scale", Y_OPTIONAL, UNIT_NONE, 1e-12, 1e12, &scale, e))
        return false;
    char *path = scene_file(s, o, name);
    const bool ok = mesh_read(&shape->mesh, path, scale, fixed ? &tangent : NULL, e);
    free(path);
    return ok || err_in(e, "%s:%d", s->path, ynode_line(ymap_find(map, "file")));
}

bool scene_read_shape(struct ynode *map, const struct scene *scene, const struct scene_options *o,
                      struct shape *s, struct err *e)
{
    int kind = SHAPE_PLANE, tangents = 0;
    double size[2] = {0.1, 0.1};
    struct vec3 normal = v3(0, 0, 1), tangent = v3(1, 0, 0);
    *s = (struct shape){.radius_m = 0.06, .span_rad = 2 * M_PI};
    if (!ymap_choice(map, "shape", Y_OPTIONAL, "plane|disc|cylinder|sphere|mesh", &kind, e) ||
        !field_vec(map, "at", Y_OPTIONAL, UNIT_M, &s->at_m, e) ||
        !field_vec(map, "normal", Y_OPTIONAL, UNIT_NONE, &normal, e) ||
        !field_vec(map, "tangent", Y_OPTIONAL, UNIT_NONE, &tangent, e))
        return false;
    s->kind = (enum shape_kind)kind;
    if (!frame_from(tangent, normal, &s->frame))
        return yaml_bad(map, e, "normal and tangent must not be zero or parallel");
    switch (s->kind) {
    case SHAPE_PLANE:
        if (!field_nums(map, "size", Y_OPTIONAL, UNIT_M, 2, 1e-9, SCENE_FAR_M, size, e))
            return false;
        break;
    case SHAPE_DISC:
        if (!ymap_num(map, "radius", Y_OPTIONAL, UNIT_M, 1e-9, SCENE_FAR_M, &s->radius_m, e) ||
            !ymap_num(map, "inner", Y_OPTIONAL, UNIT_M, 0, s->radius_m, &s->inner_m, e) ||
            !ymap_choice(map, "tangents", Y_OPTIONAL, "radial|fixed", &tangents, e))
            return false;
        break;
    case SHAPE_CYLINDER:
        if (!ymap_num(map, "radius", Y_OPTIONAL, UNIT_M, 1e-9, SCENE_FAR_M, &s->radius_m, e) ||
            !ymap_num(map, "height", Y_OPTIONAL, UNIT_M, 1e-9, SCENE_FAR_M, &size[1], e) ||
            !ymap_num(map, "span", Y_OPTIONAL, UNIT_RAD, 1e-6, 2 * M_PI, &s->span_rad, e))
            return false;
        break;
    case SHAPE_SPHERE:
        if (!ymap_num(map, "radius", Y_OPTIONAL, UNIT_M, 1e-9, SCENE_FAR_M, &s->radius_m, e))
            return false;
        break;
    case SHAPE_MESH:
        if (!ymap_choice(map, "tangents", Y_OPTIONAL, "uv|fixed", &tangents, e) ||
            !read_mesh(map, scene, o, tangents == 1, v3(1, 0, 0), s, e))
            return false;
        break;
    }
    s->fixed_tangent = tangents == 1;
    s->width_m = size[0];
    s->height_m = size[1];
    return true;
}

static bool read_table(struct ynode *map, const struct scene *s, const struct scene_options *o,
                       const char *instead, double r0, struct material *m, struct err *e)
{
    const char *name = NULL;
    struct table_nodes nodes = {NAN, 1};
    if (!ymap_text(map, "table", Y_OPTIONAL, &name, e) ||
        !ymap_num(map, "range", Y_OPTIONAL, UNIT_NONE, 1e-9, 2, &nodes.range, e) ||
        !ymap_int(map, "power", Y_OPTIONAL, 1, 99, &nodes.power, e) ||
        !ymap_int(map, "tables", Y_OPTIONAL, 1, 1000, &m->tables_used, e))
        return false;
    if (!name && !instead)
        return true;
    struct table t;
    char *path = instead ? xstrdup(instead) : scene_file(s, o, name);
    const bool ok = table_read(&t, path, isnan(nodes.range) ? NULL : &nodes, e);
    free(path);
    if (!ok)
        return instead ? false : err_in(e, "%s:%d", s->path, ynode_line(ymap_find(map, "table")));
    material_take_table(m, &t, r0);
    return true;
}

// The photograph that the table is summed from, once the light is known.
static bool read_photo(struct ynode *map, const struct scene *s, const struct scene_options *o,
                       double r0, struct material *m, struct err *e)
{
    struct ynode *photo = NULL, *center = NULL;
    const char *name = NULL, *channel = NULL;
    double h_per_px = 0, scale = 1, at[2] = {NAN, NAN};
    struct lut_request r = {.f0 = 1,
                            .exponent = 2,
                            .n = 501,
                            .range = 0.35,
                            .power = 1,
                            .is_rgb = true,
                            .tolerance = 1e-4};
    if (!ymap_map(map, "photo", Y_OPTIONAL, &photo, e))
        return false;
    if (!photo)
        return true;
    if (!ymap_text(photo, "file", Y_NEEDED, &name, e) ||
        !ymap_text(photo, "channel", Y_OPTIONAL, &channel, e) ||
        !ymap_num(photo, "lambda", Y_NEEDED, UNIT_M, 380e-9, 780e-9, &r.lambda_m, e) ||
        !ymap_num(photo, "h-per-pixel", Y_NEEDED, UNIT_NONE, 1e-9, 1, &h_per_px, e) ||
        !ymap_list(photo, "center", Y_OPTIONAL, &center, e) ||
        (center && !field_nums(photo, "center", Y_NEEDED, UNIT_NONE, 2, 0, 1e6, at, e)) ||
        !ymap_num(photo, "scale", Y_OPTIONAL, UNIT_NONE, 1e-30, 1e30, &scale, e) ||
        !ymap_num(photo, "f0", Y_NEEDED, UNIT_NONE, 1e-6, 1, &r.f0, e) ||
        !ymap_num(photo, "exponent", Y_OPTIONAL, UNIT_NONE, 0, 8, &r.exponent, e) ||
        !ymap_num(photo, "range", Y_OPTIONAL, UNIT_NONE, 1e-9, 2, &r.range, e) ||
        !ymap_int(photo, "power", Y_OPTIONAL, 1, 99, &r.power, e) ||
        !ymap_int(photo, "nodes", Y_OPTIONAL, 2, 8192, &r.n, e))
        return false;
    if (ymap_find(map, "table"))
        return yaml_bad(photo, e, "stands beside 'table': give one of them");
    if (m->table.n) // the command line's, instead
        return true;
    m->photo = xcalloc(1, sizeof *m->photo);
    m->photo->request = r;
    m->r0 = isnan(r0) ? r.f0 * r.f0 : r0;
    char *path = scene_file(s, o, name);
    const bool ok = photo_read(m->photo, path, channel, scale, at, e);
    m->photo->pattern.h_per_px = h_per_px;
    free(path);
    return ok || err_in(e, "%s:%d", s->path, ynode_line(ymap_find(photo, "file")));
}

// The table that the first `rank` products of filters stand for, on the nodes of the filters.
static bool multiply(const struct factors *f, int rank, struct table *t, struct err *e)
{
    if (f->kind != FACTOR_COMPOSITION)
        return err_set(e, ERR_DATA, "holds blurs along lines: no table can show them");
    if (!table_init(t, f->n, f->range, f->power, 1, e))
        return false;
    t->is_rgb = true;
    const double(*a)[2] = f->axis, det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    for (int k = 0; k < f->n * f->n; k++) {
        const double u = table_node(t, k % f->n), v = table_node(t, k / f->n);
        const double x = table_index(t, (u * a[1][1] - v * a[1][0]) / det);
        const double y = table_index(t, (v * a[0][0] - u * a[0][1]) / det);
        for (int r = 0; r < rank && !isnan(x) && !isnan(y); r++)
            for (int c = 0; c < 3; c++) {
                double value = 1;
                for (int side = 0; side < 2; side++) {
                    const double at = side ? y : x;
                    const int i = at < f->n - 1 ? (int)at : f->n - 2;
                    const float *px = f->f[side] + ((size_t)r * (size_t)f->n + (size_t)i) * 3 + c;
                    value *= (double)px[0] + (at - i) * ((double)px[3] - (double)px[0]);
                }
                t->tab[3 * k + c] += (float)value;
            }
    }
    return true;
}

static bool read_factors(struct ynode *map, const struct scene *s, const struct scene_options *o,
                         const char *instead, double r0, struct material *m, struct err *e)
{
    const char *name = NULL;
    int rank = 1000;
    if (!ymap_text(map, "factors", Y_OPTIONAL, &name, e) ||
        !ymap_int(map, "rank", Y_OPTIONAL, 1, 1000, &rank, e))
        return false;
    if (!name && !instead)
        return true;
    if (m->table.n && !instead)
        return yaml_bad(ymap_find(map, "factors"), e, "stands beside 'table': give one of them");
    struct factors f = {0};
    struct table t;
    char *path = instead ? xstrdup(instead) : scene_file(s, o, name);
    const bool ok = factors_read(&f, path, e) &&
                    (multiply(&f, rank < f.rank ? rank : f.rank, &t, e) || err_in(e, "%s", path));
    if (ok) {
        meta_copy(&t.meta, &f.meta);
        material_take_table(m, &t, r0);
    }
    factors_finish(&f);
    free(path);
    return ok || (!instead && err_in(e, "%s:%d", s->path, ynode_line(ymap_find(map, "factors"))));
}

static bool read_row(struct ynode *map, struct multislit *row, struct err *e)
{
    return ymap_num(map, "pitch", Y_NEEDED, UNIT_M, 1e-9, 1, &row->pitch_m, e) &&
           ymap_num(map, "width", Y_NEEDED, UNIT_M, 1e-9, row->pitch_m, &row->width_m, e) &&
           ymap_int(map, "count", Y_NEEDED, 1, 10000, &row->count, e);
}

static bool read_slits(struct ynode *map, struct material *m, struct err *e)
{
    struct ynode *slits = NULL, *cross = NULL;
    if (!ymap_map(map, "slits", Y_OPTIONAL, &slits, e) || !slits)
        return !slits && !ymap_find(map, "slits");
    struct slits *s = &m->slits;
    *s = (struct slits){.across = 0.01, .n = 161};
    if (!read_row(slits, &s->row[0], e) || !ymap_map(slits, "cross", Y_OPTIONAL, &cross, e) ||
        (cross && !read_row(cross, &s->row[1], e)) ||
        !ymap_num(slits, "across", Y_OPTIONAL, UNIT_NONE, 1e-6, 10, &s->across, e) ||
        !ymap_bool(slits, "radial", Y_OPTIONAL, &s->row[0].radial, e) ||
        !ymap_int(slits, "wavelengths", Y_OPTIONAL, 2, 4001, &s->n, e))
        return false;
    if (s->row[0].radial && cross)
        return yaml_bad(slits, e, "is either 'radial' or has a 'cross' row");
    return true;
}

static bool read_rainbow(struct ynode *map, struct material *m, struct err *e)
{
    struct ynode *g04 = NULL;
    double spacing_m = 2e-6;
    if (!ymap_map(map, "g04", Y_OPTIONAL, &g04, e))
        return false;
    if (!g04)
        return true;
    struct rainbow *r = &m->rainbow;
    *r = (struct rainbow){.roughness = 5, .highlight = {1, 1, 1}};
    if (!ymap_num(g04, "spacing", Y_OPTIONAL, UNIT_M, 1e-9, 1, &spacing_m, e) ||
        !ymap_num(g04, "roughness", Y_OPTIONAL, UNIT_NONE, 0, 1e6, &r->roughness, e) ||
        !field_color(g04, "highlight", INFINITY, r->highlight, e))
        return false;
    r->spacing_m = spacing_m;
    return true;
}

static bool read_mask(struct ynode *map, const struct scene *s, const struct scene_options *o,
                      struct mask *m, struct err *e)
{
    struct ynode *stripes = NULL;
    const char *name = NULL;
    m->duty = 0.5;
    if (!ymap_map(map, "stripes", Y_OPTIONAL, &stripes, e) ||
        !ymap_text(map, "mask", Y_OPTIONAL, &name, e))
        return false;
    if (stripes && (!ymap_int(stripes, "count", Y_NEEDED, 1, 100000, &m->stripes, e) ||
                    !ymap_num(stripes, "duty", Y_OPTIONAL, UNIT_NONE, 0, 1, &m->duty, e)))
        return false;
    if (!name)
        return true;
    char *path = scene_file(s, o, name);
    const bool ok = image_read(&m->picture, path, e) && image_check_finite(&m->picture, path, e);
    free(path);
    return ok || err_in(e, "%s:%d", s->path, ynode_line(ymap_find(map, "mask")));
}

// What diffracts: as asked, else the first that is given.
static bool choose(struct ynode *map, struct material *m, struct err *e)
{
    const char *name = m->table.n || m->photo     ? "table"
                       : m->slits.n               ? "slits"
                       : m->rainbow.spacing_m > 0 ? "g04"
                                                  : "none";
    int ignored;
    struct err why;
    if (!ymap_choice(map, "diffraction", Y_OPTIONAL, "none|table|slits|g04", &ignored, e) ||
        !ymap_text(map, "diffraction", Y_OPTIONAL, &name, e))
        return false;
    return material_choose(m, name, &why) || yaml_bad(map, e, "%s", why.msg);
}

bool scene_read_material(struct ynode *map, const struct scene *s, const struct scene_options *o,
                         bool is_sample, struct material *m, struct err *e)
{
    const char *table = is_sample ? o->table : NULL, *factors = is_sample ? o->factors : NULL;
    material_init(m);
    double r0 = NAN;
    if (!field_color(map, "diffuse", 1, m->diffuse, e) ||
        !field_color(map, "specular", 1, m->specular, e) ||
        !ymap_num(map, "roughness", Y_OPTIONAL, UNIT_NONE, 1e-4, 2, &m->roughness, e) ||
        !ymap_num(map, "coat", Y_OPTIONAL, UNIT_NONE, 1, 4, &m->coat_ior, e) ||
        !ymap_num(map, "r0", Y_OPTIONAL, UNIT_NONE, 0, 1, &r0, e) ||
        !ymap_num(map, "gain", Y_OPTIONAL, UNIT_NONE, 0, INFINITY, &m->gain, e))
        return false;
    if (!isnan(r0))
        m->r0 = r0;
    return read_table(map, s, o, table, r0, m, e) && read_photo(map, s, o, r0, m, e) &&
           read_factors(map, s, o, factors, r0, m, e) && read_slits(map, m, e) &&
           read_rainbow(map, m, e) && read_mask(map, s, o, &m->mask, e) && choose(map, m, e);
}
