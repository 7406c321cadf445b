// spectrum.h - spectra sampled over wavelength, the CIE 1931 observer, illuminants, sRGB.
//
// Wavelengths in metres, rising. Between samples a spectrum is linear, outside it is 0.
#pragma once
#include "core/err.h"

struct spectrum {
    int n;            // samples, >= 2
    double *lambda_m; // [n] rising, owned
    double *value;    // [n], owned
};

enum {
    CIE_FIRST_NM = 380,
    CIE_LAST_NM = 780,
    CIE_STEP_NM = 5
}; // the range every integral runs over

void spectrum_finish(struct spectrum *s); // accepts a zeroed struct
double spectrum_at(const struct spectrum *s, double lambda_m);

// Two columns "nm,value"; '#' comments and one header line allowed. ERR_DATA names file and line
// for unsorted, missing or non-finite rows, negative power, fewer than two rows.
bool spectrum_read_csv(struct spectrum *s, const char *path, struct err *e);

// E, A, D50, D65, F1, F2, F11, inverse-A ("inverse incandescent", T17 fig. 15), or the path of a
// CSV file. ERR_DATA names the known ones when `name` is neither.
bool illuminant_get(struct spectrum *s, const char *name, struct err *e);
extern const char illuminant_names[]; // "E A D50 D65 F1 F2 F11 inverse-A"

// xbar, ybar, zbar of the 2 degree observer, linear between the 5 nm rows; 0 outside 380..780 nm.
void cie_xyz(double lambda_m, double xyz[3]);

// Factor that scales a spectrum so that the integral of P ybar over 380..780 nm is 1, integrating
// the piecewise-linear product exactly; 0 when the spectrum has no luminance.
double illuminant_scale(const struct spectrum *s);

// IEC 61966-2-1, D65, linear; may go negative. srgb_encode clips to 0..1 and applies the curve.
void xyz_to_rgb(const double xyz[3], double rgb[3]);
void rgb_to_xyz(const double rgb[3], double xyz[3]);
double srgb_encode(double linear);
double srgb_decode(double encoded);
