// relight.h - the scene's lights get another spectrum while pictures go on being drawn (T17 fig.
// 15).
//
// A thread sums the tables of samples with a photograph anew, coarse ones first, weighs the
// wavelengths of slits, and last prefilters the environment. The owner of the scene takes what is
// ready between two pictures. A table without its photograph stays as it is.
//
//     relight_open(&r, &scene, "A", &e);
//     every frame: if (relight_take(r, &scene)) gl_renderer_materials(renderer, &scene, &e);
#pragma once
#include "render/scene.h"

struct relight;

// `illuminant` as in illuminant_get. Until it is closed the scene's shapes, photographs and
// surround must stay. ERR_DATA for an unknown illuminant.
bool relight_open(struct relight **r, const struct scene *s, const char *illuminant, struct err *e);

// Moves what is ready into the scene; true when that was anything.
bool relight_take(struct relight *r, struct scene *s);
// Everything is taken, or the thread gave up: then e->code is not ERR_NONE.
bool relight_done(struct relight *r, struct err *e);
void relight_close(struct relight *r); // waits for the step under way; accepts NULL
