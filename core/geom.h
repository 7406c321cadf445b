// geom.h - vectors, frames and half vectors, in double.
//
// A surface frame (t, b, n) is right-handed: b = n x t. wi points to the light, wo to the viewer,
// both unit and leaving the surface; h = wi + wo is NOT normalised (docs/optics.md).
#pragma once
#include <math.h>
#include <stdbool.h>

struct vec3 {
    double x, y, z;
};
struct frame {
    struct vec3 t, b, n;
};

static inline struct vec3 v3(double x, double y, double z)
{
    return (struct vec3){x, y, z};
}
static inline struct vec3 v3_add(struct vec3 a, struct vec3 b)
{
    return v3(a.x + b.x, a.y + b.y, a.z + b.z);
}
static inline struct vec3 v3_sub(struct vec3 a, struct vec3 b)
{
    return v3(a.x - b.x, a.y - b.y, a.z - b.z);
}
static inline struct vec3 v3_scale(double s, struct vec3 a)
{
    return v3(s * a.x, s * a.y, s * a.z);
}
static inline double v3_dot(struct vec3 a, struct vec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
// The same for components whose squares leave the range of double.
double v3_norm_far(struct vec3 a);
struct vec3 v3_unit_far(struct vec3 a);
static inline bool v3_is_near(double square)
{
    return square > 1e-280 && square < 1e300;
}
static inline double v3_norm(struct vec3 a)
{
    const double square = v3_dot(a, a);
    return v3_is_near(square) ? sqrt(square) : v3_norm_far(a);
}
static inline struct vec3 v3_unit(struct vec3 a) // NAN for a zero vector
{
    const double square = v3_dot(a, a);
    return v3_is_near(square) ? v3_scale(1 / sqrt(square), a) : v3_unit_far(a);
}
static inline struct vec3 v3_cross(struct vec3 a, struct vec3 b)
{
    return v3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

// The right-handed frame with this normal and the tangent nearest to the one given;
// false when either is zero, not finite, or the two are parallel (sine under 1e-6).
bool frame_from(struct vec3 tangent, struct vec3 normal, struct frame *f);

// World coordinates to (t, b, n) coordinates, and back.
static inline struct vec3 frame_local(const struct frame *f, struct vec3 a)
{
    return v3(v3_dot(f->t, a), v3_dot(f->b, a), v3_dot(f->n, a));
}
static inline struct vec3 frame_world(const struct frame *f, struct vec3 a)
{
    return v3_add(v3_add(v3_scale(a.x, f->t), v3_scale(a.y, f->b)), v3_scale(a.z, f->n));
}

// Lat-long map, W x H (docs/optics.md): direction of a pixel and pixel of a unit direction.
struct vec3 latlong_dir(double col, double row, int w, int h);
void latlong_pixel(struct vec3 dir, int w, int h, double *col, double *row);
