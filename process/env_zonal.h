// env_zonal.h - what a light's angle does to its weight, and that weight as few products.
//
// With h = wi + wo, q = (h.t)^2 + (h.b)^2 and w = h.n, the zonal weight of docs/optics.md is a
// function of 1 + wi.wo = |h|^2 / 2 = (q + w^2) / 2. As a polynomial in w, w = i_n + o_n makes it a
// sum of products f(wi) k(h_t, h_b) g(wo), each one plane convolution; for constant Fresnel
// Z = q^2/4 + q w^2/2 + w^4/4: nine products, exact, with five different f and five different g.
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
    double *coef; // [count][n][degree + 1], owned; NULL for a plain table and constant Fresnel
    double error; // largest found: of Z relative to Z or to Z(1)/1000, whichever is larger
};

// The lowest degree whose error is at most `tolerance`; ERR_DATA names the best one that can be
// had when none up to ZONAL_MOST is.
bool zonal_fit(struct zonal *z, const struct table *t, const struct fresnel *f, double tolerance,
               struct err *e);
void zonal_finish(struct zonal *z);
double zonal_coef(const struct zonal *z, int m, double q, int k);
bool zonal_uses(const struct zonal *z, int m, int k); // false: that coefficient is 0 everywhere
