// gl.h - OpenGL 3.3 core: the context of this thread, programs, textures.
//
// Everything here runs on the one thread that made the context current (the window's, or EGL's
// below).
#pragma once
#include "core/image.h"
#include <epoxy/gl.h>

// A context without a display: EGL surfaceless. ERR_DEVICE where there is none, with what to
// install.
struct gl_context;
bool gl_context_open(struct gl_context **c, struct err *e);
void gl_context_close(struct gl_context *c); // accepts NULL

// Refuses a context that is older than 3.3 or cannot draw to float textures; ERR_DEVICE.
bool gl_check(struct err *e);
// False, ERR_DEVICE, when no context is current any more or its driver was reset: what was made in
// it is gone, and only closing is left to do. Asked after every picture.
bool gl_alive(struct err *e);
const char *gl_name(void); // "llvmpipe (LLVM 15.0.6, 256 bits)"

// Links a program; the parts of each stage follow "#version 330 core" and `defines`. 0 and
// ERR_DEVICE with the compiler's first line when it refuses.
GLuint gl_program(const char *name, const char *defines, const char *const vertex[],
                  const char *const fragment[], struct err *e);

// Uniforms of the program in use, by name; absent ones are ignored.
void gl_set1i(GLuint program, const char *name, int v);
void gl_set1f(GLuint program, const char *name, double v);
void gl_set2f(GLuint program, const char *name, double x, double y);
void gl_set3f(GLuint program, const char *name, const double v[3]);

// A texture with that filter, clamped at its edges, bound to the current unit.
GLuint gl_texture(GLenum target, GLint filter);
// Binds a texture to a unit and the program's sampler of that name to the unit.
void gl_bind(GLuint program, const char *name, int unit, GLenum target, GLuint texture);

// An offscreen picture: float colour and depth, both textures.
struct gl_target {
    int w, h;
    GLuint frame, color, depth;
};
extern bool gl_lost; // a test sets it: the context counts as lost until another one is checked
extern GLenum
    gl_picture_format; // of its colour, GL_RGBA32F; a test takes one that cannot be drawn to
bool gl_target_init(struct gl_target *t, int w, int h, struct err *e);
void gl_target_finish(struct gl_target *t); // accepts a zeroed struct
bool gl_target_read(const struct gl_target *t, struct image *out, struct err *e); // R,G,B
