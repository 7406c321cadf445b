// flat.h - vignetting times the light's fall-off: what an even, diffuse target looks like.
//
// A polynomial of degree 4 per channel, 1 in the middle of the frame, where a rig's responsivity
// holds. Radiance divided by it is what an even camera under even light would have seen.
#pragma once
#include "calib/poly.h"
#include "calib/record.h"

enum { FLAT_CHANNELS = 4 };

struct flat {
    struct record head;
    int w, h, nc;
    double term[FLAT_CHANNELS][POLY_TERMS]; // x and y from -1 to 1 over the frame
    double corner;                          // darkest corner over the brightest place, channel 0
};

// The target in linear samples; only the first nc channels count. Pixels more than 5 % off the
// surface (dust, scratches) weigh nothing. ERR_DATA: dark, or more than 10 % rms off any such
// surface: not an even target.
bool flat_fit(struct flat *f, const struct image *target, int nc, struct err *e);
double flat_at(const struct flat *f, int c, double i, double j);

bool flat_write(const struct flat *f, const char *command, const char *path, struct err *e);
bool flat_read(struct flat *f, const char *path, struct err *e);
