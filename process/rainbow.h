// rainbow.h - Stam's shader of GPU Gems ch. 8 (G04), as printed and with the observer's colours.
//
// u = (T.H) d, w = N.H with H not normalised: a highlight exp(-(r u / w)^2) and a sum over orders n
// of the colour of wavelength |u| / n. As printed the colour is three bumps over y = 2 |u| / n - 1
// (|u| in um), n = 1..7, linear RGB. Spectral: P cmf at |u| / n, every order that is visible.
#pragma once
#include "core/spectrum.h"
#include "core/table.h"

struct rainbow {
    double spacing_m;
    double roughness;    // r of the listing; 0: no highlight
    double highlight[3]; // hiliteColor: RGB as printed, XYZ when spectral
};

// At u = h.t, w = h.n.
void rainbow_rgb(const struct rainbow *r, double u, double w, double rgb[3]);

// P is scaled so that an even light has the observer's own values.
void rainbow_xyz(const struct rainbow *r, const struct spectrum *light, double u, double w,
                 double xyz[3]);

// A plain table at one w; XYZ of `light`, or as printed, linear RGB, when `light` is NULL.
bool rainbow_table(struct table *t, const struct rainbow *r, const struct spectrum *light, double w,
                   int n, double range, int power, struct err *e);
