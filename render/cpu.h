// cpu.h - the reference renderer: every pixel in double, sharing no code with the shaders.
#pragma once
#include "render/scene.h"

// Linear radiance, R,G,B, s->h x s->w. Plain: one ray through the centre of each pixel, lights are
// points, the lens is a pinhole, the room a few lights and cells, as the GL renderer draws one
// picture. `integrate`: the mean over 8 x 8 rays a pixel, the lens and the area of each light; of
// the room 8,192 lights and of each pattern 8,192 cells, a sixteenth of them by each ray (flat
// samples show their prefiltered map in both).
bool cpu_render(const struct scene *s, bool integrate, struct image *out, struct err *e);

// The mean of side x side plain pictures, as gl_render_passes() draws them.
bool cpu_render_passes(const struct scene *s, int side, struct image *out, struct err *e);
