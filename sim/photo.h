// photo.h - the noise-free radiance that a scene sends to each pixel, and where each pixel looks.
#pragma once
#include "core/image.h"
#include "sim/band.h"
#include "sim/farfield.h"
#include "sim/scene.h"

// Radiance as the sensor has it behind the lens, W m^-2 sr^-1: 1 channel for mono, 3 for Bayer.
bool photo_pattern(const struct sim_scene *s, const struct band *b, struct image *out,
                   struct err *e);

// The same through a lens that is focused at `focus_per_m` dioptres (NAN: infinity, where the
// pattern is). Up to half of the bokeh's focus the pattern is blurred; from there on the picture is
// the highlight as a disc with the surface in it, as bright as a white wall.
bool photo_focused(const struct sim_scene *s, const struct band *b, double focus_per_m,
                   struct image *out, struct err *e);

// Channels u, v, w, weight of every pixel (for the middle of the light): the geometry record that a
// table is made with; weight turns L / E into Lm. NAN where nothing is seen.
bool photo_geometry(const struct sim_scene *s, struct image *out, struct err *e);
