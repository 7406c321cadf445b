// gl_render.c - the scene on the GPU: per object a program, its textures, its rectangle.
#define _GNU_SOURCE
#include "render/gl_render.h"
#include "core/mem.h"
#include "render/gl_material.h"
#include "render/shaders.h"
#include <stdio.h>
#include <stdlib.h>

enum { KINDS = 4, MAX_LIGHTS = SCENE_MAX_LIGHTS + SURROUND_LIGHTS }; // KINDS of diffraction

struct gl_object {
    GLuint program[KINDS]; // 0: not needed so far
    struct gl_material material;
    GLuint vertices, buffer, index; // of a mesh
    GLuint seen;
};

struct gl_renderer {
    GLuint vertices, lights;   // an empty vertex array; the buffer of lights
    GLuint surround, backdrop; // the environment's texture, the program of what is behind
    struct gl_object *object;
    int n;
};

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

// The program for the way an object diffracts now; made when it is first needed.
static GLuint program_of(struct gl_object *o, const struct object *from, struct err *e)
{
    const struct material *m = &from->material;
    GLuint *p = &o->program[m->diffraction];
    if (*p)
        return *p;
    char defines[200];
    snprintf(defines, sizeof defines,
             "#define SHAPE %d\n#define DIFFRACTION %d\n#define CURVES %d\n#define MAX_LIGHTS %d\n",
             (int)from->shape.kind, (int)m->diffraction, m->table.basis != TABLE_PLAIN, MAX_LIGHTS);
    const bool mesh = from->shape.kind == SHAPE_MESH;
    const char *const vertex[] = {mesh ? shader_mesh : shader_screen, NULL};
    const char *const fragment[] = {shader_shapes,   shader_lights,  shader_layers,
                                    shader_surround, shader_surface, NULL};
    return *p = gl_program(from->name, defines, vertex, fragment, e);
}

static GLuint float_texture(const struct image *im)
{
    const GLuint t = gl_texture(GL_TEXTURE_2D, GL_LINEAR);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB32F, im->w, im->h, 0, GL_RGB, GL_FLOAT, im->px);
    return t;
}

bool gl_renderer_surround(struct gl_renderer *r, const struct scene *s, struct err *e)
{
    glDeleteTextures(1, &r->surround);
    r->surround = 0;
    for (int k = 0; k < r->n; k++) {
        glDeleteTextures(1, &r->object[k].seen);
        r->object[k].seen = s->object[k].seen.px ? float_texture(&s->object[k].seen) : 0;
    }
    if (!s->surround)
        return true;
    r->surround = float_texture(&s->surround->env.map);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_REPEAT);
    if (!r->backdrop)
        r->backdrop = gl_program("backdrop", "", (const char *const[]){shader_screen, NULL},
                                 (const char *const[]){shader_surround, shader_backdrop, NULL}, e);
    return r->backdrop &&
           (glGetError() == GL_NO_ERROR ||
            err_set(e, ERR_DEVICE, "the environment does not fit this OpenGL; use --backend cpu"));
}

bool gl_renderer_open(struct gl_renderer **out, const struct scene *s, struct err *e)
{
    struct gl_renderer *r = xcalloc(1, sizeof *r);
    r->object = xcalloc((size_t)s->n_objects, sizeof *r->object);
    r->n = s->n_objects;
    glGenVertexArrays(1, &r->vertices);
    glGenBuffers(1, &r->lights);
    for (int k = 0; k < r->n; k++) {
        if (!program_of(&r->object[k], &s->object[k], e) ||
            !gl_material_init(&r->object[k].material, &s->object[k].material, e)) {
            gl_renderer_close(r);
            return false;
        }
        if (s->object[k].shape.kind == SHAPE_MESH)
            upload_mesh(&r->object[k], &s->object[k].shape.mesh);
    }
    if (!gl_renderer_surround(r, s, e)) {
        gl_renderer_close(r);
        return false;
    }
    *out = r;
    return true;
}

void gl_renderer_close(struct gl_renderer *r)
{
    if (!r)
        return;
    for (int k = 0; k < r->n; k++) {
        struct gl_object *o = &r->object[k];
        for (int p = 0; p < KINDS; p++)
            glDeleteProgram(o->program[p]);
        gl_material_finish(&o->material);
        glDeleteVertexArrays(1, &o->vertices);
        glDeleteBuffers(1, &o->buffer);
        glDeleteBuffers(1, &o->index);
        glDeleteTextures(1, &o->seen);
    }
    glDeleteTextures(1, &r->surround);
    glDeleteProgram(r->backdrop);
    glDeleteVertexArrays(1, &r->vertices);
    glDeleteBuffers(1, &r->lights);
    free(r->object);
    free(r);
}

static void set_local(GLuint p, const char *name, const struct frame *f, struct vec3 v)
{
    const struct vec3 a = frame_local(f, v);
    gl_set3f(p, name, (const double[]){a.x, a.y, a.z});
}

static void set_camera(GLuint p, const struct camera *c, const struct shape *s, int w, int h)
{
    struct vec3 axes[3];
    camera_axes(c, w, h, axes);
    set_local(p, "right", &s->frame, axes[0]);
    set_local(p, "up", &s->frame, axes[1]);
    set_local(p, "forward", &s->frame, axes[2]);
    set_local(p, "eye", &s->frame, v3_sub(c->eye_m, s->at_m));
    gl_set2f(p, "size", w, h);
}

static void set_shape(GLuint p, const struct shape *s)
{
    gl_set2f(p, "half_size", s->width_m / 2, s->height_m / 2);
    gl_set1f(p, "radius", s->radius_m);
    gl_set1f(p, "inner", s->inner_m);
    gl_set1f(p, "half_span", s->span_rad / 2);
    gl_set1i(p, "fixed_tangent", s->fixed_tangent);
}

struct light_block {
    float at[MAX_LIGHTS][4], power[MAX_LIGHTS][4];
};

static void put_light(struct light_block *b, int k, struct vec3 at, bool near, const double rgb[3])
{
    const double to[4] = {at.x, at.y, at.z, near};
    for (int c = 0; c < 4; c++)
        b->at[k][c] = (float)to[c];
    for (int c = 0; c < 3; c++)
        b->power[k][c] = (float)rgb[c];
}

// Lights in the shape's coordinates: floats are precise near the surface that they are used for.
static void set_lights(const struct gl_renderer *r, GLuint p, const struct scene *s,
                       const struct shape *shape)
{
    struct light_block b = {0};
    for (int k = 0; k < s->n_lights; k++) {
        const struct light *l = &s->light[k];
        const struct vec3 at = l->is_far ? l->at : v3_sub(l->at, shape->at_m);
        const double rgb[3] = {l->power * l->tint[0], l->power * l->tint[1], l->power * l->tint[2]};
        put_light(&b, k, frame_local(&shape->frame, at), !l->is_far, rgb);
    }
    const struct surround *around = s->surround;
    for (int k = 0; around && k < around->n_lights; k++)
        put_light(&b, s->n_lights + k, frame_local(&shape->frame, around->light[k].to), false,
                  around->light[k].irradiance);
    gl_set1i(p, "n_lights", s->n_lights);
    gl_set1i(p, "n_surround", around ? around->n_lights : -1);
    glBindBuffer(GL_UNIFORM_BUFFER, r->lights);
    glBufferData(GL_UNIFORM_BUFFER, sizeof b, &b, GL_STREAM_DRAW);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, r->lights);
    glUniformBlockBinding(p, glGetUniformBlockIndex(p, "Lights"), 0);
}

static void set_surround(const struct gl_renderer *r, const struct gl_object *g, GLuint p,
                         const struct scene *s, const struct object *o)
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
    gl_set1i(p, "has_seen", g->seen != 0);
    gl_bind(p, "surround", 3, GL_TEXTURE_2D, r->surround);
    gl_bind(p, "seen", 4, GL_TEXTURE_2D, g->seen);
}

static void draw_backdrop(const struct gl_renderer *r, const struct scene *s,
                          const struct gl_target *t)
{
    static const struct shape world = {.frame = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    glUseProgram(r->backdrop);
    set_camera(r->backdrop, &s->camera, &world, t->w, t->h);
    gl_bind(r->backdrop, "surround", 3, GL_TEXTURE_2D, r->surround);
    glBindVertexArray(r->vertices);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

static void cut_to_shape(const struct camera *c, const struct shape *s, int w, int h)
{
    int box[4];
    shape_pixels(c, s, w, h, box);
    glScissor(box[0], box[1], box[2] - box[0], box[3] - box[1]);
}

static void draw_object(struct gl_renderer *r, struct gl_object *g, const struct object *o,
                        const struct scene *s, const struct gl_target *t)
{
    const GLuint p = g->program[o->material.diffraction];
    glUseProgram(p);
    set_camera(p, &s->camera, &o->shape, t->w, t->h);
    set_shape(p, &o->shape);
    set_lights(r, p, s, &o->shape);
    set_surround(r, g, p, s, o);
    gl_material_use(&g->material, p, &o->material, s->light_color);
    cut_to_shape(&s->camera, &o->shape, t->w, t->h);
    if (o->shape.kind == SHAPE_MESH) {
        glEnable(GL_CULL_FACE);
        glFrontFace(GL_CW); // the target is upside down
        glBindVertexArray(g->vertices);
        glDrawElements(GL_TRIANGLES, 3 * o->shape.mesh.n_triangles, GL_UNSIGNED_INT, NULL);
        glDisable(GL_CULL_FACE);
        glFrontFace(GL_CCW);
    } else {
        glBindVertexArray(r->vertices);
        glDrawArrays(GL_TRIANGLES, 0, 3);
    }
}

bool gl_renderer_draw(struct gl_renderer *r, const struct scene *s, const struct gl_target *t,
                      struct err *e)
{
    for (int k = 0; k < r->n; k++)
        if (!program_of(&r->object[k], &s->object[k], e))
            return false;
    glBindFramebuffer(GL_FRAMEBUFFER, t->frame);
    glViewport(0, 0, t->w, t->h);
    glDisable(GL_SCISSOR_TEST);
    glClearColor((float)s->background[0], (float)s->background[1], (float)s->background[2], 1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    if (s->surround && s->surround->shown)
        draw_backdrop(r, s, t);
    glEnable(GL_SCISSOR_TEST);
    glEnable(GL_DEPTH_TEST);
    for (int k = 0; k < r->n; k++)
        draw_object(r, &r->object[k], &s->object[k], s, t);
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_DEPTH_TEST);
    const GLenum error = glGetError();
    return error == GL_NO_ERROR || err_set(e, ERR_DEVICE, "OpenGL error %#x while drawing", error);
}

bool gl_render(const struct scene *s, struct image *out, struct err *e)
{
    struct gl_context *c = NULL;
    struct gl_renderer *r = NULL;
    struct gl_target t = {0};
    if (!gl_context_open(&c, e))
        return false;
    const bool ok = gl_target_init(&t, s->w, s->h, e) && gl_renderer_open(&r, s, e) &&
                    gl_renderer_draw(r, s, &t, e) && gl_target_read(&t, out, e);
    gl_renderer_close(r);
    gl_target_finish(&t);
    gl_context_close(c);
    return ok;
}
