// gl_progress.c - passes drawn one by one into their mean.
#define _GNU_SOURCE
#include "render/gl_progress.h"
#include "core/log.h"
#include "render/shaders.h"
#include <math.h>

bool gl_progress_init(struct gl_progress *p, const struct scene *s, int side, int w, int h,
                      struct err *e)
{
    *p = (struct gl_progress){0};
    if (!sampling_init(&p->sampling, s, side, e))
        return false;
    p->sampling.pass.w = w;
    p->sampling.pass.h = h;
    const char *const vertex[] = {shader_screen, NULL}, *const fragment[] = {shader_mean, NULL};
    p->program = gl_program("mean", "", vertex, fragment, e);
    if (!p->program || !gl_target_init(&p->one, w, h, e) || !gl_target_init(&p->mean, w, h, e)) {
        gl_progress_finish(p);
        return false;
    }
    glGenVertexArrays(1, &p->nothing);
    return true;
}

// mean += (one - mean) / (done + 1), by the blending unit.
static void add(struct gl_progress *p)
{
    glBindFramebuffer(GL_FRAMEBUFFER, p->mean.frame);
    glViewport(0, 0, p->mean.w, p->mean.h);
    if (p->done) // the target holds nothing yet
        glEnable(GL_BLEND);
    glBlendColor(0, 0, 0, 1 / (float)(p->done + 1));
    glBlendFunc(GL_CONSTANT_ALPHA, GL_ONE_MINUS_CONSTANT_ALPHA);
    glUseProgram(p->program);
    gl_bind(p->program, "picture", 0, GL_TEXTURE_2D, p->one.color);
    glBindVertexArray(p->nothing);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glDisable(GL_BLEND);
}

bool gl_progress_step(struct gl_progress *p, struct gl_renderer *r, struct err *e)
{
    if (p->done == p->sampling.side * p->sampling.side)
        return true;
    if (!sampling_pass(&p->sampling, p->done, e) ||
        !gl_renderer_draw(r, &p->sampling.pass, &p->one, e))
        return false;
    add(p);
    p->done++;
    return true;
}

void gl_progress_finish(struct gl_progress *p)
{
    sampling_finish(&p->sampling);
    gl_target_finish(&p->one);
    gl_target_finish(&p->mean);
    if (gl_alive(&(struct err){0})) {
        glDeleteProgram(p->program);
        glDeleteVertexArrays(1, &p->nothing);
    }
    *p = (struct gl_progress){0};
}

static double difference(const struct image *a, const struct image *b)
{
    double sum = 0, all = 0;
    for (size_t k = 0; k < (size_t)a->w * (size_t)a->h * 3; k++) {
        const double d = (double)a->px[k] - (double)b->px[k];
        sum += d * d;
        all += (double)b->px[k] * (double)b->px[k];
    }
    return all > 0 ? sqrt(sum / all) : 0;
}

bool gl_render_passes(const struct scene *s, int side, struct image *out, struct gl_work *work,
                      struct err *e)
{
    struct gl_context *c = NULL;
    struct gl_renderer *r = NULL;
    struct gl_progress p = {0};
    struct image half = {0};
    const int n = side * side;
    if (!gl_context_open(&c, e))
        return false;
    bool ok = gl_renderer_open(&r, s, e) && gl_progress_init(&p, s, side, s->w, s->h, e);
    struct progress bar;
    progress_start(&bar, "passes", n);
    while (ok && p.done < n) {
        ok = gl_progress_step(&p, r, e);
        if (ok && n > 1 && p.done == n / 2)
            ok = gl_target_read(&p.mean, &half, e);
        progress_step(&bar, 1);
    }
    progress_end(&bar);
    ok = ok && gl_target_read(&p.mean, out, e);
    if (ok && work) {
        *work = gl_renderer_work(r, &p.sampling.pass, &p.mean);
        work->error = half.px ? difference(&half, out) : NAN;
    }
    image_finish(&half);
    gl_progress_finish(&p);
    gl_renderer_close(r);
    gl_context_close(c);
    return ok;
}
