// grating.h - analytic gratings: many slits (T17 eq. 16) and Stam's shader of GPU Gems (G04).
#pragma once
#include "core/geom.h"
#include "core/spectrum.h"

// One row of slits, or two crossed ones. S_d is exact in scale: it is |P|^2 / (lambda^2 A w^2) of
// an opaque screen's complement at w = 2, over 4 pi^2, so that f = 4 pi^2 F^2 G S_d. Across a
// single row the lobe is a Gaussian in v.
struct slits {
    double pitch_m[2], width_m[2]; // along t and b; pitch_m[1] 0: one row
    int count[2];                  // lit at once
    double across;                 // rms width of the lobe in v, for one row
    bool radial;                   // turned about the normal: |(u, v)| in the place of u
    int n;                         // wavelengths, equal steps from lambda_m to last_m
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
    return s->pitch_m[1] > 0;
}

// (sin(n pi x) / (n sin(pi x)))^2, also where the denominator is 0.
double slits_comb(int n, double x);

// G04's listing: a rainbow of three bumps for each of seven orders, and a highlight.
struct stam {
    double spacing_um;
    double roughness; // r of the listing: the highlight is exp(-(r u / w)^2)
    double highlight[3];
};
void stam_eval(const struct stam *s, struct vec3 h, double out[3]);
