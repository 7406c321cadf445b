// environment.h - light from far away: radiance over all directions, as a lat-long map.
//
// Shape   map.px[h][2h][3], linear radiance; docs/optics.md has the direction of each pixel: row 0
//         is up, the centre looks down -z.
// Between the pixel centres radiance is Catmull-Rom cubic in row and column, never below zero: a
// bilinear map would widen every light by a third of a pixel, which a narrow lobe shows.
#pragma once
#include "core/geom.h"
#include "core/image.h"
#include <stddef.h>

struct environment {
    struct image map; // three channels, w = 2 h
};

// Reads and checks a map; one channel is taken as grey. ERR_DATA with the reason for a map that is
// not 2:1, or that holds NaN, infinite or negative radiance.
bool environment_read(struct environment *env, const char *path, struct err *e);
// The same for a picture in memory, which becomes the environment's; `name` is for messages.
bool environment_take(struct environment *env, struct image *map, const char *name, struct err *e);
void environment_finish(struct environment *env); // accepts a zeroed struct

void environment_radiance(const struct environment *env, struct vec3 dir, double rgb[3]);

// Light in parts: each pixel cut into cut x cut pieces small enough to be points.
struct env_part {
    double t, b, n;  // direction cosines in the frame, n >= 0
    double power[3]; // radiance times solid angle
};
struct env_parts {
    const struct environment *env; // not owned
    struct frame frame;
    int cut;
    double (*azimuth)[4]; // [w * cut] what a column adds to t, b, n, and to dn/dphi; owned
};
bool env_parts_init(struct env_parts *p, const struct environment *env, const struct frame *f,
                    int cut, struct err *e);
void env_parts_finish(struct env_parts *p);

// The parts of one pixel row that are in front of the surface and not dark; out has room for
// w * cut * cut. A part that the horizon crosses counts with what is above it.
int env_parts_row(const struct env_parts *p, int row, struct env_part *out);
size_t env_parts_room(const struct env_parts *p);
