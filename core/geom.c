// geom.c - frames and the lat-long map.
#define _GNU_SOURCE
#include "core/geom.h"

double v3_norm_far(struct vec3 a)
{
    return hypot(hypot(a.x, a.y), a.z);
}

struct vec3 v3_unit_far(struct vec3 a)
{
    const double most = fmax(fabs(a.x), fmax(fabs(a.y), fabs(a.z)));
    const struct vec3 b = v3(a.x / most, a.y / most, a.z / most);
    return v3_scale(1 / sqrt(v3_dot(b, b)), b);
}

bool frame_from(struct vec3 tangent, struct vec3 normal, struct frame *f)
{
    const double ln = v3_norm(normal), lt = v3_norm(tangent);
    if (!(ln > 0 && isfinite(ln) && lt > 0 && isfinite(lt)))
        return false;
    const struct vec3 n = v3_unit(normal), t = v3_unit(tangent);
    const struct vec3 across = v3_sub(t, v3_scale(v3_dot(t, n), n));
    if (v3_norm(across) < 1e-6)
        return false;
    f->n = n;
    f->t = v3_unit(across);
    f->b = v3_cross(n, f->t);
    return true;
}

struct vec3 latlong_dir(double col, double row, int w, int h)
{
    const double th = M_PI * (row + .5) / h, ph = 2 * M_PI * (col + .5) / w - M_PI;
    return v3(sin(th) * sin(ph), cos(th), -sin(th) * cos(ph));
}

void latlong_pixel(struct vec3 dir, int w, int h, double *col, double *row)
{
    const double th = atan2(sqrt(dir.x * dir.x + dir.z * dir.z), dir.y), ph = atan2(dir.x, -dir.z);
    *row = th / M_PI * h - .5;
    *col = (ph + M_PI) / (2 * M_PI) * w - .5;
}
