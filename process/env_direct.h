// env_direct.h - light off a diffracting plane by full integration over the hemisphere: the judge.
//
// For each direction o the sum over all parts of the environment, in double, of
//   4 pi^2 / o_n  Z(wi.wo) S(i_t + o_t, i_b + o_b[, w])  radiance  solid angle
// with nothing approximated but the size of the parts. Slow: minutes for a map of 100 x 100.
#pragma once
#include "process/env_zonal.h"
#include "process/environment.h"

// n directions by their cosines o[n][2]; rgb[n][3], 0 at and beyond the rim of the disk.
bool env_direct(const struct table *rgb_table, const struct fresnel *f,
                const struct environment *env, const struct frame *frame, int n,
                const double (*o)[2], double (*rgb)[3], struct err *e);

// The map of env_exact.h.
bool env_direct_map(const struct table *rgb_table, const struct fresnel *f,
                    const struct environment *env, const struct frame *frame, int n,
                    struct image *out, struct err *e);
