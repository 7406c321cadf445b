// show_gl.h - a picture on the window: exposed, in false colour, split, or as a difference.
//
// A post pass over float textures: what it changes costs no rendering. Row 0 of a texture is the
// picture's top row, unless `upwards`. Tables are shown over u and v, however their nodes lie.
#pragma once
#include "render/gl.h"
#include "ui/view_layout.h"
#include "ui/view_params.h"

struct show_gl;

bool show_gl_open(struct show_gl **s, struct err *e);
void show_gl_close(struct show_gl *s); // accepts NULL

// A picture in the GPU's memory. `nc` 1 is shown grey; more than 3 channels: the first three.
struct shown {
    GLuint texture, other; // other: what it is compared with, 0: nothing
    int w, h;
    bool upwards; // row 0 is the lowest
    int power;    // of a table's nodes, else 1
    double peak;  // where the false colours end
    double ev;    // stops on top of the parameters'
    double white; // from here on the sensor clips; 0: it is no sensor's
};
void shown_upload(struct shown *s, const struct image *im); // sizes, texture and peak
void shown_finish(struct shown *s);                         // accepts a zeroed struct

// Into the window's framebuffer, `high` pixels high. The rest of the pane becomes dark.
void show_gl_draw(const struct show_gl *g, const struct shown *s, const struct placing *at,
                  struct gui_rect pane, int high, const struct params *p);
