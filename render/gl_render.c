// gl_render.c - one program and two textures per object, one triangle cut to its rectangle.
#define _GNU_SOURCE
#include "render/gl_render.h"
#include "core/mem.h"
#include "render/shaders.h"
#include <stdio.h>
#include <stdlib.h>

enum { CURVE_SAMPLES = 4096 };

struct gl_object {
    GLuint program, table, curves;
};

struct gl_renderer {
    GLuint vertices, lights; // an empty vertex array; the buffer of lights
    struct gl_object *object;
    int n;
};

static GLuint texture(GLenum target)
{
    GLuint t;
    glGenTextures(1, &t);
    glBindTexture(target, t);
    glTexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(target, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(target, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    return t;
}

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
    const GLuint id = texture(GL_TEXTURE_2D);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_R32F, n, t->count, 0, GL_RED, GL_FLOAT, px);
    free(px);
    return id;
}

static bool upload_table(struct gl_object *o, const struct table *t, struct err *e)
{
    GLint side = 0, layers = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &side);
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &layers);
    if (t->n > side || t->count > layers)
        return err_set(e, ERR_DEVICE,
                       "%d tables of %d nodes are more than this OpenGL holds (%d "
                       "of %d); use --backend cpu",
                       t->count, t->n, (int)layers, (int)side);
    o->table = texture(GL_TEXTURE_2D_ARRAY);
    glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_RGB32F, t->n, t->n, t->count, 0, GL_RGB, GL_FLOAT,
                 t->tab);
    if (t->basis != TABLE_PLAIN)
        o->curves = curve_texture(t);
    return glGetError() == GL_NO_ERROR ||
           err_set(e, ERR_DEVICE, "no memory for %d tables of %d nodes; use --backend cpu",
                   t->count, t->n);
}

static int tables_used(const struct material *m)
{
    const int n = m->table.n ? m->table.count : 0;
    return m->tables_used > 0 && m->tables_used < n ? m->tables_used : n;
}

static bool open_object(struct gl_object *o, const struct object *from, struct err *e)
{
    const struct material *m = &from->material;
    char defines[200];
    snprintf(defines, sizeof defines,
             "#define SHAPE %d\n#define TABLES %d\n#define CURVES %d\n#define MAX_LIGHTS %d\n",
             (int)from->shape.kind, tables_used(m), m->table.basis != TABLE_PLAIN,
             SCENE_MAX_LIGHTS);
    o->program =
        gl_program(from->name, defines, (const char *const[]){shader_screen, NULL},
                   (const char *const[]){shader_shapes, shader_layers, shader_surface, NULL}, e);
    return o->program && (!m->table.n || upload_table(o, &m->table, e));
}

bool gl_renderer_open(struct gl_renderer **out, const struct scene *s, struct err *e)
{
    struct gl_renderer *r = xcalloc(1, sizeof *r);
    r->object = xcalloc((size_t)s->n_objects, sizeof *r->object);
    glGenVertexArrays(1, &r->vertices);
    glGenBuffers(1, &r->lights);
    for (; r->n < s->n_objects; r->n++)
        if (!open_object(&r->object[r->n], &s->object[r->n], e)) {
            r->n++;
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
        glDeleteProgram(r->object[k].program);
        glDeleteTextures(1, &r->object[k].table);
        glDeleteTextures(1, &r->object[k].curves);
    }
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

static void set_material(GLuint p, const struct material *m, const double light_color[3])
{
    gl_set3f(p, "diffuse", m->diffuse);
    gl_set3f(p, "specular", m->specular);
    gl_set3f(p, "light_color", light_color);
    gl_set1f(p, "roughness", m->roughness);
    gl_set1f(p, "coat_ior", m->coat_ior);
    gl_set1f(p, "r0", m->r0);
    gl_set1f(p, "gain", m->gain);
    gl_set1i(p, "over_w2", m->over_w2);
    gl_set1f(p, "range", m->table.range);
    gl_set1f(p, "power", m->table.power);
    gl_set1f(p, "nodes", m->table.n);
    gl_set2f(p, "w_range", m->table.w_min, m->table.w_max);
    gl_set1i(p, "table", 0);
    gl_set1i(p, "curves", 1);
}

// Lights in the shape's coordinates: floats are precise near the surface that they are used for.
static void set_lights(const struct gl_renderer *r, GLuint p, const struct scene *s,
                       const struct shape *shape)
{
    float at[SCENE_MAX_LIGHTS][4];
    for (int k = 0; k < s->n_lights; k++) {
        const struct light *l = &s->light[k];
        const struct vec3 v =
            frame_local(&shape->frame, l->is_far ? l->at : v3_sub(l->at, shape->at_m));
        at[k][0] = (float)v.x;
        at[k][1] = (float)v.y;
        at[k][2] = (float)v.z;
        at[k][3] = (float)(l->is_far ? -l->power : l->power);
    }
    gl_set1i(p, "n_lights", s->n_lights);
    glBindBuffer(GL_UNIFORM_BUFFER, r->lights);
    glBufferData(GL_UNIFORM_BUFFER, sizeof at, at, GL_STREAM_DRAW);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, r->lights);
    glUniformBlockBinding(p, glGetUniformBlockIndex(p, "Lights"), 0);
}

// The pixels that a shape can cover: the rectangle around the corners of its box. Nothing outside
// is shaded. All of the picture when the box reaches behind the eye.
static void cut_to_shape(const struct camera *c, const struct shape *s, int w, int h)
{
    struct vec3 a[3], lo, hi;
    camera_axes(c, w, h, a);
    shape_bounds(s, &lo, &hi);
    double x0 = w, x1 = 0, y0 = h, y1 = 0;
    for (int k = 0; k < 8; k++) {
        const struct vec3 corner =
            v3(k & 1 ? lo.x : hi.x, k & 2 ? lo.y : hi.y, k & 4 ? lo.z : hi.z);
        const struct vec3 p = v3_sub(v3_add(s->at_m, frame_world(&s->frame, corner)), c->eye_m);
        const double z = v3_dot(p, a[2]);
        if (z <= 0) {
            glScissor(0, 0, w, h);
            return;
        }
        const double x = (v3_dot(p, a[0]) / v3_dot(a[0], a[0]) / z + 1) / 2 * w;
        const double y = (1 - v3_dot(p, a[1]) / v3_dot(a[1], a[1]) / z) / 2 * h;
        x0 = fmin(x0, x);
        x1 = fmax(x1, x);
        y0 = fmin(y0, y);
        y1 = fmax(y1, y);
    }
    const int left = (int)fmax(0, floor(x0)), right = (int)fmin(w, ceil(x1));
    const int top = (int)fmax(0, floor(y0)), bottom = (int)fmin(h, ceil(y1));
    glScissor(left, top, right > left ? right - left : 0, bottom > top ? bottom - top : 0);
}

void gl_renderer_draw(struct gl_renderer *r, const struct scene *s, const struct gl_target *t)
{
    glBindFramebuffer(GL_FRAMEBUFFER, t->frame);
    glViewport(0, 0, t->w, t->h);
    glDisable(GL_SCISSOR_TEST);
    glClearColor((float)s->background[0], (float)s->background[1], (float)s->background[2], 1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glEnable(GL_SCISSOR_TEST);
    glEnable(GL_DEPTH_TEST);
    glBindVertexArray(r->vertices);
    for (int k = 0; k < r->n; k++) {
        const struct object *o = &s->object[k];
        const GLuint p = r->object[k].program;
        glUseProgram(p);
        set_camera(p, &s->camera, &o->shape, t->w, t->h);
        set_shape(p, &o->shape);
        set_material(p, &o->material, s->light_color);
        set_lights(r, p, s, &o->shape);
        glActiveTexture(GL_TEXTURE1);
        glBindTexture(GL_TEXTURE_2D, r->object[k].curves);
        glActiveTexture(GL_TEXTURE0);
        glBindTexture(GL_TEXTURE_2D_ARRAY, r->object[k].table);
        cut_to_shape(&s->camera, &o->shape, t->w, t->h);
        glDrawArrays(GL_TRIANGLES, 0, 3);
    }
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_DEPTH_TEST);
}

bool gl_render(const struct scene *s, struct image *out, struct err *e)
{
    struct gl_context *c = NULL;
    struct gl_renderer *r = NULL;
    struct gl_target t = {0};
    if (!gl_context_open(&c, e))
        return false;
    bool ok = gl_target_init(&t, s->w, s->h, e) && gl_renderer_open(&r, s, e) &&
              image_init(out, s->w, s->h, 3, e);
    if (ok) {
        gl_renderer_draw(r, s, &t);
        glBindFramebuffer(GL_FRAMEBUFFER, t.frame);
        glPixelStorei(GL_PACK_ALIGNMENT, 1);
        glReadPixels(0, 0, s->w, s->h, GL_RGB, GL_FLOAT, out->px);
        if (glGetError() != GL_NO_ERROR) {
            image_finish(out);
            ok = err_set(e, ERR_DEVICE, "OpenGL lost the picture; use --backend cpu");
        }
    }
    gl_renderer_close(r);
    if (t.frame)
        gl_target_finish(&t);
    gl_context_close(c);
    return ok;
}
