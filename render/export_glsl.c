// export_glsl.c - the table as a GLSL function that needs nothing but its texture.
#define _GNU_SOURCE
#include "core/imgfile.h"
#include "core/mem.h"
#include "core/outfile.h"
#include "render/export.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { CURVE = 64 }; // samples of a curve over w in the snippet

// All tables below each other: layer m is rows m n .. m n + n - 1, and row 0 of each is v = -R.
static bool write_texture(const struct material *m, const char *path, struct err *e)
{
    const struct table *t = &m->table;
    struct image im;
    if (!image_init(&im, t->n, t->n * material_tables(m), 3, e))
        return false;
    memcpy(im.px, t->tab, (size_t)im.w * (size_t)im.h * 3 * sizeof *im.px);
    const bool ok = image_write(&im, path, e);
    image_finish(&im);
    return ok;
}

// The weights of the layers at w: polynomials as such, curves as samples.
static void write_weights(FILE *f, const struct material *m)
{
    const struct table *t = &m->table;
    const int layers = material_tables(m);
    if (t->basis == TABLE_TAYLOR)
        fputs("float nacre_weight(int m, float w) { return m == 0 ? 1.0 : pow(w, float(m)); }\n\n",
              f);
    if (t->basis == TABLE_CHEBYSHEV)
        fprintf(f,
                "float nacre_weight(int m, float w)\n{\n"
                "    float x = (2.0 * w - %#.9g) / %#.9g;\n"
                "    return cos(float(m) * acos(clamp(x, -1.0, 1.0)));\n}\n\n",
                t->w_min + t->w_max, t->w_max - t->w_min);
    if (t->basis != TABLE_POD)
        return;
    fprintf(f, "const float nacre_curve[%d] = float[](", layers * CURVE);
    for (int m_ = 0; m_ < layers; m_++)
        for (int k = 0; k < CURVE; k++)
            fprintf(f, "%s%s%.7e", m_ || k ? "," : "", k % 6 ? " " : "\n    ",
                    table_weight(t, m_, t->w_min + (t->w_max - t->w_min) * k / (CURVE - 1)));
    fprintf(f,
            ");\n\nfloat nacre_weight(int m, float w)\n{\n"
            "    float at = clamp((w - %#.9g) / %#.9g, 0.0, 1.0) * %d.0;\n"
            "    int k = min(int(at), %d);\n"
            "    return mix(nacre_curve[m * %d + k], nacre_curve[m * %d + k + 1], at - float(k));\n"
            "}\n\n",
            t->w_min, t->w_max - t->w_min, CURVE - 1, CURVE - 2, CURVE, CURVE);
}

static void write_function(FILE *f, const struct material *m)
{
    const struct table *t = &m->table;
    fprintf(
        f,
        "// Radiance towards wo per unit irradiance (normal to the beam) from wi: f cos_i, linear\n"
        "// sRGB. Directions are unit, in the surface frame (t, b, n), and leave the surface.\n"
        "vec3 nacre_diffraction(vec3 wi, vec3 wo)\n{\n"
        "    vec3 h = wi + wo; // not normalised\n"
        "    vec2 s = abs(h.xy) / %#.9g;\n"
        "    if (wi.z <= 0.0 || wo.z <= 0.0 || max(s.x, s.y) > 1.0)\n"
        "        return vec3(0.0);\n",
        t->range);
    if (t->power > 1) // nodes u = R sgn(s) |s|^p
        fprintf(f, "    s = pow(s, vec2(1.0 / %d.0));\n", t->power);
    fprintf(f, "    vec2 at = ((sign(h.xy) * s * 0.5 + 0.5) * %d.0 + 0.5) / %d.0;\n", t->n - 1,
            t->n);
    if (t->basis == TABLE_PLAIN)
        fputs("    vec3 sum = texture(nacre_table, vec3(at, 0.0)).rgb;\n", f);
    else
        fprintf(
            f,
            "    vec3 sum = vec3(0.0);\n"
            "    for (int m = 0; m < %d; m++)\n"
            "        sum += nacre_weight(m, h.z) * texture(nacre_table, vec3(at, float(m))).rgb;\n",
            material_tables(m));
    fprintf(f,
            "    float x = 1.0 + dot(wi, wo); // G = x^2 / (cos_i cos_o)\n"
            "    float y = max(0.0, 1.0 - sqrt(0.5 * x));\n"
            "    float fresnel = %#.9g + %#.9g * y * y * y * y * y; // Schlick, F^2\n"
            "    return %#.9g * sum * fresnel * x * x / wo.z%s;\n}\n",
            m->r0, 1 - m->r0, m->table_scale * m->gain, m->over_w2 ? " / (h.z * h.z)" : "");
}

bool export_glsl(const struct material *m, const char *path, struct export_loss *loss,
                 struct err *e)
{
    const char *slash = strrchr(path, '/'), *dot = strrchr(slash ? slash : path, '.');
    char *texture = xasprintf("%.*s.pfm", dot ? (int)(dot - path) : (int)strlen(path), path);
    const char *name = strrchr(texture, '/');
    *loss = (struct export_loss){
        .what = "Lost: nothing of the table but its variance and coverage; spectra other than the "
                "table's own."};
    char *text = NULL;
    size_t size = 0;
    FILE *f = open_memstream(&text, &size);
    fprintf(
        f,
        "// Diffraction, by nacre %s. %s\n//\n"
        "// Texture: %s, %d layers of %d x %d below each other, linear sRGB, as\n"
        "// GL_TEXTURE_2D_ARRAY, GL_RGB32F, GL_LINEAR, GL_CLAMP_TO_EDGE; the picture's top row is\n"
        "// the first (v = -R). PFM files store rows from the bottom up.\n"
        "uniform sampler2DArray nacre_table;\n\n",
        NACRE_VERSION, loss->what, name ? name + 1 : texture, material_tables(m), m->table.n,
        m->table.n);
    write_weights(f, m);
    write_function(f, m);
    fclose(f);
    const bool ok = write_texture(m, texture, e) && outfile_write(path, text, size, e);
    free(text);
    free(texture);
    return ok;
}
