// mesh.h - triangles with normals and tangents, for any shape that is not built in.
//
// Corners wind counter-clockwise seen from the front. Tangents follow the texture coordinate s, as
// glTF says; a mesh without texture coordinates has none, and then needs a direction to take.
#pragma once
#include "core/err.h"
#include "core/geom.h"

struct mesh_vertex {
    struct vec3 at_m, n, t; // n and t unit, t normal to n
    double s, v;            // texture coordinates, s to the right, v upwards
};

struct mesh_node { // of the tree of boxes over the triangles
    struct vec3 lo, hi;
    int first, count; // triangles of a leaf, in the order of `triangle`; count 0: children below
    int left, right;
};

struct mesh {
    struct mesh_vertex *vertex; // [n_vertices], owned
    int (*triangle)[3];         // [n_triangles], owned
    int n_vertices, n_triangles;
    struct mesh_node *node; // owned
    int n_nodes;
};

enum { MESH_MOST = 20000000 };

// .obj (v, vt, vn, f with polygons), .gltf and .glb (triangles of the default scene, placed by
// their nodes), times `scale`. Missing normals are smooth ones; tangents are the file's, else
// follow its texture coordinates, else `tangent`, projected on the surface; a mesh with none of
// them is ERR_DATA, as are NaN, indices that do not exist and degenerate files, with the line or
// element. `tangent` overrides the file's.
bool mesh_read(struct mesh *m, const char *path, double scale, const struct vec3 *tangent,
               struct err *e);
bool mesh_read_obj(struct mesh *m, const char *path, double scale, const struct vec3 *tangent,
                   struct err *e);
bool mesh_read_gltf(struct mesh *m, const char *path, double scale, const struct vec3 *tangent,
                    struct err *e);
void mesh_finish(struct mesh *m); // accepts a zeroed struct

// For readers: fills in what is missing (normals zero, tangents from s where `has_st`), checks,
// builds the tree. `name` is for messages.
bool mesh_complete(struct mesh *m, const char *name, bool has_st, const struct vec3 *tangent,
                   struct err *e);

struct mesh_hit {
    double distance;
    struct mesh_vertex at; // interpolated
};
// The nearest front in front of the ray's start.
bool mesh_hit(const struct mesh *m, struct vec3 from, struct vec3 dir, struct mesh_hit *hit);
