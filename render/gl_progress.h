// gl_progress.h - the mean of pictures on the GPU, and a scene's full integral as one (sampling.h).
//
// For a window: open the renderer, then one gl_progress_step() per idle frame; `mean` can be shown
// after each. Start anew when anything in the scene has changed.
#pragma once
#include "render/gl_render.h"
#include "render/sampling.h"

struct gl_progress {
    struct sampling sampling;
    struct gl_target one, mean; // the last pass and the mean so far
    GLuint program, nothing;
    int done; // passes, of sampling.side squared
};

// Of w x h pixels. The scene stays the caller's, and as it is.
bool gl_progress_init(struct gl_progress *p, const struct scene *s, int side, int w, int h,
                      struct err *e);
// Draws one more pass; nothing after the last.
bool gl_progress_step(struct gl_progress *p, struct gl_renderer *r, struct err *e);
void gl_progress_finish(struct gl_progress *p); // accepts a zeroed struct

// All at once, without a display, as gl_render(). work->error is how far the mean of the first half
// of the passes is from that of all: about the error of all.
bool gl_render_passes(const struct scene *s, int side, struct image *out, struct gl_work *work,
                      struct err *e);
