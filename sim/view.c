// view.c - from pixels to half vectors.
#define _GNU_SOURCE
#include "sim/view.h"
#include <math.h>

static bool fourier_sight(const struct sim_view *view, const struct sample *s, double i, double j,
                          struct sight *at)
{
    at->u = (i - view->center_x) * view->h_per_pixel;
    at->v = (j - view->center_y) * view->h_per_pixel;
    const double across2 = at->u * at->u + at->v * at->v;
    if (across2 >= 1)
        return false; // past the horizon
    const double cos_o = sqrt(1 - across2);
    const double fresnel = sample_fresnel(s, sqrt(0.5 + 0.5 * cos_o));
    at->w = 1 + cos_o;
    const double g = at->w * at->w / cos_o; // (1 + wi.wo)^2 / (cos_i cos_o), wi = n
    at->factor = fresnel * g / (at->w * at->w);
    at->lm = s->r0 / (g * fresnel);
    return true;
}

// Brown's model maps (x, y) to the distorted place; its inverse by Newton's method.
static void distort(const double k[5], double x, double y, double out[2])
{
    const double r2 = x * x + y * y, radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
    out[0] = x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x);
    out[1] = y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y;
}

static void undistort(const double k[5], double xd, double yd, double out[2])
{
    double x = xd, y = yd;
    for (int turn = 0; turn < 20; turn++) {
        const double step = 1e-6;
        double f[2], fx[2], fy[2];
        distort(k, x, y, f);
        distort(k, x + step, y, fx);
        distort(k, x, y + step, fy);
        const double a = (fx[0] - f[0]) / step, b = (fy[0] - f[0]) / step;
        const double c = (fx[1] - f[1]) / step, d = (fy[1] - f[1]) / step, det = a * d - b * c;
        const double ex = xd - f[0], ey = yd - f[1];
        if (fabs(ex) + fabs(ey) < 1e-14)
            break;
        x += (d * ex - b * ey) / det;
        y += (a * ey - c * ex) / det;
    }
    out[0] = x;
    out[1] = y;
}

struct vec3 view_ray(const struct sim_view *v, double i, double j)
{
    double at[2] = {(i - v->center_x) / v->focal_px, (j - v->center_y) / v->focal_px};
    undistort(v->distortion, at[0], at[1], at);
    return v3_unit(frame_world(&v->camera, v3(at[0], at[1], 1)));
}

void view_project(const struct sim_view *v, struct vec3 at_m, double px[2])
{
    const struct vec3 at = frame_local(&v->camera, v3_sub(at_m, v->camera_m));
    distort(v->distortion, at.x / at.z, at.y / at.z, px);
    px[0] = v->center_x + v->focal_px * px[0];
    px[1] = v->center_y + v->focal_px * px[1];
}

static bool in_stripe(const struct sample *s, double x_m)
{
    return !(s->stripe_m > 0) || x_m / s->stripe_m - floor(x_m / s->stripe_m) < s->stripe_duty;
}

static bool hit_plane(const struct sim_view *v, const struct sample *s, struct vec3 ray,
                      struct vec3 *x, struct frame *local)
{
    const double towards = v3_dot(ray, v->sample.n);
    const double far = v3_dot(v3_sub(v->sample_m, v->camera_m), v->sample.n) / towards;
    if (!(towards < 0) || !(far > 0))
        return false;
    *x = v3_add(v->camera_m, v3_scale(far, ray));
    *local = v->sample;
    const struct vec3 at = frame_local(&v->sample, v3_sub(*x, v->sample_m));
    if (s->layout == SAMPLE_PLANE)
        return fabs(at.x) <= 0.5 * v->size_m[0] && fabs(at.y) <= 0.5 * v->size_m[1] &&
               in_stripe(s, at.x);
    const double r = hypot(at.x, at.y); // on a disc t runs outwards
    return r > fmax(1e-9, s->hub_m) && r <= 0.5 * v->size_m[0] && in_stripe(s, r) &&
           frame_from(frame_world(&v->sample, v3(at.x, at.y, 0)), v->sample.n, local);
}

// The cylinder's axis runs along b, behind the sample: it bulges towards the camera.
static bool hit_cylinder(const struct sim_view *v, const struct sample *s, struct vec3 ray,
                         struct vec3 *x, struct frame *local)
{
    const double radius = s->bend_radius_m;
    const struct vec3 axis = v3_sub(v->sample_m, v3_scale(radius, v->sample.n));
    const struct vec3 o = frame_local(&v->sample, v3_sub(v->camera_m, axis));
    const struct vec3 d = frame_local(&v->sample, ray);
    const double a = d.x * d.x + d.z * d.z, b = o.x * d.x + o.z * d.z;
    const double c = o.x * o.x + o.z * o.z - radius * radius, root2 = b * b - a * c;
    if (!(a > 0) || !(root2 > 0) || !(-b - sqrt(root2) > 0))
        return false;
    const struct vec3 at = v3_add(o, v3_scale((-b - sqrt(root2)) / a, d));
    const double along = radius * atan2(at.x, at.z);
    *x = v3_add(axis, frame_world(&v->sample, at));
    local->b = v->sample.b;
    local->n = v3_unit(frame_world(&v->sample, v3(at.x, 0, at.z)));
    local->t = v3_cross(local->b, local->n);
    return fabs(along) <= 0.5 * v->size_m[0] && fabs(at.y) <= 0.5 * v->size_m[1] &&
           in_stripe(s, along);
}

// The BRDF's geometry at x for the light at `light`, which is as strong as one at the middle.
static bool lit_from(const struct sim_view *v, const struct sample *s, struct vec3 light,
                     struct vec3 x, const struct frame *local, struct sight *at)
{
    const struct vec3 to_light = v3_sub(light, x), axis = v3_sub(v->light_m, v->sample_m);
    const struct vec3 wi = v3_unit(to_light), wo = v3_unit(v3_sub(v->camera_m, x));
    const struct vec3 h = frame_local(local, v3_add(wi, wo));
    const double cos_i = v3_dot(wi, local->n), cos_o = v3_dot(wo, local->n);
    const double beam = v3_dot(wi, v3_unit(axis)), wi_wo = v3_dot(wi, wo);
    if (!(cos_i > 0) || !(cos_o > 0) || !(beam > 0))
        return false;
    const double at_origin = v3_dot(v3_unit(axis), v->sample.n) / v3_dot(axis, axis);
    const double here = cos_i / v3_dot(to_light, to_light) * pow(beam, v->light_beam);
    const double fresnel = sample_fresnel(s, sqrt(0.5 + 0.5 * wi_wo));
    const double g = (1 + wi_wo) * (1 + wi_wo) / (cos_i * cos_o), irradiance = here / at_origin;
    at->u = h.x;
    at->v = h.y;
    at->w = h.z;
    at->factor = fresnel * g / (h.z * h.z) * irradiance;
    at->lm = s->r0 / (g * fresnel * irradiance);
    return true;
}

// The middle of the light and six points of a ring: exact for polynomials of degree 5 over a disc
// (Abramowitz and Stegun 25.4.61).
static int light_points(const struct sim_view *v, struct vec3 out[SIGHTS])
{
    struct frame f;
    out[0] = v->light_m;
    if (!(v->light_diameter_m > 0))
        return 1;
    const struct vec3 n = v3_sub(v->sample_m, v->light_m);
    if (!frame_from(v3(1, 0, 0), n, &f))
        frame_from(v3(0, 1, 0), n, &f);
    const double r = 0.5 * v->light_diameter_m * sqrt(2. / 3);
    for (int k = 0; k < 6; k++)
        out[1 + k] = v3_add(v->light_m,
                            frame_world(&f, v3(r * cos(k * M_PI / 3), r * sin(k * M_PI / 3), 0)));
    return 7;
}

int view_sights(const struct sim_view *v, const struct sample *s, double i, double j,
                struct sight out[SIGHTS])
{
    struct vec3 x = {0}, light[SIGHTS];
    struct frame local;
    if (v->fourier) {
        out[0] = (struct sight){.w = NAN, .lm = NAN, .share = 1};
        fourier_sight(v, s, i, j, out);
        return 1;
    }
    const struct vec3 ray = view_ray(v, i, j);
    const bool hit = s->layout == SAMPLE_CYLINDER ? hit_cylinder(v, s, ray, &x, &local)
                                                  : hit_plane(v, s, ray, &x, &local);
    const int n = light_points(v, light);
    for (int k = 0; k < n; k++) {
        out[k] = (struct sight){.u = NAN, .v = NAN, .w = NAN, .lm = NAN};
        out[k].share = n == 1 ? 1 : k ? 0.125 : 0.25;
        if (hit)
            lit_from(v, s, light[k], x, &local, &out[k]);
    }
    return n;
}

double view_vignetting(const struct sim_view *v, double i, double j)
{
    if (v->fourier)
        return 1;
    const double x = i - v->center_x, y = j - v->center_y;
    const double cos2 = v->focal_px * v->focal_px / (v->focal_px * v->focal_px + x * x + y * y);
    const double r2 = 4 * (x * x + y * y) / ((double)v->w * v->w + (double)v->h * v->h);
    return (v->natural ? cos2 * cos2 : 1) *
           fmax(0, 1 + r2 * (v->vignetting[0] + r2 * v->vignetting[1]));
}

double view_w(const struct sim_view *view, double u, double v)
{
    const double across2 = u * u + v * v;
    if (view->fourier)
        return 1 + sqrt(fmax(0, 1 - across2));
    const struct vec3 wi = v3_unit(v3_sub(view->light_m, view->sample_m));
    const struct vec3 wo = v3_unit(v3_sub(view->camera_m, view->sample_m));
    return sqrt(fmax(0.01, 2 + 2 * v3_dot(wi, wo) - across2));
}

void view_resize(struct sim_view *v, int w, int h)
{
    const int new_w = w ? w : v->w, new_h = h ? h : v->h;
    const double scale = (double)new_w / v->w;
    v->center_x = (v->center_x + 0.5) * scale - 0.5;
    v->center_y = (v->center_y + 0.5 - 0.5 * v->h) * scale - 0.5 + 0.5 * new_h;
    v->h_per_pixel /= scale;
    v->focal_px *= scale;
    v->defocus_px *= scale;
    v->glare_px *= scale;
    v->w = new_w;
    v->h = new_h;
}
