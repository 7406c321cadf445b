// photo.h - the noise-free radiance that a scene sends to each pixel, and where each pixel looks.
#pragma once
#include "core/image.h"
#include "sim/band.h"
#include "sim/farfield.h"
#include "sim/scene.h"

// What a pixel sees: half vector in (t, b, n) and the factor f / D = F^2 G / w^2 (docs/optics.md).
struct sight {
    double u, v, w;
    double factor; // 0: nothing is seen there
    double lm;     // turns L / E into the Lm of a table: 1 / (G F^2 / F0^2); NAN when factor is 0
};
struct sight photo_sight(const struct sim_scene *s, double i, double j);

// L in W m^-2 sr^-1 into `px` [h][w][channels]: 1 channel for mono, 3 for a Bayer sensor.
bool photo_pattern(const struct sim_scene *s, const struct band *b, struct image *out,
                   struct err *e);

// Channels u, v, w, weight of every pixel: the geometry record that a table is made with.
bool photo_geometry(const struct sim_scene *s, struct image *out, struct err *e);
