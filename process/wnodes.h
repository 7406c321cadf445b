// wnodes.h - polynomials in w through Gauss-Legendre nodes.
//
// Everything a basis over w needs is a small matrix that acts on samples at these nodes: integrals
// (exact for products of two interpolating polynomials), Chebyshev coefficients, values elsewhere.
#pragma once

struct wnodes {
    int n;
    double lo, hi;
    double *w;      // [n] rising, owned
    double *weight; // [n] of the mean over lo..hi: they add up to 1, owned
    double *bary;   // [n] barycentric, owned
};

void wnodes_init(struct wnodes *q, int n, double lo, double hi);
void wnodes_finish(struct wnodes *q); // accepts a zeroed struct

// row[n]: the interpolating polynomial's value at w is the sum of row[k] times sample k.
void wnodes_at(const struct wnodes *q, double w, double *row);

// c[n][n]: its Chebyshev coefficient m over lo..hi is the sum of c[m][k] times sample k.
void wnodes_chebyshev(const struct wnodes *q, double *c);
