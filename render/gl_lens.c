// gl_lens.c - circles of confusion.
#define _GNU_SOURCE
#include "render/gl_lens.h"
#include "render/shaders.h"

enum { TAPS = 160 };

bool gl_lens_init(struct gl_lens *l, struct err *e)
{
    const char *const vertex[] = {shader_screen, NULL}, *const fragment[] = {shader_lens, NULL};
    *l = (struct gl_lens){.program = gl_program("lens", "", vertex, fragment, e)};
    if (l->program)
        glGenVertexArrays(1, &l->nothing);
    return l->program != 0;
}

void gl_lens_finish(struct gl_lens *l)
{
    if (!l->program || !gl_alive(&(struct err){0}))
        return;
    glDeleteProgram(l->program);
    glDeleteVertexArrays(1, &l->nothing);
    *l = (struct gl_lens){0};
}

// The largest |1/focus - 1/z| of anything in the scene.
static double largest_circle(const struct scene *s)
{
    const struct camera *c = &s->camera;
    const struct vec3 forward = v3_unit(v3_sub(c->target_m, c->eye_m));
    const double sharp = 1 / camera_focus(c);
    double most = sharp; // at infinity
    for (int k = 0; k < 8 * s->n_objects; k++) {
        const struct shape *shape = &s->object[k / 8].shape;
        struct vec3 lo, hi;
        shape_bounds(shape, &lo, &hi);
        const struct vec3 corner =
            v3(k & 1 ? lo.x : hi.x, k & 2 ? lo.y : hi.y, k & 4 ? lo.z : hi.z);
        const struct vec3 at = v3_add(shape->at_m, frame_world(&shape->frame, corner));
        const double z = v3_dot(v3_sub(at, c->eye_m), forward);
        most = fmax(most, z > 0 ? fabs(sharp - 1 / z) : INFINITY);
    }
    return most;
}

void gl_lens_draw(const struct gl_lens *l, const struct scene *s, const struct gl_target *from,
                  const struct gl_target *to)
{
    // Of a point at z the lens' half aperture a makes a disc of a |1/focus - 1/z| on the film at 1.
    const struct camera *c = &s->camera;
    const double spread_px = c->aperture_m / 2 * from->h / (2 * tan(c->fov_rad / 2));
    const double focus_m = camera_focus(c), reach_px = spread_px * largest_circle(s);
    const GLuint p = l->program;
    glBindFramebuffer(GL_FRAMEBUFFER, to->frame);
    glViewport(0, 0, to->w, to->h);
    glUseProgram(p);
    gl_bind(p, "picture", 0, GL_TEXTURE_2D, from->color);
    gl_bind(p, "depth", 1, GL_TEXTURE_2D, from->depth);
    gl_set1f(p, "spread", spread_px);
    gl_set1f(p, "focus", focus_m);
    gl_set1f(p, "reach", fmax(1, fmin(from->h / 12.0, reach_px)));
    gl_set1i(p, "taps", TAPS);
    glBindVertexArray(l->nothing);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}
