// view_inspect.c - half vectors, orders and wavelengths of a place.
#define _GNU_SOURCE
#include "ui/view_inspect.h"
#include "core/spectrum.h"
#include <math.h>
#include <string.h>

static bool chromaticity(const double rgb[3], double xy[2])
{
    double xyz[3];
    rgb_to_xyz(rgb, xyz);
    const double sum = xyz[0] + xyz[1] + xyz[2];
    if (!(sum > 0))
        return false;
    xy[0] = xyz[0] / sum;
    xy[1] = xyz[1] / sum;
    return true;
}

// Both as seen from white, the colour and each spectral colour are directions; the wavelength whose
// direction is the colour's lies where the cross product changes its sign in front.
double dominant_wavelength(const double rgb[3], const double white[3], double *purity)
{
    double c[2], w[2], before = 0;
    *purity = NAN;
    if (!chromaticity(rgb, c) || !chromaticity(white, w))
        return NAN;
    const double dx = c[0] - w[0], dy = c[1] - w[1], away = hypot(dx, dy);
    if (away < 2e-3)
        return NAN;
    for (int nm = 400; nm <= 700; nm++) { // beyond, the colour does not change
        double xyz[3];
        cie_xyz(nm * 1e-9, xyz);
        const double sum = xyz[0] + xyz[1] + xyz[2];
        const double x = xyz[0] / sum - w[0], y = xyz[1] / sum - w[1];
        const double cross = dx * y - dy * x;
        if (nm > 400 && (cross > 0) != (before > 0) && dx * x + dy * y > 0) {
            *purity = fmin(1, away / hypot(x, y));
            return (nm - cross / (cross - before)) * 1e-9;
        }
        before = cross;
    }
    return NAN;
}

static void find_orders(struct spot *s, double pitch_m)
{
    const double along = fabs(s->u) > fabs(s->v) ? s->u : s->v;
    s->n_orders = 0;
    for (int k = 1; k < 1000 && s->n_orders < SPOT_ORDERS; k++) {
        const double lambda_m = fabs(along) * pitch_m / k;
        if (lambda_m > CIE_LAST_NM * 1e-9)
            continue;
        if (lambda_m < CIE_FIRST_NM * 1e-9)
            break;
        const double m = s->u * pitch_m / lambda_m, n = s->v * pitch_m / lambda_m;
        const double off = hypot(m - round(m), n - round(n));
        if (off > 0.12) // the other axis is between two orders
            continue;
        if (fmax(fabs(m), fabs(n)) > SPOT_HIGHEST)
            break;
        s->order[s->n_orders].m = (int)lround(m);
        s->order[s->n_orders].n = (int)lround(n);
        s->order[s->n_orders++].lambda_m = lambda_m;
    }
}

void spot_conclude(struct spot *s, const double white[3], double lambda_m, double pitch_m)
{
    s->reach = hypot(s->u, s->v);
    s->azimuth_rad = atan2(s->v, s->u);
    s->angle_rad = s->reach <= 1 ? asin(s->reach) : NAN;
    s->lambda_m = dominant_wavelength(s->rgb, white, &s->purity);
    if (isnan(s->lambda_m))
        s->lambda_m = lambda_m;
    s->pitch_m = s->reach > 1e-4 ? s->lambda_m / s->reach : NAN;
    find_orders(s, pitch_m);
}

static double bilinear(const float *px, int n, int nc, int c, double x, double y)
{
    const int i = x < n - 1 ? (int)x : n - 2, j = y < n - 1 ? (int)y : n - 2;
    const double a = x - i, b = y - j;
    const float *p = px + ((size_t)j * (size_t)n + (size_t)i) * (size_t)nc + c;
    const size_t row = (size_t)n * (size_t)nc;
    return (1 - b) * ((1 - a) * (double)p[0] + a * (double)p[nc]) +
           b * ((1 - a) * (double)p[row] + a * (double)p[row + (size_t)nc]);
}

static void sigma_at(const struct table *t, double u, double v, double sigma[3])
{
    const double x = table_index(t, u), y = table_index(t, v);
    for (int c = 0; c < 3; c++)
        sigma[c] = t->sigma && !isnan(x) && !isnan(y) ? bilinear(t->sigma, t->n, 3, c, x, y) : NAN;
}

bool spot_of_table(struct spot *s, const struct table *t, double u, double v)
{
    if (isnan(table_index(t, u)) || isnan(table_index(t, v)))
        return false;
    *s = (struct spot){.u = u, .v = v, .w = NAN, .in_rad = NAN, .out_rad = NAN};
    table_eval(t, u, v, 2, 0, s->rgb);
    sigma_at(t, u, v, s->sigma);
    return true;
}

static const struct object *nearest(const struct scene *scene, struct vec3 from, struct vec3 dir,
                                    struct hit *best)
{
    const struct object *found = NULL;
    struct hit h;
    for (int k = 0; k < scene->n_objects; k++)
        if (shape_hit(&scene->object[k].shape, from, dir, &h) &&
            (!found || h.distance < best->distance)) {
            *best = h;
            found = &scene->object[k];
        }
    return found;
}

// The light that adds most there: its direction in the surface frame.
static bool strongest(const struct scene *scene, const struct hit *h, struct vec3 *wi)
{
    double most = 0;
    for (int k = 0; k < scene->n_lights; k++) {
        struct vec3 to;
        const double e = light_at(&scene->light[k], h->at_m, &to) * v3_dot(to, h->frame.n);
        if (e > most) {
            most = e;
            *wi = frame_local(&h->frame, to);
        }
    }
    const struct surround *around = scene->surround;
    for (int k = 0; around && k < around->n_lights; k++) {
        const struct surround_light *l = &around->light[k];
        const double e = l->irradiance[1] * v3_dot(l->to, h->frame.n);
        if (e > most) {
            most = e;
            *wi = frame_local(&h->frame, l->to);
        }
    }
    return most > 0;
}

// The table's sigma as the material scales the table's value.
static void scaled_sigma(struct spot *s, const struct material *m, struct vec3 wi, struct vec3 wo)
{
    double value[3], shown[3];
    for (int c = 0; c < 3; c++)
        s->sigma[c] = NAN;
    if (m->diffraction != DIFFRACTION_TABLE || !m->table.sigma)
        return;
    table_eval(&m->table, s->u, s->v, s->w, material_tables(m), value);
    material_diffraction(m, wi, wo, shown);
    sigma_at(&m->table, s->u, s->v, s->sigma);
    const double sum = value[0] + value[1] + value[2];
    const double scale = sum > 0 ? (shown[0] + shown[1] + shown[2]) / sum : NAN;
    for (int c = 0; c < 3; c++)
        s->sigma[c] *= scale;
}

bool spot_of_scene(struct spot *s, const struct scene *scene, double x, double y, int w, int h)
{
    struct vec3 dir, wi;
    struct hit hit = {0};
    camera_ray(&scene->camera, x, y, w, h, &dir);
    const struct object *o = nearest(scene, scene->camera.eye_m, dir, &hit);
    if (!o || !strongest(scene, &hit, &wi))
        return false;
    const struct vec3 wo = frame_local(&hit.frame, v3_unit(v3_scale(-1, dir)));
    const struct vec3 half = v3_add(wi, wo);
    *s = (struct spot){.u = half.x, .v = half.y, .w = half.z, .object = o->name};
    s->in_rad = acos(fmin(1, wi.z));
    s->out_rad = acos(fmin(1, wo.z));
    scaled_sigma(s, &o->material, wi, wo);
    return true;
}
