// lobes.h - a diffraction pattern in cells over (u, v), for light that comes from everywhere.
//
// Under an environment a narrow lobe shows few directions sharply: the sum over its cells, each
// with the light around the direction it mirrors, is the integral that a few far lights would show
// as points. Cells are small where the pattern is strong (cut.h).
#pragma once
#include "render/material.h"
#include <stddef.h>

enum { LOBES_CELLS = 64 /* of one picture */ };

struct lobes {
    int n, count; // cells; tables, 1 for slits
    float *cell;  // [n][1 + count][3] u, v, rms extent; then the integral of each table over it
};

// The material's pattern for that way to diffract (a table or slits) in up to n cells of `parts`
// each, which stand next to each other as cells of their own. Colours as material_diffraction()
// takes them from the table; a part of a cell of one node is that part of it.
bool lobes_init(struct lobes *l, const struct material *m, enum diffraction kind, int n, int parts,
                struct err *e);
void lobes_finish(struct lobes *l); // accepts a zeroed struct

// One part of each cell, in the place of all of it: `which` of `parts`, another one in each cell.
bool lobes_pick(const struct lobes *all, int parts, int which, struct lobes *l, struct err *e);

static inline const float *lobes_cell(const struct lobes *l, int k)
{
    return l->cell + (size_t)k * (size_t)(1 + l->count) * 3;
}
