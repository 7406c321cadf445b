// env_separable.h - a lat-long map blurred by the factors of a diffraction table (R17).
//
// R17 lets normal, viewer and mirror direction be one, n = wo = r: pixel r of the result is what
// a viewer sees who has r in the mirror,
//   L(r) = 4 pi^2 sum over h of (1 + wi.wo)^2 S(h) L(wi) dsolid_angle,   wi = h - r
// as two passes of one-dimensional blurs on the sphere, so it holds near the normal only. With
// c = sqrt(1 - h^2) each pass weighs by (1 + c)^2 / (4 c): the product differs from that of both
// axes in fourth order. Radiance keeps its scale: no division by a total weight.
// The local frame at r is that of the map: columns and rows. Turning the environment so that the
// sample's normal is the centre, its tangent the columns, and turning the result back (four
// passes) is what keeps the lines of the pattern straight around the normal.
#pragma once
#include "process/environment.h"
#include "process/factor.h"

struct separable {
    int width;   // of the map: width x width / 2, even
    int taps;    // of a filter; those that are zero are skipped
    bool rotate; // four passes
};

// One filter on taps: offset along its axis, weight per channel (with step and (1 + c)^2 / (4 c)).
struct env_taps {
    int n;
    float *h;   // [n]
    float *rgb; // [n][3]
};
bool env_taps(struct env_taps *t, const struct factors *f, int filter, int rank, int taps,
              struct err *e);
void env_taps_finish(struct env_taps *t);

// The map's rotation: (x right, y up, z back) of the map in the world, which has the normal in the
// centre, the tangent to the right, the bitangent down.
struct frame separable_turn(const struct frame *f);

// Direction of a filter's axis in the plane of columns (to the right) and rows (down) of the map.
void separable_axis(const struct factors *f, int filter, const struct frame *frame, bool rotate,
                    double axis[2]);

// ERR_DATA: a width that is odd or under 4, fewer than 1 tap.
bool separable_check(const struct separable *how, struct err *e);

bool env_separable(const struct factors *f, const struct environment *env,
                   const struct frame *frame, const struct separable *how, struct image *out,
                   struct err *e);
