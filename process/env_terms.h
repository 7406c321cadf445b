// env_terms.h - the zonal weight as a sum of products, each of which is one plane convolution.
//
//   Z(wi.wo) S(h) = sum over terms of weight  pre(wi)  kernel(h) S(h)  post(wo)
// Two ways to have one:
// - polynomial: Z is a function of q = u^2 + v^2 and w = i_n + o_n (env_zonal.h); as a polynomial
//   in w its kernels are functions of q, and (i_n + o_n)^k splits into products. Constant Fresnel:
//   nine terms, exact, of five pre and five post functions - ten transforms for nine products.
// - products: the best sum of so many f(wi) g(wo) over the pairs of directions that the table
//   allows, as singular values would have it if all pairs were allowed. One kernel.
#pragma once
#include "process/env_zonal.h"

enum { TERMS_MOST = 16, POLY_MOST = 12 };

// A function of directions: sum of even[i][j] t^i b^j + n sum of odd[i][j] t^i b^j, i + j <=
// degree.
struct direction_poly {
    int degree;
    double even[POLY_MOST + 1][POLY_MOST + 1], odd[POLY_MOST + 1][POLY_MOST + 1];
};

// The polynomials in t that it is at one b: even[0..degree], odd[0..degree].
void direction_poly_row(const struct direction_poly *p, double b, double *even, double *odd);
struct direction_poly direction_poly_power(int k); // n^k

struct env_term {
    int pre, kernel, post;
    double weight;
};

struct env_terms {
    int n_pre, n_kernel, n_post, n;
    struct direction_poly *pre, *post; // owned
    struct env_term *term;             // [n], by post; owned
    struct zonal zonal;                // coefficient k is the function of q of kernel k
    double error; // polynomial: largest, relative to Z or Z(1)/1000; products: rms relative to Z(1)
};

bool env_terms_polynomial(struct env_terms *t, const struct table *table, const struct fresnel *f,
                          double tolerance, struct err *e);
// Plain tables; 1 to TERMS_MOST products, fewer by one where that many are not a whole set.
bool env_terms_products(struct env_terms *t, const struct table *table, const struct fresnel *f,
                        int products, struct err *e);
void env_terms_finish(struct env_terms *t); // accepts a zeroed struct
