// farfield.h - the far field of a sample: how much light goes to (u, v) at one wavelength.
//
// With F^2 and G of the BRDF aside, f = F^2 G / w^2 * D(u, v, w; lambda),
//     D = 1 / lambda^2 * sum over orders of |c_mn(w / lambda)|^2 lobe((u, v) / lambda - k_mn),
// where every lobe has the integral 1 over spatial frequency, so that a flat sample returns F^2.
#pragma once
#include "sim/sample.h"

// D directly: coefficients summed anew for every call, in double. The judge of struct farfield.
double farfield_ref(const struct sample *s, double u, double v, double w, double lambda_m);

// The same from |c_mn|^2 held at Chebyshev nodes of q. In q they are band-limited by the heights'
// span, so that the node count makes the polynomial through them exact to 1e-9 of the largest.
struct farfield {
    const struct sample *sample; // not owned; outlives the pattern
    int m_max, n_max;
    int n_q;
    double q_mid, q_half;
    double *node, *weight; // [n_q] Chebyshev nodes in -1..1 and barycentric weights, owned
    double *power;         // [2 n_max + 1][2 m_max + 1][n_q], owned
};

struct farfield_range {
    double h_max; // |(u, v)| that is asked for, at most 2
    double lambda_min_m, lambda_max_m;
    double w_min, w_max;
};

bool farfield_init(struct farfield *p, const struct sample *s, const struct farfield_range *r,
                   struct err *e);
void farfield_finish(struct farfield *p); // accepts a zeroed struct
double farfield_at(const struct farfield *p, double u, double v, double w, double lambda_m);

// |c_mn|^2 at q, from the table.
double farfield_order(const struct farfield *f, int m, int n, double q);
