// roughness.h - height parameters of a surface (ISO 25178-2: Sq, Sa, Sp, Sv, Sz, Ssk, Sku).
#pragma once
#include "core/hfield.h"

struct roughness {
    double mean_m;     // what all others are measured from
    double sq_m, sa_m; // root mean square and mean magnitude of the heights
    double sp_m, sv_m; // highest peak, deepest pit, both >= 0
    double sz_m;       // sp + sv
    double ssk, sku;   // mean third and fourth power over sq^3, sq^4; NAN when flat
};

// Over the measured nodes, about their mean: level first, as the standard does. ERR_DATA when
// nothing is measured.
bool hfield_roughness(struct roughness *r, const struct hfield *hf, struct err *e);
