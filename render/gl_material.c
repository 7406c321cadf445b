// gl_material.c - tables, curves over w, spectra and masks as textures.
#define _GNU_SOURCE
#include "render/gl_material.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

enum { CURVE_SAMPLES = 4096 };

// POD curves keep their samples, others are sampled finely: the shader knows one kind only.
static GLuint curve_texture(const struct table *t)
{
    const int n = t->basis == TABLE_POD ? t->nw : CURVE_SAMPLES;
    float *px = xcalloc((size_t)n * (size_t)t->count, sizeof *px);
    for (int m = 0; m < t->count; m++)
        for (int k = 0; k < n; k++) {
            const double w = t->w_min + (t->w_max - t->w_min) * k / (n - 1);
            px[(size_t)m * (size_t)n + (size_t)k] = (float)table_weight(t, m, w);
        }
    const GLuint id = gl_texture(GL_TEXTURE_2D, GL_LINEAR);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_R32F, n, t->count, 0, GL_RED, GL_FLOAT, px);
    free(px);
    return id;
}

// A row of slits over u from 0 to 2, some 32 samples to its finest detail.
static GLuint row_texture(const struct slits *s)
{
    const int n = (int)fmax(1024, fmin(16384, 64 / slits_detail(s)));
    float *px = xcalloc((size_t)n * 3, sizeof *px);
#pragma omp parallel for schedule(static)
    for (int k = 0; k < n; k++) {
        double rgb[3];
        slits_row(s, 2.0 * k / (n - 1), rgb);
        for (int c = 0; c < 3; c++)
            px[3 * k + c] = (float)rgb[c];
    }
    const GLuint id = gl_texture(GL_TEXTURE_2D, GL_LINEAR);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB32F, n, 1, 0, GL_RGB, GL_FLOAT, px);
    free(px);
    return id;
}

static GLuint light_texture(const struct slits *s)
{
    float *px = xcalloc((size_t)s->n * 3, sizeof *px);
    for (int k = 0; k < 3 * s->n; k++)
        px[k] = (float)s->weight[k / 3][k % 3];
    const GLuint id = gl_texture(GL_TEXTURE_2D, GL_NEAREST);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB32F, s->n, 1, 0, GL_RGB, GL_FLOAT, px);
    free(px);
    return id;
}

static GLuint mask_texture(const struct image *im)
{
    const size_t n = (size_t)im->w * (size_t)im->h;
    float *px = malloc(n * sizeof *px);
    const GLuint id = gl_texture(GL_TEXTURE_2D, GL_NEAREST);
    for (size_t k = 0; k < n && px; k++)
        px[k] = im->px[k * (size_t)im->nc];
    glTexImage2D(GL_TEXTURE_2D, 0, GL_R32F, im->w, im->h, 0, GL_RED, GL_FLOAT, px);
    free(px);
    return id;
}

bool gl_material_init(struct gl_material *g, const struct material *m, struct err *e)
{
    const struct table *t = &m->table;
    GLint side = 0, layers = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &side);
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &layers);
    if (t->n > side || t->count > layers || m->mask.picture.w > side || m->mask.picture.h > side)
        return err_set(e, ERR_DEVICE,
                       "%d tables of %d nodes or a mask are more than this OpenGL holds (%d of "
                       "%d); use --backend cpu",
                       t->count, t->n, (int)layers, (int)side);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    if (t->n) {
        g->table = gl_texture(GL_TEXTURE_2D_ARRAY, GL_LINEAR);
        glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_RGB32F, t->n, t->n, t->count, 0, GL_RGB, GL_FLOAT,
                     t->tab);
        if (t->basis != TABLE_PLAIN)
            g->curves = curve_texture(t);
    }
    if (m->slits.n)
        g->slit_light = (slits_are_crossed(&m->slits) ? light_texture : row_texture)(&m->slits);
    if (m->mask.picture.px)
        g->mask = mask_texture(&m->mask.picture);
    return glGetError() == GL_NO_ERROR ||
           err_set(e, ERR_DEVICE, "no memory for %d tables of %d nodes; use --backend cpu",
                   t->count, t->n);
}

void gl_material_finish(struct gl_material *g)
{
    glDeleteTextures(1, &g->table);
    glDeleteTextures(1, &g->curves);
    glDeleteTextures(1, &g->slit_light);
    glDeleteTextures(1, &g->mask);
    *g = (struct gl_material){0};
}

static void use_table(const struct gl_material *g, GLuint p, const struct material *m)
{
    const struct table *t = &m->table;
    gl_set1f(p, "range", t->range);
    gl_set1f(p, "power", t->power);
    gl_set1f(p, "nodes", t->n);
    gl_set1f(p, "table_scale", m->table_scale);
    gl_set1i(p, "over_w2", m->over_w2);
    gl_set2f(p, "w_range", t->w_min, t->w_max);
    gl_set1i(p, "tables", material_tables(m));
    gl_bind(p, "table", 0, GL_TEXTURE_2D_ARRAY, g->table);
    gl_bind(p, "curves", 1, GL_TEXTURE_2D, g->curves);
}

static void use_slits(const struct gl_material *g, GLuint p, const struct slits *s)
{
    gl_set2f(p, "slit_pitch", s->row[0].pitch_m, s->row[1].pitch_m);
    gl_set2f(p, "slit_width", s->row[0].width_m, s->row[1].width_m);
    gl_set2f(p, "slit_count", s->row[0].count, s->row[1].count);
    gl_set1f(p, "slit_across", s->across);
    gl_set1i(p, "slit_radial", s->row[0].radial);
    gl_set2f(p, "slit_band", s->lambda_m, s->last_m);
    gl_bind(p, "slit_light", 1, GL_TEXTURE_2D, g->slit_light);
}

void gl_material_use(const struct gl_material *g, GLuint p, const struct material *m,
                     const double light_color[3])
{
    gl_set3f(p, "diffuse", m->diffuse);
    gl_set3f(p, "specular", m->specular);
    gl_set3f(p, "light_color", light_color);
    gl_set1f(p, "roughness", m->roughness);
    gl_set1f(p, "coat_ior", m->coat_ior);
    gl_set1f(p, "r0", m->r0);
    gl_set1f(p, "gain", m->gain);
    gl_set1i(p, "stripes", m->mask.stripes);
    gl_set1f(p, "duty", m->mask.duty);
    gl_set1i(p, "has_mask", g->mask != 0);
    gl_bind(p, "mask", 2, GL_TEXTURE_2D, g->mask);
    if (m->diffraction == DIFFRACTION_TABLE)
        use_table(g, p, m);
    if (m->diffraction == DIFFRACTION_SLITS)
        use_slits(g, p, &m->slits);
    gl_set1f(p, "stam_spacing", m->rainbow.spacing_m * 1e6);
    gl_set1f(p, "stam_roughness", m->rainbow.roughness);
    gl_set3f(p, "stam_highlight", m->rainbow.highlight);
}
