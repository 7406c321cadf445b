// end_to_end.h - a simulated laboratory in a folder: a rig, its calibration shots, its records, and
// what any sample shows it. Everything is made by nacre's own commands, as a user would type them.
#pragma once
#include "core/err.h"

enum { E2E_FILTERS = 5 };
extern const int e2e_filter_nm[E2E_FILTERS];

struct e2e_sample {
    const char *name;
    const char *sample;   // of the simulator's scene
    double size_m;        // side of a plane, diameter of a disc
    double r0;            // power reflectance at normal incidence
    const char *geometry; // further options of nacre calib geometry
    const char *shape;    // of the rendered scene
    double range;         // of the table
    double irradiance;    // of the LED, W m^-2: attenuated for samples that mirror it
};

// Runs "nacre <words>" in the folder; an error when it fails. *wall_s grows by what it took.
bool e2e_do(const char *folder, double *wall_s, struct err *e, const char *fmt, ...)
    __attribute__((format(printf, 4, 5)));

// lens.yaml, light.yaml, flat.yaml, f440.yaml ..: from photographs of boards, mirror balls and an
// even wall by the simulated camera, with all its noise.
bool e2e_calibrate(const char *folder, double *wall_s, struct err *e);

// The session NAME.s through all filters, and the same merged: NAME-f440.exr ..
bool e2e_capture(const char *folder, const struct e2e_sample *s, double *wall_s, struct err *e);
bool e2e_merge(const char *folder, const struct e2e_sample *s, double *wall_s, struct err *e);
// NAME-ideal-f440.exr ..: what a camera without noise, blur, glare and vignetting would see.
bool e2e_ideal(const char *folder, const struct e2e_sample *s, struct err *e);

// What an eye elsewhere sees under the light elsewhere: NAME-eye.yaml for the simulator,
// NAME-scene.yaml for the renderer.
bool e2e_eye(const char *folder, const struct e2e_sample *s, struct err *e);
