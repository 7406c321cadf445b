// sampling.h - a scene as passes: pictures whose mean is the integral over each pixel, the lens,
// the area of each light and, with the environment in many times more lights than one picture has,
// over the room.
//
// A pass differs from the scene in camera, lights and surround only, so that a renderer opened with
// the scene draws it. After n passes every pixel has n x n points, each light's disc and the lens
// a spiral of equal areas.
#pragma once
#include "render/scene.h"

struct sampling {
    int side;                   // side x side passes
    struct scene pass;          // what to draw now; but for its lights all is the scene's
    const struct scene *of;     // not owned
    struct light *light;        // [points * n_lights], owned
    int points;                 // of a light that has an area, in one pass
    struct surround around;     // its map is the scene's
    struct surround_light *far; // [n_far], owned; NULL: the scene's own lights do in every pass
    int n_far;
};

// `side` 1: the scene itself. It must stay as it is until the end.
void sampling_init(struct sampling *p, const struct scene *s, int side);
void sampling_pass(struct sampling *p, int k); // sets p->pass, k from 0 to side * side - 1
void sampling_finish(struct sampling *p);      // accepts a zeroed struct
