// mesh_gltf.c - glTF 2.0, text and binary: the triangles of the default scene, as the nodes place
// them.
//
// Taken are positions, normals, tangents and the first texture coordinates; skins, morphs and
// materials are not. jansson reads the text and stays in this file.
#define _GNU_SOURCE
#include "core/infile.h"
#include "core/mem.h"
#include "render/gltf_bytes.h"
#include "render/mesh.h"
#include <jansson.h>
#include <stdlib.h>
#include <string.h>

enum { DEEPEST = 64, NODES_MOST = 1000000 };
static const int64_t bytes_most = (int64_t)1 << 31;

struct gltf {
    const char *path;
    json_t *root;
    struct gltf_bytes inside;  // the binary part of a .glb
    struct gltf_bytes *buffer; // [n_buffers], owned but for those that are `inside`
    int n_buffers, visited;    // visited: nodes
    double scale;
    struct mesh *mesh;
    bool has_t, has_st; // every vertex so far
};

// An accessor's numbers.
struct view {
    const unsigned char *at;
    size_t stride;
    int count, width, type; // width: numbers an element; type: 5120 and up, as glTF says
    bool normalized;
};

static bool bad(const struct gltf *g, struct err *e, const char *what)
{
    return err_set(e, ERR_DATA, "%s: %s", g->path, what);
}

// A whole number of an object, `absent` when it is not there; -1 when it is no such number.
static long long whole(const json_t *o, const char *key, long long absent)
{
    const json_t *v = json_object_get(o, key);
    if (!v)
        return absent;
    return json_is_integer(v) && json_integer_value(v) >= 0 ? json_integer_value(v) : -1;
}

static json_t *item(const struct gltf *g, const char *list, long long k, struct err *e)
{
    json_t *v = k < 0 ? NULL : json_array_get(json_object_get(g->root, list), (size_t)k);
    if (!json_is_object(v)) {
        err_set(e, ERR_DATA, "%s: refers to %s[%lld], which does not exist", g->path, list, k);
        return NULL;
    }
    return v;
}

static int size_of(int type)
{
    return type == 5120 || type == 5121 ? 1 : type == 5122 || type == 5123 ? 2 : 4;
}

static double number(const struct view *v, int k, int c)
{
    const unsigned char *p =
        v->at + (size_t)k * v->stride + (size_t)c * (size_t)size_of(v->type); // little endian
    const unsigned bits = size_of(v->type) == 1   ? p[0]
                          : size_of(v->type) == 2 ? p[0] | (unsigned)p[1] << 8
                                                  : p[0] | (unsigned)p[1] << 8 |
                                                        (unsigned)p[2] << 16 | (unsigned)p[3] << 24;
    float f;
    memcpy(&f, &bits, sizeof f);
    switch (v->type) {
    case 5120: return v->normalized ? fmax(-1, (int8_t)bits / 127.0) : (int8_t)bits;
    case 5121: return v->normalized ? bits / 255.0 : bits;
    case 5122: return v->normalized ? fmax(-1, (int16_t)bits / 32767.0) : (int16_t)bits;
    case 5123: return v->normalized ? bits / 65535.0 : bits;
    case 5126: return (double)f;
    default: return bits;
    }
}

// `width` numbers an element are wanted.
static bool open_view(const struct gltf *g, long long index, int width, struct view *v,
                      struct err *e)
{
    static const char *const kinds[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
    const json_t *a = item(g, "accessors", index, e);
    if (!a)
        return false;
    const char *kind = json_string_value(json_object_get(a, "type"));
    const long long type = whole(a, "componentType", -1), count = whole(a, "count", -1);
    if (json_object_get(a, "sparse"))
        return bad(g, e, "has a sparse accessor: export the mesh without");
    if (!kind || strcmp(kind, kinds[width]) || type < 5120 || type > 5126 || type == 5124)
        return err_set(e, ERR_DATA, "%s: accessor %lld is not a %s of known numbers", g->path,
                       index, kinds[width]);
    const json_t *b = item(g, "bufferViews", whole(a, "bufferView", -1), e);
    if (!b)
        return false;
    const long long buffer = whole(b, "buffer", -1), start = whole(b, "byteOffset", 0);
    const long long length = whole(b, "byteLength", -1), offset = whole(a, "byteOffset", 0);
    const long long element = (long long)width * size_of((int)type);
    const long long stride = whole(b, "byteStride", element);
    if (buffer < 0 || buffer >= g->n_buffers || start < 0 || length < 0 || offset < 0 ||
        count < 1 || count > MESH_MOST || stride < element || stride > 65536 ||
        start > (long long)g->buffer[buffer].size ||
        length > (long long)g->buffer[buffer].size - start ||
        offset > length - (count - 1) * stride - element)
        return err_set(e, ERR_DATA, "%s: accessor %lld reaches beyond its data", g->path, index);
    *v = (struct view){.at = g->buffer[buffer].at + start + offset,
                       .stride = (size_t)stride,
                       .count = (int)count,
                       .width = width,
                       .type = (int)type,
                       .normalized = json_is_true(json_object_get(a, "normalized"))};
    return true;
}

static struct vec3 vector(const struct view *v, int k)
{
    return v3(number(v, k, 0), number(v, k, 1), number(v, k, 2));
}

// A node's place: columns are images of x, y, z and the origin.
struct place {
    struct vec3 x, y, z, at;
};

static struct vec3 turned(const struct place *p, struct vec3 v)
{
    return v3_add(v3_scale(v.x, p->x), v3_add(v3_scale(v.y, p->y), v3_scale(v.z, p->z)));
}

static struct vec3 normal_of(const struct place *p,
                             struct vec3 n) // cofactors: scale does not bend it
{
    const struct place c = {v3_cross(p->y, p->z), v3_cross(p->z, p->x), v3_cross(p->x, p->y), {0}};
    const double side = v3_dot(p->x, c.x) < 0 ? -1 : 1;
    return v3_scale(side, turned(&c, n));
}

static bool add_vertices(struct gltf *g, const json_t *attributes, const struct place *p,
                         struct err *e)
{
    static const struct {
        const char *name;
        int width;
    } want[] = {{"POSITION", 3}, {"NORMAL", 3}, {"TANGENT", 4}, {"TEXCOORD_0", 2}};
    struct view v[4] = {0};
    for (int k = 0; k < 4; k++) {
        const long long index = whole(attributes, want[k].name, -2);
        if (index == -2 && k > 0)
            continue;
        if (!open_view(g, index, want[k].width, &v[k], e))
            return err_in(e, "%s", want[k].name);
        if (v[k].count != v[0].count)
            return err_set(e, ERR_DATA, "%s: %s has %d elements for %d vertices", g->path,
                           want[k].name, v[k].count, v[0].count);
    }
    struct mesh *m = g->mesh;
    if (m->n_vertices > MESH_MOST - v[0].count)
        return bad(g, e, "more than 20 million vertices");
    m->vertex = xrealloc(m->vertex, (size_t)(m->n_vertices + v[0].count), sizeof *m->vertex);
    for (int k = 0; k < v[0].count; k++) {
        struct mesh_vertex *to = &m->vertex[m->n_vertices++];
        *to = (struct mesh_vertex){0};
        to->at_m = v3_scale(g->scale, v3_add(p->at, turned(p, vector(&v[0], k))));
        if (v[1].count)
            to->n = normal_of(p, vector(&v[1], k));
        if (v[2].count)
            to->t = turned(p, vector(&v[2], k));
        if (v[3].count) { // glTF's second coordinate runs down
            to->s = number(&v[3], k, 0);
            to->v = 1 - number(&v[3], k, 1);
        }
    }
    g->has_t = g->has_t && v[2].count;
    g->has_st = g->has_st && v[3].count;
    return true;
}

static bool add_primitive(struct gltf *g, const json_t *primitive, const struct place *p,
                          struct err *e)
{
    struct mesh *m = g->mesh;
    const int first = m->n_vertices;
    const long long mode = whole(primitive, "mode", 4), indices = whole(primitive, "indices", -2);
    struct view v = {0};
    if (mode >= 0 && mode < 4)
        return true; // points and lines
    if (mode < 0 || mode > 6)
        return bad(g, e, "a primitive of unknown mode");
    if (!add_vertices(g, json_object_get(primitive, "attributes"), p, e) ||
        (indices != -2 && !open_view(g, indices, 1, &v, e)))
        return false;
    const int corners = indices == -2 ? m->n_vertices - first : v.count;
    const int n = mode == 4 ? corners / 3 : corners > 2 ? corners - 2 : 0;
    if (m->n_triangles > MESH_MOST - n)
        return bad(g, e, "more than 20 million triangles");
    m->triangle = xrealloc(m->triangle, (size_t)(m->n_triangles + n) + 1, sizeof *m->triangle);
    const bool mirrored = v3_dot(p->x, v3_cross(p->y, p->z)) < 0;
    for (int k = 0; k < n; k++) {
        int at[3] = {mode == 4 ? 3 * k : mode == 6 ? 0 : k, 0, 0};
        at[1] = mode == 4 ? 3 * k + 1 : k + 1;
        at[2] = mode == 4 ? 3 * k + 2 : k + 2;
        const bool swap = mirrored != (mode == 5 && k % 2);
        int *to = m->triangle[m->n_triangles++];
        for (int c = 0; c < 3; c++) {
            const double which = v.count ? number(&v, at[c], 0) : at[c];
            if (!(which >= 0 && which < m->n_vertices - first))
                return bad(g, e, "an index without its vertex");
            to[swap && c ? 3 - c : c] = first + (int)which;
        }
    }
    return true;
}

static bool numbers(const json_t *list, int n, double *out)
{
    if (!list)
        return true;
    for (int k = 0; k < n; k++) {
        const json_t *v = json_array_get(list, (size_t)k);
        if (!json_is_number(v))
            return false;
        out[k] = json_number_value(v);
    }
    return true;
}

static bool place_of(const struct gltf *g, const json_t *node, struct place *p, struct err *e)
{
    double m[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    double q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1}, t[3] = {0};
    if (!numbers(json_object_get(node, "matrix"), 16, m) ||
        !numbers(json_object_get(node, "rotation"), 4, q) ||
        !numbers(json_object_get(node, "scale"), 3, s) ||
        !numbers(json_object_get(node, "translation"), 3, t))
        return bad(g, e, "a node whose matrix, rotation, scale or translation is not numbers");
    if (json_object_get(node, "matrix")) {
        *p = (struct place){
            {m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}, {m[12], m[13], m[14]}};
        return true;
    }
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    p->x = v3_scale(s[0], v3(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)));
    p->y = v3_scale(s[1], v3(2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)));
    p->z = v3_scale(s[2], v3(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)));
    p->at = v3(t[0], t[1], t[2]);
    return true;
}

static long long node_number(const json_t *v)
{
    return json_is_integer(v) ? json_integer_value(v) : -1;
}

static bool add_node(struct gltf *g, long long index, const struct place *parent, int depth,
                     struct err *e)
{
    const json_t *node = item(g, "nodes", index, e), *child, *primitive;
    size_t k;
    struct place own, p;
    if (!node || !place_of(g, node, &own, e))
        return false;
    if (depth > DEEPEST || ++g->visited > NODES_MOST)
        return bad(g, e, "nodes that hold themselves, or are too many");
    p = (struct place){turned(parent, own.x), turned(parent, own.y), turned(parent, own.z),
                       v3_add(parent->at, turned(parent, own.at))};
    if (json_object_get(node, "mesh")) {
        const json_t *mesh = item(g, "meshes", whole(node, "mesh", -1), e);
        if (!mesh)
            return false;
        json_array_foreach (json_object_get(mesh, "primitives"), k, primitive)
            if (!add_primitive(g, primitive, &p, e))
                return false;
    }
    json_array_foreach (json_object_get(node, "children"), k, child)
        if (!add_node(g, node_number(child), &p, depth + 1, e))
            return false;
    return true;
}

static bool open_buffers(struct gltf *g, struct err *e)
{
    const json_t *list = json_object_get(g->root, "buffers"), *b;
    size_t k;
    g->buffer = xcalloc(json_array_size(list) + 1, sizeof *g->buffer);
    json_array_foreach (list, k, b) {
        const char *uri = json_string_value(json_object_get(b, "uri"));
        struct gltf_bytes *to = &g->buffer[g->n_buffers++];
        if (!uri && (k || !g->inside.at))
            return bad(g, e, "a buffer without its data");
        if (!uri)
            *to = g->inside;
        else if (!gltf_uri(g->path, uri, to, e))
            return err_in(e, "%s", g->path);
    }
    return true;
}

// Extensions that say nothing about where triangles are may be required.
static bool check_extensions(const struct gltf *g, struct err *e)
{
    const json_t *name;
    size_t k;
    json_array_foreach (json_object_get(g->root, "extensionsRequired"), k, name) {
        const char *s = json_string_value(name) ? json_string_value(name) : "";
        if (strncmp(s, "KHR_materials_", 14) && strncmp(s, "KHR_lights_", 11) &&
            strncmp(s, "KHR_texture_", 12))
            return err_set(e, ERR_DATA, "%s: requires %.60s, which is not read", g->path, s);
    }
    return true;
}

static bool add_scene(struct gltf *g, struct err *e)
{
    static const struct place origin = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0}};
    const json_t *scene = item(g, "scenes", whole(g->root, "scene", 0), e), *node;
    size_t k;
    if (!scene)
        return false;
    json_array_foreach (json_object_get(scene, "nodes"), k, node)
        if (!add_node(g, node_number(node), &origin, 0, e))
            return false;
    return true;
}

static bool read_text(struct gltf *g, struct gltf_bytes text, struct err *e)
{
    json_error_t why;
    g->root = json_loadb((const char *)text.at, text.size, JSON_REJECT_DUPLICATES, &why);
    return g->root || err_set(e, ERR_DATA, "%s:%d: %.100s", g->path, why.line, why.text);
}

bool mesh_read_gltf(struct mesh *out, const char *path, double scale, const struct vec3 *tangent,
                    struct err *e)
{
    struct mesh m = {0};
    struct gltf g = {.path = path, .scale = scale, .mesh = &m, .has_t = true, .has_st = true};
    struct gltf_bytes file, text;
    file.at = (unsigned char *)infile_slurp(path, bytes_most, &file.size, e);
    if (!file.at)
        return err_in(e, "%s", path);
    bool ok = gltf_split(file, &text, &g.inside, e) || err_in(e, "%s", path);
    ok = ok && read_text(&g, text, e) && check_extensions(&g, e) && open_buffers(&g, e) &&
         add_scene(&g, e);
    for (int k = 0; k < m.n_vertices && !g.has_t; k++)
        m.vertex[k].t = (struct vec3){0}; // some without: all are computed alike
    ok = ok && mesh_complete(&m, path, g.has_st, tangent, e);
    for (int k = 0; k < g.n_buffers; k++)
        if (g.buffer[k].at != g.inside.at)
            free(g.buffer[k].at);
    free(g.buffer);
    json_decref(g.root);
    free(file.at);
    if (!ok) {
        mesh_finish(&m);
        return false;
    }
    *out = m;
    return true;
}
