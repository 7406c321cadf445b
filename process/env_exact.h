// env_exact.h - light off a diffracting plane under an environment, as plane convolutions.
//
// In direction cosines of the frame (t, b, n), docs/optics.md:
//   L_o(o) = (4 pi^2 / o_n) integral Z(wi.wo) S(i_t + o_t, i_b + o_b) L(i) dsolid_angle
// is a convolution but for the zonal weight, which is a short sum of products (env_terms.h). No
// term is singular: light enters as power (radiance times solid angle), so 1/i_n never appears.
// Holds for every o up to the rim of the disk and for every orientation.
#pragma once
#include "process/env_light.h"

// An N x N map over (o_t, o_b) in the light's frame: pixel (i, j) is o_t = 2i/(N-1) - 1,
// o_b = 2j/(N-1) - 1; 0 outside the unit disk and the light's window. `out` is made here. Kernel
// and light must agree on grid and terms. A camera that moves only looks up other pixels.
bool env_exact_map(const struct env_kernel *k, const struct env_light *l, int n, struct image *out,
                   struct err *e);

// All of it for one frame and the whole disk.
bool env_exact(const struct env_kernel *k, const struct environment *env, const struct frame *f,
               int n, struct image *out, struct err *e);

// The nodes of such a map.
static inline double env_map_cosine(int i, int n)
{
    return 2.0 * i / (n - 1) - 1;
}
