// surround.h - an environment as a renderer uses it: a backdrop and mirror image, the irradiance of
// diffuse surfaces, what a flat sample shows of it, and for lobes its light in two: the brightest
// spots as far point lights, and the rest, which is even enough to be looked up around a direction.
#pragma once
#include "process/env_keep.h"
#include "render/material.h"

// A far light of the environment: direction to it, irradiance of a surface that faces it.
struct surround_light {
    struct vec3 to;
    double irradiance[3];
};

enum {
    SURROUND_LIGHTS = 128, // numbered in a byte
    SURROUND_SPOTS = 64,
    SURROUND_TERMS = 9,
    SURROUND_LEVELS = 15
};

struct surround {
    struct environment env;
    bool shown;                                   // behind the objects
    struct surround_light light[SURROUND_LIGHTS]; // all of it
    int n_lights;
    struct image spots;                         // the brightest pixels, but for what `rest` holds
    struct surround_light spot[SURROUND_SPOTS]; // they as lights
    int n_spots;
    struct image rest[SURROUND_LEVELS]; // the map without spots; each level half the one before
    int n_levels;
    double irradiance[SURROUND_TERMS][3]; // per spherical harmonic of the normal
};

// Takes the map over, scales it by `intensity`, turns it by `turn_rad` about +y (whole columns).
bool surround_init(struct surround *s, struct environment *env, double intensity, double turn_rad,
                   struct err *e);
void surround_finish(struct surround *s); // accepts a zeroed struct

// The light of a map (all of it, or the spots) in at most `most` lights (cut.h): down to single
// pixels where it is brightest, or everywhere when the map has no more. Of each `parts`, one after
// the other; *n counts them. Free them; NULL where memory is short.
struct surround_light *surround_cut(const struct image *map, int most, int parts, int *n,
                                    struct err *e);

// Radiance from a unit direction, bilinear as a texture is read.
void surround_radiance(const struct surround *s, struct vec3 dir, double rgb[3]);

// What surround_init() makes of a map. Of every pixel what is above the luminance that a tiny part
// of the sphere surpasses, and what is not; the rest's levels, the largest with a power of two
// rows.
bool surround_part(const struct image *map, struct image *spots, struct image *rest, struct err *e);
bool surround_levels(struct surround *s, struct image *rest, struct err *e); // moves it in
double surround_row_angle(const struct image *map, int j); // solid angle of a pixel of row j

// Mean radiance of the rest around a direction, `extent_rad` rms along each axis, from the nearest
// level.
void surround_rest(const struct surround *s, struct vec3 dir, double extent_rad, double rgb[3]);

// Irradiance of a surface by the harmonics up to degree 2 (Ramamoorthi and Hanrahan 2001: within
// 1 % on average); never below zero.
void surround_irradiance(const struct surround *s, struct vec3 normal, double rgb[3]);

// How a prefiltered map is made: n x n nodes over all directions, of which those of a square window
// are computed; the others stay 0.
struct seen_how {
    int n;
    double middle[2], span; // of the window in (o_t, o_b); span 0: all
    struct env_keep *keep;  // of the sample, or NULL
};

// The diffracted radiance of a flat sample times o_n, over (o_t, o_b): nodes from -1 to 1
// (process/env_exact.h). Valid until table, Fresnel, frame or environment change.
bool surround_prefilter(const struct surround *s, const struct material *m, const struct frame *f,
                        const struct seen_how *how, struct image *map, struct err *e);
// Its look-up at a direction in the surface frame: radiance.
void surround_map_at(const struct image *map, struct vec3 wo, double rgb[3]);
