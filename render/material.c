// material.c - the reflectance in double: the reference for the shader, which shares none of it.
#define _GNU_SOURCE
#include "render/material.h"
#include "core/spectrum.h"
#include <stdlib.h>
#include <string.h>

void material_init(struct material *m)
{
    *m = (struct material){.roughness = 0.1, .coat_ior = 1, .r0 = 0.04, .gain = 1};
}

void material_finish(struct material *m)
{
    if (!m)
        return;
    table_finish(&m->table);
    photo_finish(m->photo);
    free(m->photo);
    slits_finish(&m->slits);
    image_finish(&m->mask.picture);
}

void material_take_table(struct material *m, struct table *t, double r0)
{
    table_finish(&m->table);
    m->table = *t;
    *t = (struct table){0};
    const size_t samples = (size_t)m->table.count * (size_t)m->table.n * (size_t)m->table.n;
    for (size_t k = 0; k < samples && !m->table.is_rgb; k++) {
        float *px = m->table.tab + 3 * k;
        double rgb[3];
        xyz_to_rgb((const double[]){px[0], px[1], px[2]}, rgb);
        for (int c = 0; c < 3; c++)
            px[c] = (float)rgb[c];
    }
    m->table.is_rgb = true;
    double f0;
    m->r0 = !isnan(r0) ? r0 : meta_num(&m->table.meta, "nacre.f0", &f0) ? f0 * f0 : 0.04;
    m->over_w2 = m->table.basis != TABLE_PLAIN;
    const char *scale = meta_text(&m->table.meta, "nacre.scale");
    const bool absolute = scale && !strcmp(scale, "absolute");
    m->diffraction = DIFFRACTION_TABLE;
    m->table_scale = !m->over_w2 ? 4 * M_PI * M_PI : absolute ? 1 : 1 / m->r0;
}

double fresnel_schlick(double r0, double cos_half)
{
    return r0 + (1 - r0) * pow(fmax(0, 1 - cos_half), 5);
}

double fresnel_dielectric(double ior, double cos_i)
{
    // the root of (n^2 - 1 + c^2) / n^2: keeps its digits where light grazes a coat hardly there
    const double cos_t = hypot(sqrt((ior - 1) * (ior + 1)), cos_i) / ior;
    if (!(cos_i + cos_t > 0))
        return 0; // no coat
    const double s = (cos_i - ior * cos_t) / (cos_i + ior * cos_t);
    const double p = (ior * cos_i - cos_t) / (ior * cos_i + cos_t);
    return (s * s + p * p) / 2;
}

// Cook and Torrance 1982: Beckmann slopes, V-groove shadowing, Schlick for F. f cos_i, without F.
static double beckmann_lobe(double m, struct vec3 wi, struct vec3 wo, double *cos_half)
{
    const struct vec3 h = v3_unit(v3_add(wi, wo));
    const double hn2 = h.z * h.z, slope2 = (h.x * h.x + h.y * h.y) / (hn2 * m * m);
    *cos_half = v3_dot(h, wo);
    if (!(slope2 < 700)) // less than any double, whatever it is divided by
        return 0;
    const double d = exp(-slope2) / (M_PI * m * m * hn2 * hn2);
    // shadowing, at most 1, over 4 cos_o
    return d * fmin(0.25 / wo.z, h.z * (fmin(wi.z, wo.z) / wo.z) / (2 * *cos_half));
}

bool material_choose(struct material *m, const char *name, struct err *e)
{
    static const char *const names[] = {"none", "table", "slits", "g04"};
    const bool has[] = {true, m->table.n > 0 || m->photo, m->slits.n > 0, m->rainbow.spacing_m > 0};
    for (int k = 0; k < 4; k++)
        if (!strcmp(name, names[k]) && has[k]) {
            m->diffraction = (enum diffraction)k;
            return true;
        }
    return err_set(e, ERR_DATA, "the sample has no '%s' to diffract with", name);
}

int material_tables(const struct material *m)
{
    const int n = m->table.count;
    return m->tables_used > 0 && m->tables_used < n ? m->tables_used : n;
}

void material_set_tolerance(struct material *m, double tolerance)
{
    const struct meta_item *error = meta_find(&m->table.meta, "nacre.error_l2");
    m->tables_used = 0;
    for (int k = 0; error && k < error->n && !m->tables_used; k++)
        if (error->num && error->num[k] <= tolerance)
            m->tables_used = k + 1;
}

double mask_at(const struct mask *m, double s, double v)
{
    if (m->stripes > 0 && s * m->stripes - floor(s * m->stripes) >= m->duty)
        return 0;
    const struct image *p = &m->picture;
    if (!p->px)
        return 1;
    const double i = floor(s * p->w), j = floor((1 - v) * p->h);
    const size_t at =
        (size_t)fmax(0, fmin(p->h - 1, j)) * (size_t)p->w + (size_t)fmax(0, fmin(p->w - 1, i));
    return (double)p->px[at * (size_t)p->nc];
}

// With G = (1 + wi.wo)^2 / (cos_i cos_o), cos_i drops out.
void material_diffraction(const struct material *m, struct vec3 wi, struct vec3 wo, double out[3])
{
    out[0] = out[1] = out[2] = 0;
    const struct vec3 h = v3_add(wi, wo);
    const double x = 1 + v3_dot(wi, wo);
    double weight = fresnel_schlick(m->r0, sqrt(fmax(0, x) / 2)) * x * x / wo.z;
    switch (m->diffraction) {
    case DIFFRACTION_NONE: return;
    case DIFFRACTION_TABLE:
        weight *= m->table_scale;
        if (m->over_w2)
            weight /= h.z * h.z;
        table_eval(&m->table, h.x, h.y, h.z, m->tables_used, out);
        break;
    case DIFFRACTION_SLITS:
        weight *= 4 * M_PI * M_PI;
        slits_eval(&m->slits, h.x, h.y, out);
        break;
    case DIFFRACTION_STAM: // the listing's colour is the picture's
        weight = 1;
        rainbow_rgb(&m->rainbow, h.x, h.z, out);
        break;
    case DIFFRACTION_KINDS: return;
    }
    for (int c = 0; c < 3; c++)
        out[c] *= weight * m->gain;
}

bool material_has_specular(const struct material *m)
{
    return m->specular[0] + m->specular[1] + m->specular[2] > 0;
}

void material_specular(const struct material *m, struct vec3 wi, struct vec3 wo, double out[3])
{
    double cos_half;
    const double lobe = beckmann_lobe(m->roughness, wi, wo, &cos_half);
    for (int c = 0; c < 3; c++)
        out[c] = lobe * fresnel_schlick(m->specular[c], cos_half);
}

double coat_through(double ior, double cos_i)
{
    return 1 - fresnel_dielectric(ior, cos_i);
}

double coat_through_diffuse(double ior)
{
    return 1 - (ior - 1) / (4.08567 + 1.00071 * ior); // Egan and Hilgeman 1973
}

void material_eval(const struct material *m, struct vec3 wi, struct vec3 wo, const double light[3],
                   double diffracts, double out[3])
{
    out[0] = out[1] = out[2] = 0;
    if (!(wi.z > 0 && wo.z > 0))
        return;
    double specular[3] = {0};
    if (diffracts > 0)
        material_diffraction(m, wi, wo, out);
    if (material_has_specular(m))
        material_specular(m, wi, wo, specular);
    const double through = coat_through(m->coat_ior, wi.z) * coat_through(m->coat_ior, wo.z);
    for (int c = 0; c < 3; c++) {
        const double rest = m->diffuse[c] / M_PI * wi.z + specular[c];
        out[c] = through * (diffracts * out[c] + rest * light[c]);
    }
}
