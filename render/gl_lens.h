// gl_lens.h - depth of field of one picture, as a pass over it.
//
// What is drawn once cannot know what a lens sees around an edge, nor that a pattern looks
// different from each point of the lens: for pictures that must be right draw many (gl_progress.h).
#pragma once
#include "render/gl.h"
#include "render/scene.h"

struct gl_lens {
    GLuint program, nothing;
};

bool gl_lens_init(struct gl_lens *l, struct err *e);
void gl_lens_finish(struct gl_lens *l); // accepts a zeroed struct

// Blurs a picture of the scene, with its depth, into another target of the same size. Circles are
// at most a twelfth of the picture's height in radius.
void gl_lens_draw(const struct gl_lens *l, const struct scene *s, const struct gl_target *from,
                  const struct gl_target *to);
