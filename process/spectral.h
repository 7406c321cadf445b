// spectral.h - the wavelengths an integral runs over, with the colour each one adds.
//
// The sum is D16's: trapezoidal over 380..780 nm in equal steps, 5 nm unless asked otherwise. It is
// normalised on the mirror: the weights of Y add up to 1, so |S|^2 = 1 gives the light's own XYZ.
#pragma once
#include "core/spectrum.h"

struct spectral {
    int n;               // wavelengths that have weight
    double *lambda_m;    // [n] rising, owned
    double (*weight)[3]; // [n] X, Y, Z per unit |S|^2, owned
};

// ERR_DATA: step not in 0.01..100 nm, or a light without power on the samples.
bool spectral_init(struct spectral *s, const struct spectrum *light, double step_m, struct err *e);
void spectral_finish(struct spectral *s); // accepts a zeroed struct
