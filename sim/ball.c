// ball.c - a mirror ball before an even background: its outline, and the light's mirror image.
#define _GNU_SOURCE
#include "core/yaml.h"
#include "sim/board.h"
#include "sim/lens.h"

bool ball_read(struct sim_ball *b, struct ynode *root, struct err *e)
{
    struct ynode *y = NULL, *list = NULL;
    double at[3] = {0};
    *b = (struct sim_ball){0};
    if (!ymap_map(root, "ball", Y_OPTIONAL, &y, e))
        return false;
    if (!y)
        return true;
    b->spot_px = 0.8;
    b->inside = 0.02;
    b->outside = 0.3;
    if (!ymap_num(y, "radius", Y_NEEDED, UNIT_M, 1e-6, 10, &b->radius_m, e) ||
        !ymap_num(y, "spot", Y_OPTIONAL, UNIT_PX, 0.3, 100, &b->spot_px, e) ||
        !ymap_num(y, "inside", Y_OPTIONAL, UNIT_NONE, 0, 1, &b->inside, e) ||
        !ymap_num(y, "outside", Y_OPTIONAL, UNIT_NONE, 0, 1, &b->outside, e) ||
        !ymap_list(y, "at", Y_NEEDED, &list, e))
        return false;
    if (ylist_count(list) != 3)
        return yaml_bad(list, e, "%d values, needs 3", ylist_count(list));
    for (int k = 0; k < 3; k++)
        if (!ynode_num(ylist_at(list, k), UNIT_M, -1e3, 1e3, &at[k], e))
            return false;
    b->at_m = v3(at[0], at[1], at[2]);
    return true;
}

// The place on the ball that mirrors the light to the camera: its normal halves the angle between
// both, in the plane of ball, camera and light. By bisection over the angle in that plane.
static struct vec3 mirror_point(const struct sim_ball *b, const struct sim_view *v)
{
    const struct vec3 to_camera = v3_sub(v->camera_m, b->at_m);
    const struct vec3 to_light = v3_sub(v->light_m, b->at_m);
    const struct vec3 x = v3_unit(to_camera);
    struct vec3 y = v3_sub(to_light, v3_scale(v3_dot(to_light, x), x));
    if (v3_norm(y) > 0)
        y = v3_unit(y);
    double lo = 0, hi = atan2(v3_dot(to_light, y), v3_dot(to_light, x));
    for (int k = 0; k < 100; k++) {
        const double mid = 0.5 * (lo + hi);
        const struct vec3 n = v3_add(v3_scale(cos(mid), x), v3_scale(sin(mid), y));
        const struct vec3 p = v3_add(b->at_m, v3_scale(b->radius_m, n));
        const double to_c = v3_dot(n, v3_unit(v3_sub(v->camera_m, p)));
        const double to_l = v3_dot(n, v3_unit(v3_sub(v->light_m, p)));
        if (to_c > to_l) // too near to the camera's side
            lo = mid;
        else
            hi = mid;
    }
    return v3_add(b->at_m,
                  v3_scale(b->radius_m, v3_add(v3_scale(cos(lo), x), v3_scale(sin(lo), y))));
}

static bool on_ball(const struct sim_ball *b, const struct sim_view *v, struct vec3 ray)
{
    const struct vec3 to = v3_sub(b->at_m, v->camera_m);
    const double along = v3_dot(to, ray);
    return along > 0 && v3_dot(to, to) - along * along < b->radius_m * b->radius_m;
}

bool ball_photo(const struct sim_ball *b, const struct sim_view *v, struct image *out,
                struct err *e)
{
    enum { SUB = 8 };
    struct image im;
    if (v->fourier || !(b->radius_m > 0))
        return err_set(e, ERR_DATA,
                       "no ball to photograph: the scene needs 'ball:' and a view of 'kind: "
                       "camera'");
    if (!image_init(&im, v->w, v->h, 1, e))
        return false;
    double spot[2];
    view_project(v, mirror_point(b, v), spot);
#pragma omp parallel for schedule(dynamic, 4)
    for (int j = 0; j < v->h; j++)
        for (int i = 0; i < v->w; i++) {
            int corners = 0; // tell, unless the edge runs through the pixel
            for (int q = 0; q < 4; q++)
                corners += on_ball(b, v, view_ray(v, i - 0.5 + q % 2, j - 0.5 + (q > 1)));
            int inside = corners == 4 ? SUB * SUB : 0;
            for (int q = 0; corners % 4 && q < SUB * SUB; q++)
                inside += on_ball(b, v,
                                  view_ray(v, i - 0.5 + (q % SUB + (q / SUB + 0.5) / SUB) / SUB,
                                           j - 0.5 + (q / SUB + (q % SUB + 0.5) / SUB) / SUB));
            im.px[(size_t)j * (size_t)v->w + (size_t)i] =
                (float)(b->outside + (b->inside - b->outside) * inside / (SUB * SUB));
        }
    bool ok = lens_blur(&im, 0, v->defocus_px, e);
    for (int j = 0; ok && j < v->h;
         j++) // the light is a point to the ball: the lens makes its size
        for (int i = 0; i < v->w; i++) {
            const double r = hypot(i - spot[0], j - spot[1]) / b->spot_px;
            im.px[(size_t)j * (size_t)v->w + (size_t)i] += (float)(5 * exp(-0.5 * r * r));
        }
    if (ok)
        *out = im;
    else
        image_finish(&im);
    return ok;
}
