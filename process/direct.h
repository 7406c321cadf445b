// direct.h - XYZ at single points by direct summation in double: no FFT, no interpolation.
//
// The definition of docs/tables.md and nothing else, for `nacre eval --reference`; costs nodes
// times wavelengths for every point (points that share a w also share the phases of the heights).
#pragma once
#include "core/hfield.h"
#include "process/patch.h"
#include "process/spectral.h"

struct direct {
    const struct hfield *heights;
    const struct spectral *light;
    enum window window;
    double coherence_m;
    int repeat[2];
    bool absolute;
};

// point[n][3] = u, v, w to xyz[n][3]. ERR_DATA: a node that was not measured; ERR_FILE: no memory.
bool direct_xyz(const struct direct *d, int n, const double (*point)[3], double (*xyz)[3],
                struct err *e);
