// lut.h - the diffraction table from one photograph (T17 section 4, eq. 15; docs/lut.md).
//
//   S_d(h) = 1 / (4 pi^2 F0^2) * integral (lm/l)^e Lm(h lm/l) P(l) cmf(l) dl
//
// with P scaled so that the integral of P ybar is 1, and Lm the pattern, taken at wavelength lm.
// The shader then has f_diffraction = 4 pi^2 F^2 G S_d(h.t, h.b) (T17 eq. 10). Since l only scales
// the radius, the integral is a correlation along the logarithm of the radius: LUT_EXACT.
#pragma once
#include "core/spectrum.h"
#include "core/table.h"
#include "process/logpolar.h"
#include "process/lut_filters.h"
#include "process/lut_pattern.h"

enum lut_method {
    LUT_AUTO,    // the fastest that keeps the tolerance
    LUT_EXACT,   // log-radius resampling, one correlation per ray, resampling
    LUT_SAMPLED, // per node a sum over wavelengths, cubic B-spline
    LUT_FLOOR,   // T17's released program: 81 wavelengths, the pixel to the lower left
};

struct lut_request {
    const struct lut_pattern *pattern;
    double lambda_m; // of the pattern, 380..780 nm
    const struct spectrum *light;
    double f0;       // F at normal incidence, > 0
    double exponent; // e: 2 reflectance patterns (T17 eq. 15), 4 shallow phase gratings (eq. 8)
    int n;           // nodes, range and power of the table
    double range;
    int power;
    bool is_rgb; // linear sRGB in place of XYZ
    enum lut_method method;
    double tolerance; // wanted relative L2 error
    int wavelengths;  // LUT_SAMPLED: 2 or more, 0: by the tolerance
    // The photograph's filter x light x channel over wavelength, to be undone (LUT_EXACT); or NULL.
    const struct spectrum *band;
    double noise_limit; // of undoing it: noise may grow by this factor, > 1
    // One of several photographs: the table is its part of the sum (lut_filters_add), and is not
    // cut off at what no pattern can be below. NULL: the photograph stands alone.
    const struct lut_filters *filters;
    int filter;
};

// What was done and what it cost.
struct lut_report {
    enum lut_method method;
    char why[160];           // why this method, for a person
    int wavelengths;         // LUT_SAMPLED, LUT_FLOOR
    double skipped_band;     // the share of 380..780 nm where P cmf is nothing
    struct lp_stats skipped; // LUT_EXACT: what of the pattern is empty
    double uncovered;        // share of nodes whose band leaves what the photograph saw
    double noise_gain;       // of undoing the band
    double seconds;
};

// The table has cover, and sigma when the pattern has its variance. ERR_DATA for impossible
// requests; t untouched on failure. Same bytes for any number of threads.
bool lut_build(const struct lut_request *r, struct table *t, struct lut_report *report,
               struct err *e);
// The one wavelength that a photograph through this band is nearest to: the centre of the band in
// ln(lambda), as the pattern weighs it.
double lut_effective_wavelength(const struct spectrum *band, double exponent);

// The exponent e of a sample from two of its patterns at two wavelengths, and its standard error.
// ERR_DATA when the wavelengths are too close or the orders too weak to tell.
bool lut_exponent(const struct lut_pattern *a, double lambda_a_m, const struct lut_pattern *b,
                  double lambda_b_m, double *exponent, double *sigma, struct err *e);

// Wavelengths that the sampled method needs for a tolerance.
int lut_sampled_wavelengths(double tolerance);

const char *lut_method_name(enum lut_method m);
