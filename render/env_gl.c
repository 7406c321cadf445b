// env_gl.c - R17's filters as fragment shaders, from map to map.
#define _GNU_SOURCE
#include "render/env_gl.h"
#include "core/mem.h"
#include "render/gl.h"
#include "render/shaders.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct filters {
    GLuint pass, turn, vao;
    GLuint env;                    // the environment, as it came
    int w, h;                      // of the maps
    struct gl_target in, mid, sum; // [h + 2][w]
};

bool env_gl_is_software(void)
{
    static const char *const names[] = {"llvmpipe", "softpipe", "swrast"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        if (strcasestr(gl_name(), names[k]))
            return true;
    return false;
}

static GLuint float_texture(int w, int h, GLenum format, const float *px)
{
    const GLuint t = gl_texture(GL_TEXTURE_2D, GL_NEAREST);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, w, h, 0, format, GL_FLOAT, px);
    return t;
}

static bool map_init(struct gl_target *t, int w, int h, struct err *e)
{
    if (!gl_target_init(t, w, h + 2, e))
        return false;
    glBindTexture(GL_TEXTURE_2D, t->color);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_REPEAT);
    return true;
}

static bool filters_init(struct filters *g, const struct environment *env, int width, struct err *e)
{
    const char *const vertex[] = {shader_screen, NULL};
    const char *const pass[] = {shader_env_map, shader_env_pass, NULL};
    const char *const turn[] = {shader_env_map, shader_env_turn, NULL};
    *g = (struct filters){.w = width, .h = width / 2};
    g->pass = gl_program("env_pass", "", vertex, pass, e);
    g->turn = g->pass ? gl_program("env_turn", "", vertex, turn, e) : 0;
    if (!g->turn || !map_init(&g->in, g->w, g->h, e) || !map_init(&g->mid, g->w, g->h, e) ||
        !map_init(&g->sum, g->w, g->h, e))
        return false;
    GLint most = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
    if (env->map.w > most)
        return err_set(e, ERR_DEVICE, "a map %d wide is more than this OpenGL can hold (%d)",
                       env->map.w, (int)most);
    g->env = float_texture(env->map.w, env->map.h, GL_RGB, env->map.px);
    glGenVertexArrays(1, &g->vao);
    glBindVertexArray(g->vao);
    glDisable(GL_DEPTH_TEST);
    return true;
}

static void filters_finish(struct filters *g)
{
    glUseProgram(0);
    glBindVertexArray(0);
    glDeleteVertexArrays(1, &g->vao);
    glDeleteTextures(1, &g->env);
    glDeleteProgram(g->pass);
    glDeleteProgram(g->turn);
    gl_target_finish(&g->in);
    gl_target_finish(&g->mid);
    gl_target_finish(&g->sum);
}

static void draw(const struct gl_target *to, bool add)
{
    glBindFramebuffer(GL_FRAMEBUFFER, to->frame);
    glViewport(0, 0, to->w, to->h);
    if (add) {
        glEnable(GL_BLEND);
        glBlendFunc(GL_ONE, GL_ONE);
    }
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glDisable(GL_BLEND);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

// `map_from_here`: what takes a direction of `to` to one of the map read.
static void turn_map(const struct filters *g, GLuint map, int map_w, int map_h, int rim,
                     const struct frame *map_from_here, double scale, const struct gl_target *to)
{
    const struct frame *f = map_from_here;
    const float m[9] = {(float)f->t.x, (float)f->t.y, (float)f->t.z, (float)f->b.x, (float)f->b.y,
                        (float)f->b.z, (float)f->n.x, (float)f->n.y, (float)f->n.z};
    glUseProgram(g->turn);
    gl_bind(g->turn, "map", 0, GL_TEXTURE_2D, map);
    gl_set2f(g->turn, "size", g->w, g->h);
    gl_set2f(g->turn, "from_size", map_w, map_h);
    gl_set1i(g->turn, "rim", rim);
    gl_set1f(g->turn, "scale", scale);
    glUniformMatrix3fv(glGetUniformLocation(g->turn, "turn"), 1, GL_FALSE, m);
    draw(to, false);
}

static bool filter(const struct filters *g, const struct factors *f, int which, int rank,
                   const struct frame *frame, const struct separable *how,
                   const struct gl_target *from, bool add, const struct gl_target *to,
                   struct err *e)
{
    struct env_taps t;
    double axis[2];
    GLint most = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
    if (!env_taps(&t, f, which, rank, how->taps, e))
        return false;
    if (t.n > most) {
        env_taps_finish(&t);
        return err_set(e, ERR_DEVICE, "%d taps are more than this OpenGL can hold (%d)", t.n,
                       (int)most);
    }
    float *packed = xcalloc((size_t)t.n + 1, 4 * sizeof *packed);
    for (int k = 0; k < t.n; k++) {
        memcpy(packed + 4 * k, t.rgb + 3 * k, 3 * sizeof *packed);
        packed[4 * k + 3] = t.h[k];
    }
    glActiveTexture(GL_TEXTURE1);
    const GLuint taps = float_texture(t.n + 1, 1, GL_RGBA, packed);
    separable_axis(f, which, frame, how->rotate, axis);
    glUseProgram(g->pass);
    gl_bind(g->pass, "map", 0, GL_TEXTURE_2D, from->color);
    gl_bind(g->pass, "taps", 1, GL_TEXTURE_2D, taps);
    gl_set1i(g->pass, "n", t.n);
    gl_set2f(g->pass, "axis", axis[0], axis[1]);
    gl_set2f(g->pass, "size", g->w, g->h);
    draw(to, add);
    glDeleteTextures(1, &taps);
    free(packed);
    env_taps_finish(&t);
    return true;
}

static bool filter_all(const struct filters *g, const struct factors *f, const struct frame *frame,
                       const struct separable *how, struct err *e)
{
    if (f->kind != FACTOR_COMPOSITION)
        return filter(g, f, 0, 0, frame, how, &g->in, false, &g->sum, e) &&
               (f->kind == FACTOR_LINE || filter(g, f, 1, 0, frame, how, &g->in, true, &g->sum, e));
    bool ok = true;
    for (int r = 0; r < f->rank && ok; r++)
        ok = filter(g, f, 1, r, frame, how, &g->in, false, &g->mid, e) &&
             filter(g, f, 0, r, frame, how, &g->mid, r > 0, &g->sum, e);
    return ok;
}

// The rows between the poles.
static bool read_map(const struct gl_target *t, struct image *out, struct err *e)
{
    if (!image_init(out, t->w, t->h - 2, 3, e))
        return false;
    glBindFramebuffer(GL_FRAMEBUFFER, t->frame);
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    glReadPixels(0, 1, out->w, out->h, GL_RGB, GL_FLOAT, out->px);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    if (glGetError() == GL_NO_ERROR)
        return true;
    image_finish(out);
    return err_set(e, ERR_DEVICE, "OpenGL (%s) failed to filter a map of %d x %d", gl_name(), t->w,
                   t->h - 2);
}

static struct frame transposed(const struct frame *f)
{
    return (struct frame){
        {f->t.x, f->b.x, f->n.x}, {f->t.y, f->b.y, f->n.y}, {f->t.z, f->b.z, f->n.z}};
}

bool env_gl_separable(const struct factors *f, const struct environment *env,
                      const struct frame *frame, const struct separable *how, struct image *out,
                      struct err *e)
{
    static const struct frame world = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const struct frame turn = how->rotate ? separable_turn(frame) : world;
    const struct frame back = transposed(&turn);
    struct filters g;
    bool ok = separable_check(how, e) && filters_init(&g, env, how->width, e);
    if (ok) {
        turn_map(&g, g.env, env->map.w, env->map.h, 0, &turn, 1, &g.in);
        ok = filter_all(&g, f, frame, how, e);
    }
    if (ok) {
        turn_map(&g, g.sum.color, g.w, g.h, 1, &back, 16 * M_PI * M_PI, &g.mid);
        ok = read_map(&g.mid, out, e);
    }
    filters_finish(&g);
    return ok;
}
