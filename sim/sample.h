// sample.h - a surface as light sees it: a complex reflectance on a lattice, perhaps rough.
//
// r(x, y; q) = amplitude * exp(2 pi i q height), q = w / lambda: a phase (heights), an amplitude (a
// mask of pixels), or both, so that both wavelength exponents of docs/optics.md occur. The cell of
// the lattice is shapes on a ground, whose Fourier coefficients are closed forms, or a map of
// nodes (summed directly). What a camera sees is the mean over places of the coherence window: an
// incoherent sum of orders, each with the window's lobe, widened by the roughness.
#pragma once
#include "core/hfield.h"
#include "core/yaml.h"
#include <complex.h>

// A parallelogram of the cell, in parts of the cell; it may reach over the cell's edge.
struct shape {
    double s0, s1, t0, t1;
    double shear;            // s moves by shear * (t - t0)
    double amplitude;        // of the reflectance, 0 to 1
    double height_m, rise_m; // at s0, and what it grows by until s1
};

enum sample_layout { SAMPLE_PLANE, SAMPLE_DISC, SAMPLE_CYLINDER };

struct sample {
    char kind[24];
    double turn_rad;               // of the lattice, from t towards b
    double period_x_m, period_y_m; // period_y_m INFINITY: nothing varies along y
    double ground;                 // amplitude where no shape is; its height is 0
    int n_shapes;
    struct shape *shape;                // [n_shapes], owned
    struct hfield map;                  // nodes of one cell; z NULL: the cell is made of shapes
    double rough_rms_m, rough_length_m; // normal heights, correlation exp(-r^2 / length^2)
    double coherence_m;                 // patch; the window is a Gaussian of sigma = patch / 4
    double r0;                          // power reflectance at normal incidence, F0^2
    bool schlick;                       // false: the same at every angle
    enum sample_layout layout;          // how the frame (t, b, n) runs over the sample
    double bend_radius_m;               // of the cylinder
    double hub_m;                       // of the disc: inside it nothing reflects
    double stripe_m, stripe_duty;       // mask: stripes along b that show the sample; 0: no mask
};

// Reads the map `sample:`; heights of kind "height" come from a file beside `path`.
bool sample_read(struct sample *s, struct ynode *map, const char *path, struct err *e);
void sample_finish(struct sample *s); // accepts a zeroed struct

void sample_height_range(const struct sample *s, double *lo_m, double *hi_m); // of the whole cell

// Power reflectance F^2 for a half-angle: cos theta_d = |h| / 2 (docs/optics.md).
double sample_fresnel(const struct sample *s, double cos_d);

// Amplitude of order (m, n): the Fourier coefficient of the cell, direct and in double.
double complex sample_order(const struct sample *s, int m, int n, double q);
// The same for all of m in [-m_max, m_max], n in [-n_max, n_max]: out[2 n_max + 1][2 m_max + 1].
void sample_orders(const struct sample *s, double q, int m_max, int n_max, double complex *out);
// r at a place of the lattice (shapes only), for tests by direct summation.
double complex sample_reflectance(const struct sample *s, double x_m, double y_m, double q);

// Height and amplitude at a place of the sample, its turn included; between a map's nodes bilinear.
double sample_height(const struct sample *s, double x_m, double y_m, double *amplitude);
