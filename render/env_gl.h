// env_gl.h - R17's filters as fragment shaders: env_separable() of process/ on OpenGL.
#pragma once
#include "process/env_separable.h"

// In the current context (gl.h). The result is that of env_separable() but for rounding; ERR_DEVICE
// where the map is too large for the device.
bool env_gl_separable(const struct factors *f, const struct environment *env,
                      const struct frame *frame, const struct separable *how, struct image *out,
                      struct err *e);

// Whether the current context draws on the processor, where env_separable() is many times faster.
bool env_gl_is_software(void);
