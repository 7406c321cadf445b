// geometry.c - from a lens, a plane and a light to half vectors.
#define _GNU_SOURCE
#include "calib/geometry.h"

enum { CHANNELS = 7 };

struct bench {
    const struct lens *lens;
    const struct geometry_options *opt;
    struct vec3 origin_m;
    struct frame f;
    struct vec3 axis; // from the light to the origin, unit
    double at_origin; // cos_i / r^2 there
};

// The frame of the sample at a place of its plane; false: outside the sample.
static bool frame_at(const struct bench *b, struct vec3 at, struct frame *f)
{
    const struct geometry_options *o = b->opt;
    *f = b->f;
    if (!o->radial)
        return !(fabs(at.x) > 0.5 * o->size_m[0] || fabs(at.y) > 0.5 * o->size_m[1]);
    const double r = hypot(at.x, at.y);
    return r > fmax(1e-9, o->hub_m) && !(r > 0.5 * o->size_m[0]) &&
           frame_from(frame_world(&b->f, v3(at.x, at.y, 0)), b->f.n, f);
}

static bool pixel(const struct bench *b, int i, int j, float out[CHANNELS])
{
    const struct geometry_options *o = b->opt;
    const struct vec3 ray = lens_ray(b->lens, i, j);
    const double far = v3_dot(b->origin_m, b->f.n) / v3_dot(ray, b->f.n);
    if (!(v3_dot(ray, b->f.n) < 0) || !(far > 0))
        return false;
    const struct vec3 x = v3_scale(far, ray);
    const struct vec3 at = frame_local(&b->f, v3_sub(x, b->origin_m));
    struct frame local;
    if (!frame_at(b, at, &local))
        return false;
    const struct vec3 to_light = v3_sub(o->light_m, x);
    const struct vec3 wi = v3_unit(to_light), wo = v3_scale(-1, ray);
    const struct vec3 h = frame_local(&local, v3_add(wi, wo));
    const double cos_i = v3_dot(wi, b->f.n), cos_o = v3_dot(wo, b->f.n), wi_wo = v3_dot(wi, wo);
    const double beam = -v3_dot(wi, b->axis);
    if (!(cos_i > 0 && beam > 0))
        return false;
    const double irradiance =
        cos_i / v3_dot(to_light, to_light) * pow(beam, o->beam) / b->at_origin;
    const double cos_d = sqrt(fmax(0, 0.5 + 0.5 * wi_wo));
    const double fresnel = o->schlick ? o->r0 + (1 - o->r0) * pow(1 - cos_d, 5) : o->r0;
    const double g = (1 + wi_wo) * (1 + wi_wo) / (cos_i * cos_o);
    const struct vec3 across = v3_sub(lens_ray(b->lens, i + 0.5, j), lens_ray(b->lens, i - 0.5, j));
    const struct vec3 down = v3_sub(lens_ray(b->lens, i, j + 0.5), lens_ray(b->lens, i, j - 0.5));
    const double all[CHANNELS] = {h.x,
                                  h.y,
                                  h.z,
                                  o->r0 / (g * fresnel * irradiance),
                                  cos_i,
                                  cos_o,
                                  v3_norm(v3_cross(across, down))};
    for (int c = 0; c < CHANNELS; c++)
        out[c] = (float)all[c];
    return true;
}

bool geometry_of(const struct lens *l, const struct geometry_options *o, struct image *out,
                 struct err *e)
{
    const struct plane p = lens_plane(l, l->plane);
    const double c = cos(o->turn_rad), s = sin(o->turn_rad);
    struct bench b = {.lens = l, .opt = o, .origin_m = p.origin_m, .f = p.f};
    b.f.t = v3_add(v3_scale(c, p.f.t), v3_scale(s, p.f.b));
    b.f.b = v3_cross(b.f.n, b.f.t);
    const struct vec3 to_light = v3_sub(o->light_m, p.origin_m);
    b.axis = v3_unit(v3_scale(-1, to_light));
    b.at_origin = v3_dot(to_light, b.f.n) / (v3_norm(to_light) * v3_dot(to_light, to_light));
    if (!(b.at_origin > 0))
        return err_set(e, ERR_DATA, "the light is not on the camera's side of the sample");
    struct image im;
    if (!image_init(&im, l->head.w, l->head.h, CHANNELS, e))
        return false;
    meta_set_text(&im.meta, "channels", "u,v,w,weight,cos_i,cos_o,omega");
    long seen = 0;
#pragma omp parallel for schedule(static) reduction(+ : seen)
    for (int j = 0; j < im.h; j++)
        for (int i = 0; i < im.w; i++) {
            float *px = im.px + CHANNELS * ((size_t)j * (size_t)im.w + (size_t)i);
            if (pixel(&b, i, j, px))
                seen++;
            else
                for (int k = 0; k < CHANNELS; k++)
                    px[k] = NAN;
        }
    if (!seen) {
        image_finish(&im);
        return err_set(e, ERR_DATA, "no pixel sees the sample under this light");
    }
    *out = im;
    return true;
}
