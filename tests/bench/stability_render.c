// stability_render.c - reflectances, hits, polynomials of a calibration, lenses.
#define _GNU_SOURCE
#include "calib/lens.h"
#include "calib/poly.h"
#include "render/display.h"
#include "render/material.h"
#include "render/shape.h"
#include "tests/bench/stability.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>

static const long double pi_l = 3.14159265358979323846264338327950288L;

static double schlick(const double *x, uint64_t seed)
{
    (void)seed;
    const long double want = x[0] + (1 - (long double)x[0]) * powl(1 - (long double)x[1], 5);
    return stability_off(fresnel_schlick(x[0], x[1]), want, want + DBL_MIN);
}

static long double dielectric_l(long double n, long double c)
{
    const long double t = sqrtl((n - 1) * (n + 1) + c * c) / n;
    const long double s = (c - n * t) / (c + n * t), p = (n * c - t) / (n * c + t);
    return (s * s + p * p) / 2;
}

static double dielectric(const double *x, uint64_t seed)
{
    (void)seed;
    const double n = 1 + x[0], c = x[1];
    const long double want = n == 1 && c == 0 ? 0 : dielectric_l(n, c); // no coat at all
    return stability_off(fresnel_dielectric(n, c), want, 1);
}

static double through_diffuse(const double *x, uint64_t seed)
{
    (void)seed;
    const double t = coat_through_diffuse(1 + x[0]);
    return t > 0 && t <= 1 ? 0 : NAN;
}

// A direction of the upper hemisphere, as near to the horizon as one likes.
static struct vec3 direction(double cosine, double turn)
{
    const double sine = sqrt((1 - cosine) * (1 + cosine)), ph = 2 * M_PI * turn;
    return v3(sine * cos(ph), sine * sin(ph), cosine);
}

static double specular(const double *x, uint64_t seed)
{
    (void)seed;
    struct material m;
    const struct vec3 wi = direction(x[1], x[2]), wo = direction(x[3], x[4]);
    double out[3];
    if (!(wi.z > 0 && wo.z > 0))
        return 0;
    material_init(&m);
    m.roughness = x[0];
    m.specular[0] = m.specular[1] = m.specular[2] = 0.04;
    material_specular(&m, wi, wo, out);
    const long double hx = (long double)wi.x + wo.x, hy = (long double)wi.y + wo.y;
    const long double hz = (long double)wi.z + wo.z, hh = hx * hx + hy * hy + hz * hz;
    const long double hn2 = hz * hz / hh, off = (hx * hx + hy * hy) / hh,
                      m2 = x[0] * (long double)x[0];
    const long double cos_half =
        ((long double)wo.x * hx + (long double)wo.y * hy + wo.z * hz) / sqrtl(hh);
    const long double d = expl(-off / (hn2 * m2) - logl(pi_l * m2) - 2 * logl(hn2));
    const long double g = fminl(1, 2 * sqrtl(hn2) * fminl(wi.z, wo.z) / cos_half);
    const long double want =
        d * g / (4 * (long double)wo.z) * (0.04L + 0.96L * powl(1 - fminl(1, cos_half), 5));
    if (want > 1e300L)
        return isfinite(out[0]) || want > DBL_MAX ? 0 : NAN;
    // an exponent has the digits of its argument; cos_half^2 those above 1e-16
    return stability_off(out[0], want, want * (1 + off / (hn2 * m2)) * (1 + 1e-3L / hh) + 1e-290L);
}

static double diffraction(const double *x, uint64_t seed)
{
    float tab[12];
    struct table t = {.n = 2, .range = 2, .power = 1, .count = 1, .tab = tab, .is_rgb = true};
    struct material m;
    const struct vec3 wi = direction(x[1], x[2]), wo = direction(x[3], x[4]);
    double out[3];
    (void)seed;
    if (!(wi.z > 0 && wo.z > 0))
        return 0;
    for (int k = 0; k < 12; k++)
        tab[k] = 1;
    material_init(&m);
    m.table = t;
    m.diffraction = DIFFRACTION_TABLE;
    m.table_scale = 4 * M_PI * M_PI;
    m.r0 = x[0];
    material_diffraction(&m, wi, wo, out);
    const long double s =
        1 + (long double)wi.x * wo.x + (long double)wi.y * wo.y + (long double)wi.z * wo.z;
    const long double f =
        x[0] + (1 - (long double)x[0]) * powl(fmaxl(0, 1 - sqrtl(fmaxl(0, s) / 2)), 5);
    const long double want = 4 * pi_l * pi_l * f * s * s / wo.z;
    if (want > DBL_MAX)
        return 0;
    return stability_off(out[0], want, (want + 1e-16L / wo.z) * (1 + 1e-1L / (fabsl(s) + 1e-15L)));
}

static double eval(const double *x, uint64_t seed)
{
    (void)seed;
    struct material m;
    const struct vec3 wi = direction(x[1], x[2]), wo = direction(x[3], x[4]);
    const double white[3] = {1, 1, 1};
    double out[3];
    material_init(&m);
    m.coat_ior = 1 + x[0];
    m.diffuse[0] = m.diffuse[1] = m.diffuse[2] = 0.5;
    material_eval(&m, wi, wo, white, 1, out);
    const bool up = wi.z > 0 && wo.z > 0;
    const long double want = up ? (1 - dielectric_l(m.coat_ior, wi.z)) *
                                      (1 - dielectric_l(m.coat_ior, wo.z)) * 0.5L / pi_l * wi.z
                                : 0;
    return stability_off(out[0], want, fmax(0, wi.z) + DBL_MIN);
}

static double slits_of(const double *x, uint64_t seed)
{
    (void)seed;
    double lambda[2] = {380e-9, 780e-9}, one[2] = {1, 1}, out[3];
    const struct spectrum even = {2, lambda, one};
    struct slits s = {.row = {{.pitch_m = x[0], .width_m = 0.5 * x[0], .count = (int)x[1]}},
                      .across = x[2]};
    struct err e;
    if (!slits_light(&s, &even, 9, &e))
        return NAN;
    slits_eval(&s, x[3], x[4], out);
    const double peak = multislit_peak(&s.row[0], 380e-9) / x[2];
    slits_finish(&s);
    double worst = 0; // of linear sRGB: some channel may be negative, none beyond the peak
    for (int c = 0; c < 3; c++)
        worst = stability_worse(worst, isfinite(out[c]) && fabs(out[c]) <= 10 * peak ? 0 : NAN);
    return worst;
}

static double hit_of(const double *x, uint64_t seed)
{
    struct shape s = {.kind = (enum shape_kind)(seed % 4),
                      .width_m = x[0],
                      .height_m = x[0],
                      .radius_m = x[0],
                      .inner_m = 0,
                      .span_rad = 6};
    s.frame = (struct frame){v3(1, 0, 0), v3(0, 1, 0), v3(0, 0, 1)};
    const double far = x[0] * (1 + x[1]);
    const struct vec3 from = v3_scale(far, direction(x[2], x[3]));
    const struct vec3 at = v3_scale(0.7 * x[0], v3(x[4] - 0.5, x[5] - 0.5, 0));
    const struct vec3 dir = v3_unit(v3_sub(at, from));
    struct hit h;
    if (!isfinite(dir.x) || !shape_hit(&s, from, dir, &h))
        return 0;
    double off = fabs(h.at_m.z);
    if (s.kind == SHAPE_SPHERE)
        off = fabs(v3_norm(h.at_m) - x[0]);
    else if (s.kind == SHAPE_CYLINDER)
        off = fabs(hypot(h.at_m.x, h.at_m.z) - x[0]);
    double worst = stability_off(off, 0, far * (1 + x[1])); // the root loses digits with distance
    worst = stability_worse(worst, stability_off(v3_norm(h.frame.n), 1, 1e4 * (1 + x[1])));
    return stability_worse(worst, stability_off(v3_norm(h.frame.t), 1, 1));
}

static double display_of(const double *x, uint64_t seed)
{
    struct image im = {0};
    struct err e;
    if (!image_init(&im, 1, 1, 3, &e))
        return NAN;
    for (int c = 0; c < 3; c++)
        im.px[c] = seed % 16 == (uint64_t)c       ? NAN
                   : seed % 16 == (uint64_t)c + 3 ? INFINITY
                                                  : (float)x[c];
    display_map(&im, 40 * (2 * x[3] - 1));
    double worst = 0;
    for (int c = 0; c < 3; c++)
        worst = stability_worse(worst, im.px[c] >= 0 && im.px[c] <= 1.0001f ? 0 : NAN);
    image_finish(&im);
    return worst;
}

static double poly_of(const double *x, uint64_t seed)
{
    double term[POLY_TERMS], m[POLY_TERMS];
    long double want = 0, size = 0;
    stability_noise(seed, POLY_TERMS, term);
    poly_terms(x[0], x[1], m);
    int k = 0;
    for (int a = 0; a <= 4; a++)
        for (int b = 0; a + b <= 4; b++, k++) {
            const long double one = term[k] * powl(x[0], a) * powl(x[1], b);
            want += one;
            size += fabsl(one);
        }
    return stability_off(poly_at(term, x[0], x[1]), want, size);
}

// Out into the world and back to the pixel, through lenses as they are sold.
static double lens_of(const double *x, uint64_t seed)
{
    double noise[5], i, j;
    stability_noise(seed, 5, noise);
    struct lens l = {0};
    l.head.w = 4000;
    l.head.h = 3000;
    l.camera.focal_px[0] = l.camera.focal_px[1] = x[0];
    l.camera.center_px[0] = 2000;
    l.camera.center_px[1] = 1500;
    l.camera.distortion[0] = 0.05 * fmax(-1, fmin(1, noise[0]));
    l.camera.distortion[1] = 0.01 * fmax(-1, fmin(1, noise[1]));
    l.camera.distortion[2] = 1e-3 * fmax(-1, fmin(1, noise[2]));
    l.camera.distortion[3] = 1e-3 * fmax(-1, fmin(1, noise[3]));
    const double pi = 4000 * x[1], pj = 3000 * x[2];
    lens_project(&l, lens_ray(&l, pi, pj), &i, &j);
    return stability_worse(stability_off(i, pi, 4000), stability_off(j, pj, 4000));
}

#define DIRECTIONS                                                                                 \
    {AT_UNIT, 0, 1}, {AT_UNIT, 0, 1}, {AT_UNIT, 0, 1},                                             \
    {                                                                                              \
        AT_UNIT, 0, 1                                                                              \
    }
const struct stability_probe stability_render[] = {
    {"fresnel_schlick",
     1e-14,
     "the reflectance",
     1,
     schlick,
     {{AT_LOG, 1e-300, 1}, {AT_UNIT, 0, 1}}},
    {"fresnel_dielectric", 1e-14, "1", 1, dielectric, {{AT_LOG, 1e-16, 1e6}, {AT_UNIT, 0, 1}}},
    {"coat_through_diffuse", 0, "-", 1, through_diffuse, {{AT_LOG, 1e-16, 3}}},
    {"material_specular",
     1e-9,
     "the lobe, its exponent's digits",
     2,
     specular,
     {{AT_LOG, 1e-4, 1e4}, DIRECTIONS}},
    {"material_diffraction",
     1e-12,
     "f cos, opposite directions apart",
     2,
     diffraction,
     {{AT_LOG, 1e-6, 1}, DIRECTIONS}},
    {"material_eval, coated", 1e-12, "cos_i", 2, eval, {{AT_LOG, 1e-16, 10}, DIRECTIONS}},
    {"slits_eval",
     0,
     "-",
     20,
     slits_of,
     {{AT_LOG, 1e-9, 1e-1},
      {AT_COUNT, 1, 1e6},
      {AT_LOG, 1e-9, 1e3},
      {AT_SIGNED, 1e-320, 2},
      {AT_SIGNED, 1e-320, 2}}},
    {"shape_hit",
     1e-12,
     "distances",
     2,
     hit_of,
     {{AT_LOG, 1e-9, 1e9}, {AT_LOG, 1e-3, 1e6}, DIRECTIONS}},
    {"display_map",
     0,
     "-",
     4,
     display_of,
     {{AT_SIGNED, 1e-45, 3e38},
      {AT_SIGNED, 1e-45, 3e38},
      {AT_SIGNED, 1e-45, 3e38},
      {AT_UNIT, 0, 1}}},
    {"poly_at",
     1e-14,
     "the terms",
     2,
     poly_of,
     {{AT_SIGNED, 1e-60, 1e60}, {AT_SIGNED, 1e-60, 1e60}}},
    {"lens_ray and lens_project",
     1e-9,
     "4000 px",
     4,
     lens_of,
     {{AT_LOG, 3000, 1e9}, {AT_UNIT, 0, 1}, {AT_UNIT, 0, 1}}},
    {0},
};
