// tiles.h - which parts of the picture an object needs at all, and where it can diffract.
//
// The picture in squares. A square is left out when the object cannot be in it, and drawn without
// diffraction when no light's half vector can come into the table's range there; each has a list of
// the environment's lights that can. All by bounds on how directions change over the square: what
// is left out is zero.
#pragma once
#include "render/scene.h"

enum { TILE_SIDE = 32 };

struct tile {
    float x0, y0, x1, y1; // pixels
    int first, count;     // the environment's lights that can matter there, of tiles.far
};

struct tiles {
    struct tile *diffracting, *plain; // [n_diffracting], [n_plain], owned
    int n_diffracting, n_plain;
    unsigned char *far; // [n_far] numbers of lights, owned; begins with all of them in order
    int n_far;
    bool whole; // leave nothing out, to see what it saves
};

void tiles_find(struct tiles *t, const struct scene *s, const struct object *o, int w, int h);
void tiles_finish(struct tiles *t); // accepts a zeroed struct
