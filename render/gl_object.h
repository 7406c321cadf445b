// gl_object.h - one object on the GPU.
#pragma once
#include "render/gl_material.h"
#include "render/scene.h"
#include "render/tiles.h"

enum { LIGHTS_MOST = SCENE_MAX_LIGHTS + SURROUND_LIGHTS };

// What a program leaves out when it is not needed.
struct gl_features {
    bool glossy, coat, linear, masked, surround, seen, far, curves, crossed, lobes;
};

struct gl_object {
    GLuint program[DIFFRACTION_KINDS]; // 0: not needed so far
    struct gl_features features;       // that they were made for
    struct gl_material material;
    GLuint vertices, buffer, index; // of a mesh
    GLuint seen;                    // texture of what it shows of the environment; 0: none
    GLuint lobes;                   // texture of its pattern's cells, of the picture being drawn
    struct tiles tiles;             // of the last picture
};

bool gl_object_init(struct gl_object *g, const struct object *o, const struct scene *s,
                    struct err *e);
void gl_object_finish(struct gl_object *g); // accepts a zeroed struct

// Makes the programs that the object needs now: without diffraction, and with its own.
bool gl_object_programs(struct gl_object *g, const struct object *o, const struct scene *s,
                        struct err *e);

// Everything but lights and the environment's texture, for a picture of w x h.
void gl_object_use(const struct gl_object *g, GLuint program, const struct object *o,
                   const struct scene *s, int w, int h);
// Uploads the cells of its pattern, which change from picture to picture (sampling.h).
void gl_object_lobes(struct gl_object *g, const struct object *o);
void gl_object_draw_mesh(const struct gl_object *g, const struct mesh *m);

// right, up, forward, eye and size, in the shape's coordinates.
void gl_set_camera(GLuint program, const struct camera *c, const struct shape *s, int w, int h);
