// geometry.h - what every pixel of a calibrated rig looks at: the geometry record.
//
// From the lens, the plane of the sample and the light's position: for the point x that a pixel
// sees, wi = (L - x) / |L - x|, wo = (C - x) / |C - x|, h = wi + wo in the sample's frame, without
// small angles. Channels, NAN where the sample is not seen:
//   u, v, w   h.t, h.b, h.n
//   weight    turns L / E into the Lm of a table: 1 / (G F^2/F0^2 e), G = (1 + wi.wo)^2 /
//             (cos_i cos_o), e the irradiance at x over the one at the origin: cos_i, 1/r^2, beam
//   cos_i, cos_o
//   omega     solid angle of the pixel, sr
#pragma once
#include "calib/lens.h"
#include "core/image.h"

struct geometry_options {
    struct vec3 light_m; // in camera coordinates
    double turn_rad;     // of the sample on the board, from t towards b
    double size_m[2];    // of the sample about the origin along t and b; NAN: no end
    bool radial;         // of a disc t runs outwards; size_m[0] is its diameter
    double hub_m;        // of a disc: inside this radius nothing is seen
    double beam;         // radiant intensity falls as cos^beam about the axis to the origin
    double r0;           // F0^2 of the sample
    bool schlick;        // F^2 = R0 + (1 - R0) (1 - cos)^5; else constant
};

// ERR_DATA when the light is behind the sample or no pixel sees it.
bool geometry_of(const struct lens *l, const struct geometry_options *o, struct image *out,
                 struct err *e);
