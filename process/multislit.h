// multislit.h - the analytic grating: equal slits (T17 eq. 16), in a row or turned about the
// normal.
//
//     I(u, lambda) = (sin(pi a u / l) / (pi a u / l))^2 (sin(pi N d u / l) / (N sin(pi d u / l)))^2
// is 1 at u = 0. The table is S_d of T17 eq. 12, sum of I P cmf / l^2, scaled so that Y = 1 at h =
// 0; or, `absolute`, so that 4 pi^2 F^2 G S_d is the reflectance of a row whose lobe across is
// known.
#pragma once
#include "core/image.h"
#include "core/spectrum.h"
#include "core/table.h"

struct multislit {
    double pitch_m, width_m;
    int count;        // slits lit at once
    double turn_rad;  // of the row's direction, from u towards v
    bool radial;      // |(u, v)| in the place of u: the row turned to all directions
    double window[2]; // Gaussian in (u, v) along and across the row, rms; 0: none (T17 6.1)
    double exponent;  // of 1 / lambda: 2 in T17 eq. 12
    bool absolute;    // needs window[1]: the lobe across
};

// I(u, lambda), also where numerator and denominator vanish together.
double multislit_power(const struct multislit *s, double u, double lambda_m);

// |P|^2 / (lambda A) of a row in the mirror direction, A its whole length: N a^2 / (d lambda).
double multislit_peak(const struct multislit *s, double lambda_m);

// Step of the wavelength sum that resolves the lobes up to |u|.
double multislit_step(const struct multislit *s, double u);

// ERR_DATA: pitch, width (over 0, at most the pitch), count, window; a light without power.
bool multislit_table(struct table *t, const struct multislit *s, const struct spectrum *light,
                     double step_m, int n, double range, int power, struct err *e);

// Multiplies the table with a picture that covers it: its first channel, bilinear; the middle of
// the first pixel is (-R, -R).
void table_mask(struct table *t, const struct image *mask);
