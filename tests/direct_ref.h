// direct_ref.h - the judge of the tables: the definition summed in double, node by node.
//
// Shares nothing with process/ but the light's values: physics section 4 written down.
#pragma once
#include "core/hfield.h"
#include "core/spectrum.h"
#include <math.h>

// XYZ(u, v, w) = K sum P cmf |S|^2, trapezoidal over 380..780 nm; repeat = copies of the field;
// sigma 0: an even window. area: also times (area of coherence) / lambda^2.
static inline void direct_ref(const struct hfield *hf, const struct spectrum *light, double step_m,
                              double sigma_m, const int repeat[2], bool absolute,
                              const double at[3], double xyz[3])
{
    const double pi2 = 6.283185307179586;
    const int nx = hf->nx * repeat[0], ny = hf->ny * repeat[1];
    double *gx = malloc((size_t)nx * sizeof *gx), *gy = malloc((size_t)ny * sizeof *gy);
    double sum_x = 0, sum_y = 0, square_x = 0, square_y = 0, luminance = 0;
    for (int i = 0; i < nx; i++) { // every copy has the window of its own field
        const double x = (i % hf->nx - 0.5 * (hf->nx - 1)) * hf->dx_m / sigma_m;
        sum_x += gx[i] = sigma_m > 0 ? exp(-x * x / 2) : 1;
        square_x += gx[i] * gx[i];
    }
    for (int j = 0; j < ny; j++) {
        const double y = (j % hf->ny - 0.5 * (hf->ny - 1)) * hf->dy_m / sigma_m;
        sum_y += gy[j] = sigma_m > 0 ? exp(-y * y / 2) : 1;
        square_y += gy[j] * gy[j];
    }
    const double area = sum_x * sum_x / square_x * sum_y * sum_y / square_y * hf->dx_m * hf->dy_m;
    xyz[0] = xyz[1] = xyz[2] = 0;
    const int steps = (int)lrint(400e-9 / step_m);
    for (int k = 0; k <= steps; k++) {
        const double lambda_m = 380e-9 + k * step_m;
        double cmf[3], re = 0, im = 0;
        cie_xyz(lambda_m, cmf);
        for (int j = 0; j < ny; j++)
            for (int i = 0; i < nx; i++) {
                const double h = hf->z[(j % hf->ny) * hf->nx + i % hf->nx];
                const double phase =
                    pi2 / lambda_m * (at[2] * h - at[0] * i * hf->dx_m - at[1] * j * hf->dy_m);
                re += gx[i] * gy[j] * cos(phase);
                im += gx[i] * gy[j] * sin(phase);
            }
        const double power = (re * re + im * im) / (sum_x * sum_x * sum_y * sum_y);
        const double p = spectrum_at(light, lambda_m) * (k == 0 || k == steps ? 0.5 : 1);
        luminance += p * cmf[1];
        for (int c = 0; c < 3; c++)
            xyz[c] += p * cmf[c] * power * (absolute ? area / (lambda_m * lambda_m) : 1);
    }
    for (int c = 0; c < 3; c++)
        xyz[c] /= luminance;
    free(gx);
    free(gy);
}
