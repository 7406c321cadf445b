// rig.h - a rig file: which camera, lights and filters there are, and what is known about them.
//
// Radiometry  counts = black + responsivity * gain * exposure_s * L, L the radiance in the passband
//             in W sr^-1 m^-2, and L = f E with E = rig_irradiance(): the light's irradiance at the
//             sample times the filter's throughput (its own share of the light, and what glass
//             loses). A camera without a known responsivity has 0: results are then relative.
// Passbands   a centre and a full width at half maximum (a Gaussian), or a CSV of two columns
//             "nm,value" whose path is relative to the rig file and does not leave its folder.
// Units       SI.
#pragma once
#include "core/err.h"
#include "core/spectrum.h"
#include <stdbool.h>
#include <stdint.h>

struct rig_band {
    double centre_m, fwhm_m; // 0 when csv is set, or when nothing is known
    char *csv;               // path below the rig's folder, owned; or NULL
    int line;                // of the rig file, where it is described
};

struct rig_light {
    char *name;
    int line;          // of the lights' trigger
    double irradiance; // W m^-2 at the sample, over the whole spectrum; 0: not known
    struct rig_band band;
    double max_on_s;      // nacre-lights switches it off after this
    double max_duty;      // longest share of the time that it may be on, 0 to 1
    double lead_s, lag_s; // on before the exposure, off after it; negative: inside the exposure
};

struct rig_filter {
    char *name;
    int position;      // state of the filters' trigger
    double throughput; // 0 to 1, 1 when not given
    struct rig_band band;
};

struct rig {
    char *path; // as given
    char *name, *sample;
    struct {
        char *uri;
        double gain;         // 1 is the base
        double focus_per_m;  // dioptres; NAN: leave it
        double responsivity; // counts s^-1 per W sr^-1 m^-2 at gain 1; 0: not known
        double black;        // counts; NAN: ask the camera
        int bits;            // 0: ask the camera
        struct rig_band band;
    } camera;
    char *lights_uri;  // NULL: the light is always on
    char *filters_uri; // NULL: no filter is ever changed
    int n_lights, n_filters;
    struct rig_light *light;   // [n_lights], owned
    struct rig_filter *filter; // [n_filters], owned
};

bool rig_open(struct rig *rig, const char *path, struct err *e);
void rig_finish(struct rig *rig); // accepts a zeroed struct

int rig_light_index(const struct rig *rig, const char *name);  // -1: none
int rig_filter_index(const struct rig *rig, const char *name); // -1: none

// E in W m^-2; filter -1 means none. 0 when it is not known.
double rig_irradiance(const struct rig *rig, int light, int filter);

// The product light x filter x camera over wavelength, peak 1; either index may be -1 for none.
// Sampled at 1 nm, 300 to 1100 nm. ERR_DATA when the product is zero everywhere.
bool rig_spectrum(const struct rig *rig, int light, int filter, struct spectrum *s, struct err *e);

// Its centroid and the standard deviation about it; false also when nothing is known (no bands).
bool rig_wavelength(const struct rig *rig, int light, int filter, double *centre_m, double *sigma_m,
                    struct err *e);

// A URI with "@run" and "@rig" replaced; allocated.
char *rig_uri(const struct rig *rig, const char *uri, const char *run);

// Copies the rig file, byte for byte, to folder/rig.yaml with every CSV it names beside it.
bool rig_copy(const struct rig *rig, const char *folder, struct err *e);
