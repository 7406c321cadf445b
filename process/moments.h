// moments.h - windowed transforms of the Chebyshev polynomials of a height field.
//
// exp(i z x) = J_0(z) + 2 sum i^k J_k(z) T_k(x) (Jacobi and Anger), and heights enter |S|^2 only
// through z x with z = 2 pi (w / lambda) half: so the transforms
//     M_k(fx, fy) = sum over nodes of g T_k(x) exp(-i 2 pi (fx i + fy j)),  k < count,
// of real fields hold every wavelength and every w at once, and M_k(-f) = conj M_k(f) halves them.
// (It is the Chebyshev fit over q = w / lambda of physics section 4 with the roles of q and x
// exchanged: as many terms, but closed coefficients and half of each transform.)
//
// Only the bins that somebody reads are kept: the band of the wanted frequencies, TAPS wide.
#pragma once
#include "process/patch.h"
#include "process/taps.h"
#include <stddef.h>

// The bins of one axis that are kept, in slots without gaps; a run of TAPS bins stays a run.
struct bins {
    int fine;  // length of the padded transform
    int kept;  // slots
    int *slot; // [2 fine] by bin, -1 when not kept; owned
};

void bins_init(struct bins *b, int nodes); // none kept
void bins_need(struct bins *b, int first); // keep the TAPS bins from taps_first() on
void bins_close(struct bins *b);           // number the slots
int bins_slot(const struct bins *b, int first);
void bins_finish(struct bins *b);

struct moments {
    int count;     // polynomials T_0 .. T_count-1: even ones first, then odd ones
    int evens;     // of them even
    struct bins x; // 0 <= fx <= 0.5 and its rim, set by the caller, closed
    struct bins y; // set by the caller, closed
    float *value;  // [x.kept][y.kept][2: re, im][count], owned
};

// Bytes moments_fill() needs, scratch included, on this many threads.
size_t moments_bytes(const struct patch *p, int count, int cols, int rows);

// Fills value for the bins in x and y. ERR_FILE when memory does not hold it.
bool moments_fill(struct moments *m, const struct patch *p, int count, struct err *e);
void moments_finish(struct moments *m); // bins too; accepts a zeroed struct
