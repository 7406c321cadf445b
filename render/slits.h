// slits.h - rows of slits (process/multislit.h) as a renderer needs them: at every point, under one
// light, in absolute scale.
#pragma once
#include "core/geom.h"
#include "process/multislit.h"

// One row along t, or two crossed ones. S_d is |P|^2 / (lambda^2 A w^2) of an opaque screen's
// complement at w = 2, over 4 pi^2, so that f = 4 pi^2 F^2 G S_d. Across a single row the lobe is a
// Gaussian in v. Of a row its pitch, width and count are used, and of the first `radial`.
struct slits {
    struct multislit row[2]; // row[1].pitch_m 0: one row
    double across;           // rms width of the lobe in v, for one row
    int n;                   // wavelengths, equal steps from lambda_m to last_m
    double lambda_m, last_m;
    double (*weight)[3]; // [n] linear sRGB of the light times the step, owned
};

bool slits_light(struct slits *s, const struct spectrum *light, int n, struct err *e);
void slits_finish(struct slits *s); // accepts a zeroed struct
void slits_eval(const struct slits *s, double u, double v, double out[3]); // S_d, linear sRGB

// One row without its lobe across: S_d(u, v) = row(u) times the Gaussian in v. It shows detail of
// slits_detail() in u.
void slits_row(const struct slits *s, double u, double out[3]);
double slits_detail(const struct slits *s);
static inline bool slits_are_crossed(const struct slits *s)
{
    return s->row[1].pitch_m > 0;
}

// Linear sRGB of a light whose luminance is 1.
bool light_color(const struct spectrum *light, double rgb[3], struct err *e);
