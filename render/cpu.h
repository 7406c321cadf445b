// cpu.h - the reference renderer: every pixel in double, sharing no code with the shaders.
#pragma once
#include "render/scene.h"

// Linear radiance, R,G,B, s->h x s->w. Plain: one ray through the centre of each pixel, lights are
// points, the lens is a pinhole, as the GL renderer draws. `integrate`: the mean over 8 x 8 rays a
// pixel, the lens and the area of each light; an environment is 8,192 lights, each seen by four of
// the rays, where GL takes the few of a coarser cut (flat samples show their prefiltered map in
// both).
bool cpu_render(const struct scene *s, bool integrate, struct image *out, struct err *e);
