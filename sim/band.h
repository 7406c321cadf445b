// band.h - what light a photograph is made of: wavelengths with weights, and how strong it is.
//
// Light spectrum x filter x camera channel as a rig states them. The weights of the most sensitive
// channel add up to 1, so that counts = black + responsivity * exposure * f * irradiance holds for
// it.
#pragma once
#include "core/rig.h"
#include "core/spectrum.h"

enum { BAND_CHANNELS = 3 };

struct band {
    int n;
    double *lambda_m;  // [n], owned
    double *weight;    // [n][3], owned; mono: all three alike
    double irradiance; // E of the light through the filter at the sample's origin, W m^-2
};

// From a rig's light and filter (-1: none); of a light without a stated irradiance it is 1.
bool band_of_rig(struct band *b, const struct rig *rig, int light, int filter, bool bayer,
                 struct err *e);
// A Gaussian of this full width at half maximum.
bool band_gaussian(struct band *b, double centre_m, double fwhm_m, double irradiance, bool bayer,
                   struct err *e);
// Another light as an eye sees it: linear sRGB by the CIE observer, of a light whose luminance is
// 1. Two wavelengths a lobe of the finest pattern: every 1.25 nm.
bool band_of_eye(struct band *b, const struct spectrum *illuminant, struct err *e);
void band_finish(struct band *b); // accepts a zeroed struct
