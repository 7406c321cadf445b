// tables.h - diffraction tables over (u, v, w) from a height field (D14, D16, S13; physics 4).
//
// XYZ(u, v, w) = K sum over wavelengths of P cmf |S|^2, normalised on a mirror (a flat field has
// the light's XYZ at h = (0, 0, w)), kept as a few tables over (u, v) with one curve in w each.
// meta tells what was done and "nacre.error_l2": the relative L2 error, over all nodes and the
// whole range of w, when only the first 1, 2, .. tables are used. Between nodes bilinear look-up
// adds "nacre.error_between", and "nacre.error_between_away" outside the mirror's lobe, where the
// share "nacre.light_away" of the light goes.
#pragma once
#include "core/hfield.h"
#include "core/spectrum.h"
#include "core/table.h"
#include "process/patch.h"
#include <stddef.h>

struct tables_spec {
    enum window window;
    double coherence_m;           // patch = four sigma
    int repeat[2];                // copies of the field in x and y (S13 2.7); 1, 1
    const struct spectrum *light; // not owned
    double step_m;                // of wavelength
    bool absolute;                // times area of coherence / lambda^2
    double range;
    int n, power; // nodes: table_nodes_check(); n 0: so many that look-up between them meets
                  // tolerance too, power is then chosen
    enum table_basis basis;
    double w_min, w_max;
    int count;        // tables; 0: the least that meets tolerance
    double tolerance; // relative L2 error
    size_t memory;    // bytes for all that is large
};

enum { TABLES_MAX = 85 }; // 3 channels each in a picture of at most 256

bool tables_make(struct table *t, const struct tables_spec *s, const struct hfield *hf,
                 struct err *e);
