// sampling.h - a scene as passes: pictures whose mean is the integral over each pixel, the lens,
// the area of each light and, with the environment in many times more lights than one picture has,
// over the room.
//
// A pass differs from the scene in camera, lights, surround and lobes only, so that a renderer
// opened with the scene draws it: of each of the room's lights and each cell of a lobe it takes a
// part. After n passes every pixel has n x n points, each light's disc and the lens a spiral of
// equal areas.
#pragma once
#include "render/scene.h"

struct sampling {
    int side;                           // side x side passes
    struct scene pass;                  // what to draw now; but for its lights all is the scene's
    const struct scene *of;             // not owned
    struct light *light;                // [points * n_lights], owned
    int points;                         // of a light that has an area, in one pass
    struct surround around;             // its map is the scene's
    struct surround_light *all, *spots; // in parts, one for each pass, owned; NULL: none are needed
    int n_all, n_spots;
    struct object *object;        // [n], owned: the scene's but for their lobes
    struct lobes *lobes, *picked; // [n], owned: in parts, and those of this pass
};

// `side` 1: the scene itself. It must stay as it is until the end.
bool sampling_init(struct sampling *p, const struct scene *s, int side, struct err *e);
// Sets p->pass; k from 0 to side * side - 1.
bool sampling_pass(struct sampling *p, int k, struct err *e);
void sampling_finish(struct sampling *p); // accepts a zeroed struct
