// view_read.c - the key `view` of a scene.
#define _GNU_SOURCE
#include "sim/view.h"
#include <math.h>

static bool read_vector(struct ynode *map, const char *key, enum unit unit, double lo, double hi,
                        double *out, int count, struct err *e)
{
    struct ynode *list = NULL;
    if (!ymap_list(map, key, Y_OPTIONAL, &list, e))
        return false;
    if (list && ylist_count(list) != count)
        return yaml_bad(list, e, "%d values, needs %d", ylist_count(list), count);
    for (int k = 0; list && k < count; k++)
        if (!ynode_num(ylist_at(list, k), unit, lo, hi, &out[k], e))
            return false;
    return true;
}

static bool read_place(struct ynode *map, const char *key, struct vec3 *out, struct err *e)
{
    double at[3] = {out->x, out->y, out->z};
    if (!read_vector(map, key, UNIT_M, -1e3, 1e3, at, 3, e))
        return false;
    *out = v3(at[0], at[1], at[2]);
    return true;
}

static bool read_direction(struct ynode *map, const char *key, struct vec3 *out, struct err *e)
{
    double at[3] = {out->x, out->y, out->z};
    if (!read_vector(map, key, UNIT_NONE, -1e6, 1e6, at, 3, e))
        return false;
    *out = v3(at[0], at[1], at[2]);
    return true;
}

static bool read_poses(struct sim_view *v, struct ynode *y, struct err *e)
{
    struct vec3 target = {0}, up = v3(0, 1, 0), normal = v3(0, 0, 1), tangent = v3(1, 0, 0);
    v->camera_m = v3(0, 0, 0.5);
    v->light_m = v3(0.03, 0, 0.5);
    if (!read_place(y, "sample", &v->sample_m, e) || !read_direction(y, "normal", &normal, e) ||
        !read_direction(y, "tangent", &tangent, e) || !read_place(y, "camera", &v->camera_m, e) ||
        !read_place(y, "light", &v->light_m, e))
        return false;
    target = v->sample_m;
    if (!read_place(y, "target", &target, e) || !read_direction(y, "up", &up, e))
        return false;
    const struct vec3 forward = v3_sub(target, v->camera_m);
    if (!frame_from(tangent, normal, &v->sample))
        return yaml_bad(y, e, "the sample's normal and tangent are zero or parallel");
    if (!frame_from(v3_scale(-1, v3_cross(up, forward)), forward, &v->camera))
        return yaml_bad(y, e, "the camera looks along 'up', or is at its target");
    const struct vec3 to_camera = v3_sub(v->camera_m, v->sample_m);
    const struct vec3 to_light = v3_sub(v->light_m, v->sample_m);
    if (!(v3_dot(to_camera, v->sample.n) > 0) || !(v3_dot(to_light, v->sample.n) > 0))
        return yaml_bad(y, e, "camera and light must be on the side of the sample's normal");
    return true;
}

static bool read_camera(struct sim_view *v, struct ynode *y, struct err *e)
{
    double focal_m = 13.6e-3, pixel_m = 5e-6;
    v->natural = true;
    v->light_beam = 1;
    v->light_diameter_m = 1e-3;
    v->size_m[0] = v->size_m[1] = 1;
    v->glare_px = 40;
    if (!ymap_num(y, "focal", Y_OPTIONAL, UNIT_M, 1e-4, 10, &focal_m, e) ||
        !ymap_num(y, "pixel", Y_OPTIONAL, UNIT_M, 1e-7, 1e-3, &pixel_m, e) ||
        !read_vector(y, "distortion", UNIT_NONE, -2, 2, v->distortion, 5, e) ||
        !ymap_bool(y, "natural-vignetting", Y_OPTIONAL, &v->natural, e) ||
        !read_vector(y, "vignetting", UNIT_NONE, -1, 1, v->vignetting, 2, e) ||
        !ymap_num(y, "light-diameter", Y_OPTIONAL, UNIT_M, 0, 1, &v->light_diameter_m, e) ||
        !ymap_num(y, "light-beam", Y_OPTIONAL, UNIT_NONE, 0, 100, &v->light_beam, e) ||
        !read_vector(y, "size", UNIT_M, 1e-6, 10, v->size_m, 2, e))
        return false;
    v->focal_px = focal_m / pixel_m;
    return read_poses(v, y, e);
}

bool view_read(struct sim_view *v, struct ynode *root, const struct sample *s, struct err *e)
{
    struct ynode *y = NULL;
    int kind = 0;
    struct sim_view got = {.w = 1000, .h = 1000, .h_per_pixel = 7.2e-4};
    if (!ymap_map(root, "view", Y_OPTIONAL, &y, e) ||
        (y && (!ymap_choice(y, "kind", Y_OPTIONAL, "fourier|camera", &kind, e) ||
               !ymap_int(y, "width", Y_OPTIONAL, 1, 16384, &got.w, e) ||
               !ymap_int(y, "height", Y_OPTIONAL, 1, 16384, &got.h, e))))
        return false;
    got.fourier = kind == 0;
    got.center_x = 0.5 * (got.w - 1);
    got.center_y = 0.5 * (got.h - 1);
    if (got.fourier && s->layout != SAMPLE_PLANE)
        return yaml_bad(y ? y : root, e, "a disc or a bent sample needs 'kind: camera'");
    if (y && (!ymap_num(y, "center-x", Y_OPTIONAL, UNIT_PX, -1e5, 1e5, &got.center_x, e) ||
              !ymap_num(y, "center-y", Y_OPTIONAL, UNIT_PX, -1e5, 1e5, &got.center_y, e) ||
              !ymap_num(y, "defocus", Y_OPTIONAL, UNIT_PX, 0, 200, &got.defocus_px, e) ||
              !ymap_num(y, "glare", Y_OPTIONAL, UNIT_NONE, 0, 0.5, &got.glare, e) ||
              !ymap_num(y, "glare-radius", Y_OPTIONAL, UNIT_PX, 1, 1e4, &got.glare_px, e)))
        return false;
    if (got.fourier && y &&
        !ymap_num(y, "h-per-pixel", Y_OPTIONAL, UNIT_NONE, 1e-7, 1, &got.h_per_pixel, e))
        return false;
    if (!got.fourier && !read_camera(&got, y, e))
        return false;
    *v = got;
    return true;
}
