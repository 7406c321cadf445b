// gl_render.h - the scene drawn by OpenGL 3.3, in the context that is current.
#pragma once
#include "render/gl.h"
#include "render/scene.h"

struct gl_renderer;

// Uploads the scene's meshes, tables and masks; the scene stays the caller's and is not kept.
bool gl_renderer_open(struct gl_renderer **r, const struct scene *s, struct err *e);
void gl_renderer_close(struct gl_renderer *r); // accepts NULL

// Uploads the environment and what the objects show of it again, after it has changed.
bool gl_renderer_surround(struct gl_renderer *r, const struct scene *s, struct err *e);

// Uploads tables, slits and maps of all objects again, after the light's spectrum has changed
// (relight.h).
bool gl_renderer_materials(struct gl_renderer *r, const struct scene *s, struct err *e);

// false: leaves nothing out from here on, to see what that saves.
void gl_renderer_skip(struct gl_renderer *r, bool skip);

// Draws into a target: linear radiance, row 0 of the target is the picture's top row. The scene is
// the one opened, in which camera, lights, positions, numbers of materials and the way
// each diffracts may have changed.
bool gl_renderer_draw(struct gl_renderer *r, const struct scene *s, const struct gl_target *t,
                      struct err *e);

// What the last picture cost, in pixels: shaded at all, diffraction looked up, and what both would
// be if every object were drawn all over the picture (tiles.h; a mesh counts as that). And tables.
struct gl_work {
    long shaded, shaded_most, looked_up, looked_up_most;
    int tables, tables_used;
    double error; // relative RMSE of many pictures' mean (gl_progress.h); NAN: of one, not known
};
struct gl_work gl_renderer_work(const struct gl_renderer *r, const struct scene *s,
                                const struct gl_target *t);

// All at once, without a display: context, scene, picture. `work` may be NULL.
bool gl_render(const struct scene *s, struct image *out, struct gl_work *work, struct err *e);
