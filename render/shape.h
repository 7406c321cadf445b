// shape.h - the surfaces of a scene: where a ray meets them, and the frame there.
//
// A shape lives in its own coordinates x, y, z along frame.t, frame.b, frame.n from `at`. Curved
// shapes are exact, not facets; the table is read in the local frame of the point (T17, fig. 17).
// Only fronts are seen: a ray passes through a surface from behind.
#pragma once
#include "render/mesh.h"

enum shape_kind {
    SHAPE_PLANE,    // |x| <= width/2, |y| <= height/2, z = 0
    SHAPE_DISC,     // inner <= r <= radius, z = 0; t runs outwards, across the tracks
    SHAPE_CYLINDER, // axis y, |y| <= height/2, |angle from z| <= span/2; t runs around
    SHAPE_SPHERE,   // t runs around y
    SHAPE_MESH,
};

struct shape {
    enum shape_kind kind;
    struct vec3 at_m;
    struct frame frame; // its local x, y, z in world directions
    double width_m, height_m, radius_m, inner_m, span_rad;
    bool fixed_tangent; // disc: t is local x everywhere
    struct mesh mesh;   // owned
};

void shape_finish(struct shape *s); // accepts a zeroed struct

struct hit {
    double distance; // along the ray, in units of its direction
    struct vec3 at_m;
    struct frame frame; // of the surface there
    double s, v;        // 0..1 across the shape, v upwards: for masks
};

// The nearest hit in front of the ray's start; false: none.
bool shape_hit(const struct shape *s, struct vec3 from, struct vec3 dir, struct hit *hit);

// Corners of the box in local coordinates that holds the shape.
void shape_bounds(const struct shape *s, struct vec3 *lo, struct vec3 *hi);
