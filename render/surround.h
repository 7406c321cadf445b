// surround.h - an environment as a renderer uses it: a backdrop and mirror image, the irradiance of
// diffuse surfaces, point lights that hold all of its light, and what a flat sample shows of it.
#pragma once
#include "process/environment.h"
#include "render/material.h"

// A far light of the environment: direction to it, irradiance of a surface that faces it.
struct surround_light {
    struct vec3 to;
    double irradiance[3];
};

enum { SURROUND_LIGHTS = 128 /* numbered in a byte */, SURROUND_TERMS = 9 };

struct surround {
    struct environment env;
    bool shown; // behind the objects
    struct surround_light light[SURROUND_LIGHTS];
    int n_lights;
    double irradiance[SURROUND_TERMS][3]; // per spherical harmonic of the normal
};

// Takes the map over, scales it by `intensity`, turns it by `turn_rad` about +y (whole columns).
void surround_init(struct surround *s, struct environment *env, double intensity, double turn_rad);
void surround_finish(struct surround *s); // accepts a zeroed struct

// All of its light in at most `most` lights by a median cut (Debevec 2005): down to single pixels
// where it is brightest, or everywhere when the map has no more. Free them.
struct surround_light *surround_cut(const struct surround *s, int most, int *n);

// Radiance from a unit direction, bilinear as a texture is read.
void surround_radiance(const struct surround *s, struct vec3 dir, double rgb[3]);

// Irradiance of a surface by the harmonics up to degree 2 (Ramamoorthi and Hanrahan 2001: within
// 1 % on average); never below zero.
void surround_irradiance(const struct surround *s, struct vec3 normal, double rgb[3]);

// The diffracted radiance of a flat sample times o_n, over (o_t, o_b): n x n nodes from -1 to 1
// (process/env_exact.h). Valid until table, Fresnel, frame or environment change.
bool surround_prefilter(const struct surround *s, const struct material *m, const struct frame *f,
                        int n, struct image *map, struct err *e);
// Its look-up at a direction in the surface frame: radiance.
void surround_map_at(const struct image *map, struct vec3 wo, double rgb[3]);
