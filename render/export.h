// export.h - a diffraction material in the formats of other renderers, each with what it loses.
//
// `loss` is filled with a sentence for people and with the error of rendering from the file instead
// of the table: relative L2 of f cos over pairs of directions whose half vectors fill the table's
// range. Both also stand in the file, or beside it where the format has no room.
#pragma once
#include "render/material.h"

struct export_loss {
    char what[400];
    double error; // relative L2
};

// RGL's tensor file (Dupuy and Jakob 2018), RGB: incident directions phi_i x theta_i, half vectors
// on resolution x resolution nodes. `phis` > 2, `thetas` > 1.
struct export_bsdf {
    int phis, thetas, resolution;
};
bool export_bsdf(const struct material *m, const struct export_bsdf *how, const char *path,
                 struct export_loss *loss, struct err *e);

// MERL's binary (Matusik et al. 2003) holds isotropic materials: the slice whose half vectors lie
// at `azimuth_rad` from t. The loss goes to path.txt.
bool export_merl(const struct material *m, double azimuth_rad, const char *path,
                 struct export_loss *loss, struct err *e);

// A GLSL function, and the table beside it as a .pfm to be loaded as its texture.
bool export_glsl(const struct material *m, const char *path, struct export_loss *loss,
                 struct err *e);

// f cos_o as an exported file gives it.
typedef void export_eval(const void *file, struct vec3 wi, struct vec3 wo, double out[3]);
double export_error(const struct material *m, export_eval *eval, const void *file);
