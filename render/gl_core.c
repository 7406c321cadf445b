// gl_core.c - programs, uniforms, textures and float targets.
#define _GNU_SOURCE
#include "render/gl.h"
#include <stdio.h>
#include <string.h>

enum { MAX_PARTS = 8 };

GLenum gl_picture_format = GL_RGBA32F;
bool gl_lost;

bool gl_check(struct err *e)
{
    gl_lost = false;
    if (epoxy_gl_version() < 33)
        return err_set(e, ERR_DEVICE, "OpenGL %.40s is too old: 3.3 is needed",
                       (const char *)glGetString(GL_VERSION));
    struct gl_target t;
    if (!gl_target_init(&t, 4, 4, e))
        return false;
    gl_target_finish(&t);
    return true;
}

bool gl_alive(struct err *e)
{
    static const char remedy[] = "render again, or with --backend cpu";
    if (!glGetString(GL_VERSION))
        return err_set(e, ERR_DEVICE, "OpenGL's context is gone; %s", remedy);
    GLenum reset = GL_NO_ERROR;
    if (epoxy_gl_version() >= 45)
        reset = glGetGraphicsResetStatus();
    else if (epoxy_has_gl_extension("GL_ARB_robustness"))
        reset = glGetGraphicsResetStatusARB();
    return (reset == GL_NO_ERROR && !gl_lost) ||
           err_set(e, ERR_DEVICE, "OpenGL lost its context: %s reset the graphics card; %s",
                   reset == GL_GUILTY_CONTEXT_RESET ? "this program" : "another program", remedy);
}

const char *gl_name(void)
{
    const char *name = (const char *)glGetString(GL_RENDERER);
    return name ? name : "no context";
}

static GLuint stage(GLenum kind, const char *name, const char *defines, const char *const parts[],
                    struct err *e)
{
    const char *source[MAX_PARTS + 2] = {"#version 330 core\n", defines};
    int n = 2;
    while (parts[n - 2] && n < MAX_PARTS + 2) {
        source[n] = parts[n - 2];
        n++;
    }
    const GLuint s = glCreateShader(kind);
    glShaderSource(s, n, source, NULL);
    glCompileShader(s);
    GLint ok = 0;
    glGetShaderiv(s, GL_COMPILE_STATUS, &ok);
    if (ok)
        return s;
    char text[300] = "";
    glGetShaderInfoLog(s, sizeof text, NULL, text);
    text[strcspn(text, "\n")] = 0;
    err_set(e, ERR_DEVICE, "shader %s: %s", name, text);
    glDeleteShader(s);
    return 0;
}

GLuint gl_program(const char *name, const char *defines, const char *const vertex[],
                  const char *const fragment[], struct err *e)
{
    const GLuint v = stage(GL_VERTEX_SHADER, name, defines, vertex, e);
    const GLuint f = v ? stage(GL_FRAGMENT_SHADER, name, defines, fragment, e) : 0;
    GLuint p = 0;
    if (f) {
        p = glCreateProgram();
        glAttachShader(p, v);
        glAttachShader(p, f);
        glLinkProgram(p);
        GLint ok = 0;
        glGetProgramiv(p, GL_LINK_STATUS, &ok);
        if (!ok) {
            char text[300] = "";
            glGetProgramInfoLog(p, sizeof text, NULL, text);
            text[strcspn(text, "\n")] = 0;
            err_set(e, ERR_DEVICE, "shader %s: %s", name, text);
            glDeleteProgram(p);
            p = 0;
        }
    }
    glDeleteShader(v);
    glDeleteShader(f);
    return p;
}

void gl_set1i(GLuint program, const char *name, int v)
{
    glUniform1i(glGetUniformLocation(program, name), v);
}

void gl_set1f(GLuint program, const char *name, double v)
{
    glUniform1f(glGetUniformLocation(program, name), (float)v);
}

void gl_set2f(GLuint program, const char *name, double x, double y)
{
    glUniform2f(glGetUniformLocation(program, name), (float)x, (float)y);
}

void gl_set3f(GLuint program, const char *name, const double v[3])
{
    glUniform3f(glGetUniformLocation(program, name), (float)v[0], (float)v[1], (float)v[2]);
}

GLuint gl_texture(GLenum target, GLint filter)
{
    GLuint t;
    glGenTextures(1, &t);
    glBindTexture(target, t);
    glTexParameteri(target, GL_TEXTURE_MIN_FILTER, filter);
    glTexParameteri(target, GL_TEXTURE_MAG_FILTER, filter);
    glTexParameteri(target, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(target, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    return t;
}

void gl_bind(GLuint program, const char *name, int unit, GLenum target, GLuint texture)
{
    glActiveTexture(GL_TEXTURE0 + (GLenum)unit);
    glBindTexture(target, texture);
    gl_set1i(program, name, unit);
}

bool gl_target_init(struct gl_target *t, int w, int h, struct err *e)
{
    GLint most = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
    if (w > most || h > most)
        return err_set(e, ERR_DATA, "a picture of %d x %d is more than this OpenGL can draw (%d)",
                       w, h, (int)most);
    *t = (struct gl_target){.w = w, .h = h};
    t->color = gl_texture(GL_TEXTURE_2D, GL_NEAREST);
    glTexImage2D(GL_TEXTURE_2D, 0, (GLint)gl_picture_format, w, h, 0, GL_RGBA, GL_FLOAT, NULL);
    t->depth = gl_texture(GL_TEXTURE_2D, GL_NEAREST);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, w, h, 0, GL_DEPTH_COMPONENT, GL_FLOAT,
                 NULL);
    glGenFramebuffers(1, &t->frame);
    glBindFramebuffer(GL_FRAMEBUFFER, t->frame);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, t->color, 0);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, t->depth, 0);
    const GLenum status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    if (status == GL_FRAMEBUFFER_COMPLETE && glGetError() == GL_NO_ERROR)
        return true;
    gl_target_finish(t);
    return err_set(e, ERR_DEVICE,
                   "this OpenGL (%s) cannot draw to float textures; use --backend cpu", gl_name());
}

void gl_target_finish(struct gl_target *t)
{
    if (!t->frame || !gl_alive(&(struct err){0})) {
        *t = (struct gl_target){0};
        return;
    }
    glDeleteFramebuffers(1, &t->frame);
    glDeleteTextures(1, &t->depth);
    glDeleteTextures(1, &t->color);
    *t = (struct gl_target){0};
}

bool gl_target_read(const struct gl_target *t, struct image *out, struct err *e)
{
    if (!gl_alive(e) || !image_init(out, t->w, t->h, 3, e))
        return false;
    glBindFramebuffer(GL_FRAMEBUFFER, t->frame);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, t->w, t->h, GL_RGB, GL_FLOAT, out->px);
    if (glGetError() == GL_NO_ERROR && gl_alive(e))
        return true;
    image_finish(out);
    if (gl_alive(e))
        err_set(e, ERR_DEVICE, "OpenGL cannot give the picture back; use --backend cpu");
    return false;
}
