// env_zonal.h - what the angle between light and viewer does: the zonal weight, and as polynomials.
//
// With h = wi + wo, q = (h.t)^2 + (h.b)^2 and w = h.n, the zonal weight of docs/optics.md is a
// function of 1 + wi.wo = |h|^2 / 2 = (q + w^2) / 2; for constant Fresnel it is the polynomial
// Z = q^2/4 + q w^2/2 + w^4/4 in w, for others a polynomial in w comes as near as is asked for.
#pragma once
#include "core/table.h"

struct fresnel {
    bool schlick; // else constant
    double r0;    // power reflectance at normal incidence, 0 < r0 <= 1
};

// Z = F^2/F0^2 (1 + x)^2, x = wi.wo.
double zonal_weight(const struct fresnel *f, double x);

// What table m of a set is multiplied with, next to 4 pi^2 / o_n: Z for a plain table S_d, and
// Z B_m(w) / (4 pi^2 w^2) for tables over w (docs/optics.md: f = F^2 G / (F0^2 w^2) XYZ).
double zonal_target(const struct table *t, const struct fresnel *f, int m, double q, double w);

enum { ZONAL_MOST = 12 };

// Polynomials in w: coefficient of w^k for table m at (q), tabulated over sqrt(q).
struct zonal {
    int degree, count, n; // count tables, n values of sqrt(q) from 0 to h_max
    double h_max;
    double *coef; // [count][n][degree + 1], owned; NULL when the one above is exact
    double error; // largest found: relative to the weight or 1/1000 of the largest, whichever is
                  // larger
};

// Tables over w: relative to the weight of the set's largest table, and with less strictness where
// light and viewer both graze (w < 0.5), where 1/w^2 is no polynomial.
//
// The lowest degree whose error is at most `tolerance`; ERR_DATA names the best one that can be
// had when none up to ZONAL_MOST is.
bool zonal_fit(struct zonal *z, const struct table *t, const struct fresnel *f, double tolerance,
               struct err *e);
void zonal_one(struct zonal *z); // degree 0, 1 everywhere: a plain table as it is
void zonal_finish(struct zonal *z);
double zonal_coef(const struct zonal *z, int m, double q, int k);
bool zonal_uses(const struct zonal *z, int k); // false: that coefficient is 0 everywhere
