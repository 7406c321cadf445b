// gl_object.c - one object on the GPU: programs, mesh, textures, and the uniforms of its place.
#define _GNU_SOURCE
#include "render/gl_object.h"
#include "core/mem.h"
#include "render/shaders.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void upload_mesh(struct gl_object *o, const struct mesh *m)
{
    enum { FLOATS = 11 };
    float *v = xcalloc((size_t)m->n_vertices, FLOATS * sizeof *v);
    for (int k = 0; k < m->n_vertices; k++) {
        const struct mesh_vertex *f = &m->vertex[k];
        const double from[FLOATS] = {f->at_m.x, f->at_m.y, f->at_m.z, f->n.x, f->n.y, f->n.z,
                                     f->t.x,    f->t.y,    f->t.z,    f->s,   f->v};
        for (int c = 0; c < FLOATS; c++)
            v[(size_t)k * FLOATS + (size_t)c] = (float)from[c];
    }
    glGenVertexArrays(1, &o->vertices);
    glBindVertexArray(o->vertices);
    glGenBuffers(1, &o->buffer);
    glBindBuffer(GL_ARRAY_BUFFER, o->buffer);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)m->n_vertices * FLOATS * sizeof *v), v,
                 GL_STATIC_DRAW);
    free(v);
    glGenBuffers(1, &o->index);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, o->index);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER,
                 (GLsizeiptr)((size_t)m->n_triangles * sizeof *m->triangle), m->triangle,
                 GL_STATIC_DRAW);
    for (GLuint k = 0; k < 4; k++) {
        glEnableVertexAttribArray(k);
        glVertexAttribPointer(k, k < 3 ? 3 : 2, GL_FLOAT, GL_FALSE, FLOATS * sizeof *v,
                              (const void *)(k * 3 * sizeof *v));
    }
    glBindVertexArray(0);
}

static struct gl_features features_of(const struct object *o, const struct scene *s)
{
    const struct material *m = &o->material;
    return (struct gl_features){
        .glossy = material_has_specular(m),
        .coat = m->coat_ior > 1,
        .linear = m->table.power == 1,
        .masked = m->mask.stripes > 0 || m->mask.picture.px,
        .surround = s->surround,
        .seen = object_shows_map(o),
        .lobes = s->surround && object_has_lobes(o),
        .far = s->surround && object_uses_far_lights(o),
        .curves = m->table.basis != TABLE_PLAIN,
        .crossed = slits_are_crossed(&m->slits),
    };
}

// The program for a way to diffract; made when it is first needed.
static GLuint program_of(struct gl_object *g, const struct object *o, enum diffraction kind,
                         struct err *e)
{
    GLuint *p = &g->program[kind];
    if (*p)
        return *p;
    const struct gl_features f = g->features;
    char defines[400];
    snprintf(defines, sizeof defines,
             "#define SHAPE %d\n#define DIFFRACTION %d\n#define MAX_LIGHTS %d\n#define GLOSSY %d\n"
             "#define COAT %d\n#define LINEAR %d\n#define MASKED %d\n#define SURROUND %d\n"
             "#define SEEN %d\n#define FAR %d\n#define CURVES %d\n#define CROSSED %d\n"
             "#define LOBES %d\n",
             (int)o->shape.kind, (int)kind, LIGHTS_MOST, f.glossy, f.coat, f.linear, f.masked,
             f.surround, f.seen, f.far, f.curves, f.crossed, f.lobes);
    const bool mesh = o->shape.kind == SHAPE_MESH;
    const char *const vertex[] = {mesh ? shader_mesh : shader_tile, NULL};
    const char *const fragment[] = {shader_shapes,   shader_lights, shader_layers,
                                    shader_surround, shader_lobes,  shader_surrounded,
                                    shader_surface,  NULL};
    return *p = gl_program(o->name, defines, vertex, fragment, e);
}

static void drop_programs(struct gl_object *g)
{
    for (int k = 0; k < DIFFRACTION_KINDS; k++) {
        glDeleteProgram(g->program[k]);
        g->program[k] = 0;
    }
}

bool gl_object_programs(struct gl_object *g, const struct object *o, const struct scene *s,
                        struct err *e)
{
    const struct gl_features f = features_of(o, s);
    if (memcmp(&f, &g->features, sizeof f))
        drop_programs(g);
    g->features = f;
    return program_of(g, o, DIFFRACTION_NONE, e) && program_of(g, o, o->material.diffraction, e);
}

bool gl_object_init(struct gl_object *o, const struct object *from, const struct scene *s,
                    struct err *e)
{
    if (!gl_object_programs(o, from, s, e) || !gl_material_init(&o->material, &from->material, e))
        return false;
    if (from->shape.kind == SHAPE_MESH)
        upload_mesh(o, &from->shape.mesh);
    return true;
}

void gl_object_finish(struct gl_object *o)
{
    drop_programs(o);
    gl_material_finish(&o->material);
    glDeleteVertexArrays(1, &o->vertices);
    glDeleteBuffers(1, &o->buffer);
    glDeleteBuffers(1, &o->index);
    glDeleteTextures(1, &o->seen);
    glDeleteTextures(1, &o->lobes);
    tiles_finish(&o->tiles);
}

static void set_local(GLuint p, const char *name, const struct frame *f, struct vec3 v)
{
    const struct vec3 a = frame_local(f, v);
    gl_set3f(p, name, (const double[]){a.x, a.y, a.z});
}

void gl_set_camera(GLuint p, const struct camera *c, const struct shape *s, int w, int h)
{
    struct vec3 axes[3];
    camera_axes(c, w, h, axes);
    set_local(p, "right", &s->frame, axes[0]);
    set_local(p, "up", &s->frame, axes[1]);
    set_local(p, "forward", &s->frame, axes[2]);
    set_local(p, "eye", &s->frame, v3_sub(c->eye_m, s->at_m));
    gl_set2f(p, "size", w, h);
    gl_set2f(p, "shift", c->shift[0], c->shift[1]);
}

static void set_shape(GLuint p, const struct shape *s)
{
    gl_set2f(p, "half_size", s->width_m / 2, s->height_m / 2);
    gl_set1f(p, "radius", s->radius_m);
    gl_set1f(p, "inner", s->inner_m);
    gl_set1f(p, "half_span", s->span_rad / 2);
    gl_set1i(p, "fixed_tangent", s->fixed_tangent);
}

static void set_surround(const struct gl_object *g, GLuint p, const struct scene *s,
                         const struct object *o)
{
    const struct frame *f = &o->shape.frame;
    const float world[9] = {(float)f->t.x, (float)f->t.y, (float)f->t.z,
                            (float)f->b.x, (float)f->b.y, (float)f->b.z,
                            (float)f->n.x, (float)f->n.y, (float)f->n.z};
    float harmonic[SURROUND_TERMS][3] = {0};
    for (int k = 0; k < 3 * SURROUND_TERMS && s->surround; k++)
        harmonic[k / 3][k % 3] = (float)s->surround->irradiance[k / 3][k % 3];
    glUniformMatrix3fv(glGetUniformLocation(p, "world"), 1, GL_FALSE, world);
    glUniform3fv(glGetUniformLocation(p, "harmonic"), SURROUND_TERMS, harmonic[0]);
    gl_set1f(p, "through_diffuse", coat_through_diffuse(o->material.coat_ior));
    int n_far;
    scene_far_lights(s, o, &n_far);
    gl_set1i(p, "n_far", n_far);
    gl_bind(p, "seen", 4, GL_TEXTURE_2D, g->seen);
    gl_bind(p, "cells", 7, GL_TEXTURE_2D, g->lobes);
    if (!s->surround)
        return;
    gl_set1f(p, "rest_height", s->surround->rest[0].h);
    gl_set1i(p, "n_levels", s->surround->n_levels);
    gl_set1i(p, "by_lights_alone", object_by_lights_alone(o));
    gl_set1i(p, "which_pass", s->pass);
    gl_set1i(p, "passes", s->passes > 1 ? s->passes : 1);
}

void gl_object_lobes(struct gl_object *g, const struct object *o)
{
    const struct lobes *l = &o->lobes[o->material.diffraction];
    if (!object_has_lobes(o))
        return;
    if (!g->lobes)
        g->lobes = gl_texture(GL_TEXTURE_2D, GL_NEAREST);
    glActiveTexture(GL_TEXTURE7);
    glBindTexture(GL_TEXTURE_2D, g->lobes);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB32F, 1 + l->count, l->n, 0, GL_RGB, GL_FLOAT, l->cell);
}

void gl_object_use(const struct gl_object *g, GLuint p, const struct object *o,
                   const struct scene *s, int w, int h)
{
    glUseProgram(p);
    gl_set_camera(p, &s->camera, &o->shape, w, h);
    set_shape(p, &o->shape);
    set_surround(g, p, s, o);
    gl_material_use(&g->material, p, &o->material, s->light_color);
}

void gl_object_draw_mesh(const struct gl_object *g, const struct mesh *m)
{
    glEnable(GL_CULL_FACE);
    glFrontFace(GL_CW); // the target is upside down
    glBindVertexArray(g->vertices);
    glDrawElements(GL_TRIANGLES, 3 * m->n_triangles, GL_UNSIGNED_INT, NULL);
    glDisable(GL_CULL_FACE);
    glFrontFace(GL_CCW);
}
