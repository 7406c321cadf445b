// gl_render.c - the scene on the GPU: lights, backdrop, and the objects' tiles.
#define _GNU_SOURCE
#include "render/gl_render.h"
#include "core/mem.h"
#include "render/gl_lens.h"
#include "render/gl_object.h"
#include "render/shaders.h"
#include <math.h>
#include <stddef.h>
#include <stdlib.h>

struct gl_renderer {
    GLuint nothing;            // a vertex array without data
    GLuint tiles, rectangle;   // a vertex array of tiles and its buffer
    GLuint lights;             // the buffer of lights
    GLuint far, far_lights;    // the tiles' lists of the environment's lights: buffer and texture
    GLuint surround, backdrop; // the environment's texture, the program of what is behind
    GLuint rest;               // the environment without its spots, in levels
    struct gl_object *object;  // [n], owned
    int n;
};

static GLuint float_texture(const struct image *im)
{
    const GLuint t = gl_texture(GL_TEXTURE_2D, GL_LINEAR);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB32F, im->w, im->h, 0, GL_RGB, GL_FLOAT, im->px);
    return t;
}

static GLuint levels_texture(const struct image *level, int n)
{
    const GLuint t = gl_texture(GL_TEXTURE_2D, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_REPEAT);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, n - 1);
    for (int k = 0; k < n; k++)
        glTexImage2D(GL_TEXTURE_2D, k, GL_RGBA32F, level[k].w, level[k].h, 0, GL_RGB, GL_FLOAT,
                     level[k].px);
    return t;
}

bool gl_renderer_surround(struct gl_renderer *r, const struct scene *s, struct err *e)
{
    glDeleteTextures(1, &r->surround);
    glDeleteTextures(1, &r->rest);
    r->surround = r->rest = 0;
    for (int k = 0; k < r->n; k++) {
        glDeleteTextures(1, &r->object[k].seen);
        r->object[k].seen = s->object[k].seen.px ? float_texture(&s->object[k].seen) : 0;
    }
    if (!s->surround)
        return true;
    r->surround = float_texture(&s->surround->env.map);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_REPEAT);
    r->rest = levels_texture(s->surround->rest, s->surround->n_levels);
    if (!r->backdrop)
        r->backdrop = gl_program("backdrop", "", (const char *const[]){shader_screen, NULL},
                                 (const char *const[]){shader_surround, shader_backdrop, NULL}, e);
    return r->backdrop &&
           (glGetError() == GL_NO_ERROR ||
            err_set(e, ERR_DEVICE, "the environment does not fit this OpenGL; use --backend cpu"));
}

bool gl_renderer_materials(struct gl_renderer *r, const struct scene *s, struct err *e)
{
    for (int k = 0; k < r->n; k++) {
        gl_material_finish(&r->object[k].material);
        if (!gl_material_init(&r->object[k].material, &s->object[k].material, e))
            return false;
    }
    return gl_renderer_surround(r, s, e);
}

bool gl_renderer_open(struct gl_renderer **out, const struct scene *s, struct err *e)
{
    struct gl_renderer *r = xcalloc(1, sizeof *r);
    r->object = xcalloc((size_t)s->n_objects, sizeof *r->object);
    r->n = s->n_objects;
    glGenVertexArrays(1, &r->nothing);
    glGenVertexArrays(1, &r->tiles);
    glBindVertexArray(r->tiles);
    glGenBuffers(1, &r->rectangle);
    glBindBuffer(GL_ARRAY_BUFFER, r->rectangle);
    glEnableVertexAttribArray(0);
    glVertexAttribPointer(0, 4, GL_FLOAT, GL_FALSE, sizeof(struct tile), NULL);
    glVertexAttribDivisor(0, 1);
    glEnableVertexAttribArray(1);
    glVertexAttribIPointer(1, 2, GL_INT, sizeof(struct tile),
                           (const void *)offsetof(struct tile, first));
    glVertexAttribDivisor(1, 1);
    glGenBuffers(1, &r->far);
    glGenTextures(1, &r->far_lights);
    glGenBuffers(1, &r->lights);
    bool ok = true;
    for (int k = 0; k < r->n && ok; k++)
        ok = gl_object_init(&r->object[k], &s->object[k], s, e);
    if (!ok || !gl_renderer_surround(r, s, e)) {
        gl_renderer_close(r);
        return false;
    }
    *out = r;
    return true;
}

static void drop(struct gl_renderer *r)
{
    glDeleteTextures(1, &r->surround);
    glDeleteTextures(1, &r->rest);
    glDeleteProgram(r->backdrop);
    glDeleteVertexArrays(1, &r->nothing);
    glDeleteVertexArrays(1, &r->tiles);
    glDeleteBuffers(1, &r->rectangle);
    glDeleteBuffers(1, &r->far);
    glDeleteTextures(1, &r->far_lights);
    glDeleteBuffers(1, &r->lights);
}

void gl_renderer_close(struct gl_renderer *r)
{
    if (!r)
        return;
    const bool alive = gl_alive(&(struct err){0}); // else all of it is gone already
    for (int k = 0; k < r->n; k++) {
        if (alive)
            gl_object_finish(&r->object[k]);
        tiles_finish(&r->object[k].tiles);
    }
    if (alive)
        drop(r);
    free(r->object);
    free(r);
}

void gl_renderer_skip(struct gl_renderer *r, bool skip)
{
    for (int k = 0; k < r->n; k++)
        r->object[k].tiles.whole = !skip;
}

struct light_block {
    float at[LIGHTS_MOST][4], power[LIGHTS_MOST][4];
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
                       const struct object *o)
{
    const struct shape *shape = &o->shape;
    struct light_block b = {0};
    for (int k = 0; k < s->n_lights; k++) {
        const struct light *l = &s->light[k];
        const struct vec3 at = l->is_far ? l->at : v3_sub(l->at, shape->at_m);
        const double rgb[3] = {l->power * l->tint[0], l->power * l->tint[1], l->power * l->tint[2]};
        put_light(&b, k, frame_local(&shape->frame, at), !l->is_far, rgb);
    }
    int n_far;
    const struct surround_light *far = scene_far_lights(s, o, &n_far);
    for (int k = 0; k < n_far; k++)
        put_light(&b, s->n_lights + k, frame_local(&shape->frame, far[k].to), false,
                  far[k].irradiance);
    gl_set1i(p, "n_lights", s->n_lights);
    glBindBuffer(GL_UNIFORM_BUFFER, r->lights);
    glBufferData(GL_UNIFORM_BUFFER, sizeof b, &b, GL_STREAM_DRAW);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, r->lights);
    glUniformBlockBinding(p, glGetUniformBlockIndex(p, "Lights"), 0);
}

static void draw_backdrop(const struct gl_renderer *r, const struct scene *s,
                          const struct gl_target *t)
{
    static const struct shape world = {.frame = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    glUseProgram(r->backdrop);
    gl_set_camera(r->backdrop, &s->camera, &world, t->w, t->h);
    gl_bind(r->backdrop, "surround", 3, GL_TEXTURE_2D, r->surround);
    glBindVertexArray(r->nothing);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

static void draw_tiles(const struct gl_renderer *r, const struct tile *tile, int n)
{
    glBindVertexArray(r->tiles);
    glBindBuffer(GL_ARRAY_BUFFER, r->rectangle);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)n * sizeof *tile), tile, GL_STREAM_DRAW);
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, n);
}

static void use(const struct gl_renderer *r, const struct gl_object *g, GLuint p,
                const struct object *o, const struct scene *s, const struct gl_target *t)
{
    gl_object_use(g, p, o, s, t->w, t->h);
    set_lights(r, p, s, o);
    gl_bind(p, "surround", 3, GL_TEXTURE_2D, r->surround);
    gl_bind(p, "far_lights", 5, GL_TEXTURE_BUFFER, r->far_lights);
    gl_bind(p, "rest", 6, GL_TEXTURE_2D, r->rest);
}

static void put_far_lists(const struct gl_renderer *r, const struct tiles *t)
{
    glBindBuffer(GL_TEXTURE_BUFFER, r->far);
    glBufferData(GL_TEXTURE_BUFFER, t->n_far, t->far, GL_STREAM_DRAW);
    glActiveTexture(GL_TEXTURE5);
    glBindTexture(GL_TEXTURE_BUFFER, r->far_lights);
    glTexBuffer(GL_TEXTURE_BUFFER, GL_R8UI, r->far);
}

static void draw_object(struct gl_renderer *r, struct gl_object *g, const struct object *o,
                        const struct scene *s, const struct gl_target *t)
{
    const GLuint full = g->program[o->material.diffraction], plain = g->program[DIFFRACTION_NONE];
    tiles_find(&g->tiles, s, o, t->w, t->h);
    if (s->surround) {
        put_far_lists(r, &g->tiles);
        gl_object_lobes(g, o);
    }
    if (o->shape.kind == SHAPE_MESH) {
        use(r, g, full, o, s, t);
        gl_object_draw_mesh(g, &o->shape.mesh);
        return;
    }
    if (g->tiles.n_diffracting) {
        use(r, g, full, o, s, t);
        draw_tiles(r, g->tiles.diffracting, g->tiles.n_diffracting);
    }
    if (g->tiles.n_plain) {
        use(r, g, plain, o, s, t);
        draw_tiles(r, g->tiles.plain, g->tiles.n_plain);
    }
}

bool gl_renderer_draw(struct gl_renderer *r, const struct scene *s, const struct gl_target *t,
                      struct err *e)
{
    if (!gl_alive(e))
        return false;
    for (int k = 0; k < r->n; k++)
        if (!gl_object_programs(&r->object[k], &s->object[k], s, e))
            return false;
    glBindFramebuffer(GL_FRAMEBUFFER, t->frame);
    glViewport(0, 0, t->w, t->h);
    glDisable(GL_SCISSOR_TEST);
    glClearColor((float)s->background[0], (float)s->background[1], (float)s->background[2], 1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    if (s->surround && s->surround->shown)
        draw_backdrop(r, s, t);
    glEnable(GL_DEPTH_TEST);
    for (int k = 0; k < r->n; k++)
        draw_object(r, &r->object[k], &s->object[k], s, t);
    glDisable(GL_DEPTH_TEST);
    const GLenum error = glGetError();
    if (!gl_alive(e))
        return false;
    return error == GL_NO_ERROR || err_set(e, ERR_DEVICE, "OpenGL error %#x while drawing", error);
}

static long pixels_of(const struct tile *t, int n)
{
    double sum = 0;
    for (int k = 0; k < n; k++)
        sum += (double)(t[k].x1 - t[k].x0) * (double)(t[k].y1 - t[k].y0);
    return lround(sum);
}

struct gl_work gl_renderer_work(const struct gl_renderer *r, const struct scene *s,
                                const struct gl_target *t)
{
    struct gl_work work = {.error = NAN};
    const long all = (long)t->w * t->h;
    for (int k = 0; k < r->n; k++) {
        const struct tiles *tiles = &r->object[k].tiles;
        const struct material *m = &s->object[k].material;
        const bool mesh = s->object[k].shape.kind == SHAPE_MESH;
        const bool diffracts = m->diffraction != DIFFRACTION_NONE;
        const long full =
            mesh ? all * diffracts : pixels_of(tiles->diffracting, tiles->n_diffracting);
        work.shaded += mesh ? all : full + pixels_of(tiles->plain, tiles->n_plain);
        work.looked_up += full;
        work.shaded_most += all;
        work.looked_up_most += all * diffracts;
        if (m->diffraction == DIFFRACTION_TABLE) {
            work.tables += m->table.count;
            work.tables_used += material_tables(m);
        }
    }
    return work;
}

bool gl_render(const struct scene *s, struct image *out, struct gl_work *work, struct err *e)
{
    struct gl_context *c = NULL;
    struct gl_renderer *r = NULL;
    struct gl_target t = {0}, blurred = {0};
    struct gl_lens lens = {0};
    if (!gl_context_open(&c, e))
        return false;
    bool ok = gl_target_init(&t, s->w, s->h, e) && gl_renderer_open(&r, s, e) &&
              gl_renderer_draw(r, s, &t, e);
    if (ok && s->camera.aperture_m > 0) {
        ok = gl_lens_init(&lens, e) && gl_target_init(&blurred, s->w, s->h, e);
        if (ok)
            gl_lens_draw(&lens, s, &t, &blurred);
    }
    ok = ok && gl_target_read(blurred.frame ? &blurred : &t, out, e);
    if (ok && work)
        *work = gl_renderer_work(r, s, &t);
    gl_renderer_close(r);
    gl_lens_finish(&lens);
    gl_target_finish(&t);
    gl_target_finish(&blurred);
    gl_context_close(c);
    return ok;
}
