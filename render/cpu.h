// cpu.h - the reference renderer: every pixel in double, sharing no code with the shaders.
#pragma once
#include "render/scene.h"

// Linear radiance, R,G,B, s->h x s->w. Plain: one ray through the centre of each pixel, lights are
// points, as the GL renderer draws. `integrate`: the mean over 8 x 8 rays a pixel and over the
// area of each light; under an environment 2 x 2 rays, and each of its pixels is a light where GL
// takes the few of a median cut (flat samples show their prefiltered map in both).
bool cpu_render(const struct scene *s, bool integrate, struct image *out, struct err *e);
