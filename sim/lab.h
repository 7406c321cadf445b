// lab.h - a simulated bench: a scene, the rig file that describes it, and its photographs so far.
//
// Photographs without noise are computed once per light and filter and kept: a bracket costs one.
#pragma once
#include "sim/photo.h"

enum { LAB_LINES = 32, LAB_POSITIONS = 64 };

struct lab {
    struct rig rig; // path NULL: no rig, lights and filters are those of lab_default_filters
    struct sim_scene scene;
    double focus_per_m;                          // NAN: at infinity
    struct image shot[LAB_LINES][LAB_POSITIONS]; // at that focus; px NULL: not yet needed
};

// `scene` is relative to the rig's folder; NULL or "" means the built-in one. `rig` may be NULL.
bool lab_open(struct lab *lab, const char *scene, const char *rig, struct err *e);
void lab_finish(struct lab *lab); // accepts a zeroed struct

// The light on a line of the lights' trigger through the filter at a position of the filters' one;
// -1: no filter. Without a rig: a white LED behind green, red, blue, nothing.
bool lab_band(const struct lab *lab, int line, int position, struct band *b, struct err *e);
// Turns the lens; photographs so far are gone if that changes anything.
void lab_focus(struct lab *lab, double focus_per_m);
// Radiance under that light alone; valid until lab_finish or lab_focus. Not for two threads at
// once.
bool lab_photo(struct lab *lab, int line, int position, const struct image **out, struct err *e);
