// gl_material.h - one material's textures and uniforms.
#pragma once
#include "render/gl.h"
#include "render/material.h"

struct gl_material {
    GLuint table, curves, slit_light, mask;
};

// ERR_DEVICE when a table is more than the GL holds.
bool gl_material_init(struct gl_material *g, const struct material *m, struct err *e);
void gl_material_finish(struct gl_material *g); // accepts a zeroed struct

// Sets the program in use for the material as it is now.
void gl_material_use(const struct gl_material *g, GLuint program, const struct material *m,
                     const double light_color[3]);
