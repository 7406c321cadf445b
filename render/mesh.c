// mesh.c - meshes made complete: normals, tangents, the tree of boxes, and rays against it.
#define _GNU_SOURCE
#include "render/mesh.h"
#include "core/imgfile.h"
#include "core/mem.h"
#include <stdlib.h>
#include <string.h>

enum { LEAF = 4, DEEPEST = 64 };

bool mesh_read(struct mesh *m, const char *path, double scale, const struct vec3 *tangent,
               struct err *e)
{
    const char *ext = path_ext(path);
    if (!strcmp(ext, ".gltf") || !strcmp(ext, ".glb"))
        return mesh_read_gltf(m, path, scale, tangent, e);
    if (!strcmp(ext, ".obj"))
        return mesh_read_obj(m, path, scale, tangent, e);
    return err_set(e, ERR_DATA, "%s: a mesh is a .obj, .gltf or .glb file", path);
}

void mesh_finish(struct mesh *m)
{
    if (!m)
        return;
    free(m->vertex);
    free(m->triangle);
    free(m->node);
    *m = (struct mesh){0};
}

static double axis_of(struct vec3 v, int axis)
{
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

static bool is_finite(struct vec3 v)
{
    return isfinite(v.x) && isfinite(v.y) && isfinite(v.z);
}

static void corners(const struct mesh *m, int triangle, struct mesh_vertex *v[3])
{
    for (int k = 0; k < 3; k++)
        v[k] = &m->vertex[m->triangle[triangle][k]];
}

// Each triangle adds its face, weighted by area, to the corners that have no normal of their own.
static void add_normals(struct mesh *m)
{
    bool *missing = xcalloc((size_t)m->n_vertices, sizeof *missing);
    for (int k = 0; k < m->n_vertices; k++)
        missing[k] = !(v3_norm(m->vertex[k].n) > 0);
    for (int k = 0; k < m->n_triangles; k++) {
        struct mesh_vertex *v[3];
        corners(m, k, v);
        const struct vec3 face =
            v3_cross(v3_sub(v[1]->at_m, v[0]->at_m), v3_sub(v[2]->at_m, v[0]->at_m));
        for (int c = 0; c < 3; c++)
            if (missing[m->triangle[k][c]])
                v[c]->n = v3_add(v[c]->n, face);
    }
    free(missing);
}

// d position / d s of each triangle, added to its corners; false when no triangle has one.
static bool add_tangents(struct mesh *m)
{
    bool any = false;
    for (int k = 0; k < m->n_triangles; k++) {
        struct mesh_vertex *v[3];
        corners(m, k, v);
        const struct vec3 a = v3_sub(v[1]->at_m, v[0]->at_m), b = v3_sub(v[2]->at_m, v[0]->at_m);
        const double sa = v[1]->s - v[0]->s, sb = v[2]->s - v[0]->s;
        const double va = v[1]->v - v[0]->v, vb = v[2]->v - v[0]->v;
        const double det = sa * vb - sb * va;
        if (!(fabs(det) > 0))
            continue;
        const struct vec3 t =
            v3_add(v3_scale(vb / det, a), v3_scale(-va / det, b)); // metres per unit of s
        const double area = v3_norm(v3_cross(a, b));
        if (!is_finite(t) || !(v3_norm(t) > 0))
            continue;
        for (int c = 0; c < 3; c++)
            v[c]->t = v3_add(v[c]->t, v3_scale(area / v3_norm(t), t));
        any = true;
    }
    return any;
}

static void bound(const struct mesh *m, struct mesh_node *node)
{
    node->lo = v3(INFINITY, INFINITY, INFINITY);
    node->hi = v3(-INFINITY, -INFINITY, -INFINITY);
    for (int k = 0; k < 3 * node->count; k++) {
        const struct vec3 p = m->vertex[m->triangle[node->first + k / 3][k % 3]].at_m;
        node->lo = v3(fmin(node->lo.x, p.x), fmin(node->lo.y, p.y), fmin(node->lo.z, p.z));
        node->hi = v3(fmax(node->hi.x, p.x), fmax(node->hi.y, p.y), fmax(node->hi.z, p.z));
    }
}

static double middle(const struct mesh *m, int triangle, int axis)
{
    double sum = 0;
    for (int c = 0; c < 3; c++)
        sum += axis_of(m->vertex[m->triangle[triangle][c]].at_m, axis);
    return sum / 3;
}

// Splits a leaf at the middle of its longest side, halves by count where that does not part it.
static void split(struct mesh *m, int at, int depth)
{
    struct mesh_node *node = &m->node[at];
    if (node->count <= LEAF || depth >= DEEPEST - 1)
        return;
    const struct vec3 side = v3_sub(node->hi, node->lo);
    const int axis = side.x >= side.y && side.x >= side.z ? 0 : side.y >= side.z ? 1 : 2;
    const double cut = (axis_of(node->lo, axis) + axis_of(node->hi, axis)) / 2;
    int i = node->first, j = node->first + node->count;
    while (i < j)
        if (middle(m, i, axis) < cut) {
            i++;
        } else {
            j--;
            for (int c = 0; c < 3; c++) {
                const int keep = m->triangle[i][c];
                m->triangle[i][c] = m->triangle[j][c];
                m->triangle[j][c] = keep;
            }
        }
    const int first = node->first, count = node->count;
    if (i == first || i == first + count)
        i = first + count / 2;
    const int left = m->n_nodes++, right = m->n_nodes++;
    node->left = left;
    node->right = right;
    node->count = 0;
    m->node[left] = (struct mesh_node){.first = first, .count = i - first};
    m->node[right] = (struct mesh_node){.first = i, .count = first + count - i};
    bound(m, &m->node[left]);
    bound(m, &m->node[right]);
    split(m, left, depth + 1);
    split(m, right, depth + 1);
}

bool mesh_complete(struct mesh *m, const char *name, bool has_st, const struct vec3 *tangent,
                   struct err *e)
{
    if (m->n_triangles < 1)
        return err_set(e, ERR_DATA, "%s: holds no triangles", name);
    for (int k = 0; k < m->n_vertices; k++) {
        const struct mesh_vertex *v = &m->vertex[k];
        if (!is_finite(v->at_m) || !is_finite(v->n) || !is_finite(v->t) || !isfinite(v->s) ||
            !isfinite(v->v))
            return err_set(e, ERR_DATA, "%s: vertex %d holds NaN or infinity", name, k + 1);
    }
    bool has_t = true;
    for (int k = 0; k < m->n_vertices; k++)
        has_t = has_t && v3_norm(m->vertex[k].t) > 0;
    if (!has_t && !has_st && !tangent)
        return err_set(e, ERR_DATA,
                       "%s: has no texture coordinates to take tangents from: give the mesh some, "
                       "or 'tangents: fixed' in the scene",
                       name);
    add_normals(m);
    if (!has_t && !tangent && !add_tangents(m))
        return err_set(e, ERR_DATA,
                       "%s: all texture coordinates are the same: no tangents follow from them",
                       name);
    for (int k = 0; k < m->n_vertices; k++) {
        struct mesh_vertex *v = &m->vertex[k];
        struct frame f;
        const struct vec3 t = tangent ? *tangent : v->t;
        if (!frame_from(t, v->n, &f) && !frame_from(v3(1, 0, 0), v->n, &f) &&
            !frame_from(v3(0, 1, 0), v->n, &f))
            f = (struct frame){.t = {1, 0, 0}, .n = {0, 0, 1}}; // of no triangle with an area
        v->n = f.n;
        v->t = f.t;
    }
    m->node = xcalloc(2 * (size_t)m->n_triangles, sizeof *m->node);
    m->node[0] = (struct mesh_node){.count = m->n_triangles};
    m->n_nodes = 1;
    bound(m, &m->node[0]);
    split(m, 0, 0);
    return true;
}

static bool hits_box(const struct mesh_node *n, struct vec3 o, struct vec3 inv, double nearest)
{
    double from = 0, to = nearest;
    for (int axis = 0; axis < 3; axis++) {
        const double i = axis_of(inv, axis), a = (axis_of(n->lo, axis) - axis_of(o, axis)) * i,
                     b = (axis_of(n->hi, axis) - axis_of(o, axis)) * i;
        from = fmax(from, fmin(a, b));
        to = fmin(to, fmax(a, b));
    }
    return from <= to * (1 + 1e-12);
}

// Moeller and Trumbore 1997; fronts only.
static bool hits_triangle(const struct mesh *m, int k, struct vec3 o, struct vec3 d,
                          struct mesh_hit *hit)
{
    struct mesh_vertex *v[3];
    corners(m, k, v);
    const struct vec3 a = v3_sub(v[1]->at_m, v[0]->at_m), b = v3_sub(v[2]->at_m, v[0]->at_m);
    const struct vec3 p = v3_cross(d, b), from = v3_sub(o, v[0]->at_m), q = v3_cross(from, a);
    const double det = v3_dot(a, p);
    if (!(det > 0))
        return false;
    const double x = v3_dot(from, p) / det, y = v3_dot(d, q) / det, t = v3_dot(b, q) / det;
    if (!(x >= 0 && y >= 0 && x + y <= 1 && t > 0 && t < hit->distance))
        return false;
    const double w[3] = {1 - x - y, x, y};
    hit->distance = t;
    hit->at = (struct mesh_vertex){.at_m = v3_add(o, v3_scale(t, d))};
    for (int c = 0; c < 3; c++) {
        hit->at.n = v3_add(hit->at.n, v3_scale(w[c], v[c]->n));
        hit->at.t = v3_add(hit->at.t, v3_scale(w[c], v[c]->t));
        hit->at.s += w[c] * v[c]->s;
        hit->at.v += w[c] * v[c]->v;
    }
    return true;
}

bool mesh_hit(const struct mesh *m, struct vec3 from, struct vec3 dir, struct mesh_hit *hit)
{
    hit->distance = INFINITY;
    const struct vec3 inv = v3(1 / dir.x, 1 / dir.y, 1 / dir.z);
    int stack[DEEPEST + 2], n = 0;
    stack[n++] = 0;
    while (n) {
        const struct mesh_node *node = &m->node[stack[--n]];
        if (!hits_box(node, from, inv, hit->distance))
            continue;
        for (int k = 0; k < node->count; k++)
            hits_triangle(m, node->first + k, from, dir, hit);
        if (!node->count) {
            stack[n++] = node->left;
            stack[n++] = node->right;
        }
    }
    return isfinite(hit->distance);
}
