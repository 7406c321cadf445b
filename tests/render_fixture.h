// render_fixture.h - tables and scenes in memory for the tests of render/.
#pragma once
#include "core/spectrum.h"
#include "core/table.h"
#include <math.h>

// S_d (XYZ) of a crossed grating that reflects: lobes of width sigma at multiples of lambda /
// pitch, with the envelopes of slits, under illuminant E (T17 eq. 15 on a sum of Gaussian lobes).
static inline bool fixture_lcd(struct table *t, int n, double range, int power, struct err *e)
{
    const double pitch_m = 25e-6, sigma = 0.0025, lambda_m = 520e-9;
    if (!table_init(t, n, range, power, 1, e))
        return false;
    enum { ORDERS = 8 };
    const double norm = 1 / (106.857e-9 * 2 * M_PI * sigma * sigma * 4 * M_PI * M_PI);
#pragma omp parallel for schedule(dynamic, 8)
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            double sum[3] = {0}, cmf[3];
            for (double l = 380e-9; l <= 780.1e-9; l += 2e-9) {
                const double k = lambda_m / l;
                double x = 0, y = 0;
                for (int m = -ORDERS; m <= ORDERS; m++) {
                    const double h = m * lambda_m / pitch_m;
                    const double ax = m ? sin(M_PI * m * 0.4) / (M_PI * m * 0.4) : 1;
                    const double ay = m ? sin(M_PI * m * 0.55) / (M_PI * m * 0.55) : 1;
                    const double dx = table_node(t, i) * k - h, dy = table_node(t, j) * k - h;
                    x += ax * ax * exp(-dx * dx / (2 * sigma * sigma));
                    y += ay * ay * exp(-dy * dy / (2 * sigma * sigma));
                }
                cie_xyz(l, cmf);
                for (int c = 0; c < 3; c++)
                    sum[c] += k * k * x * y * cmf[c] * 2e-9;
            }
            for (int c = 0; c < 3; c++)
                t->tab[((size_t)j * (size_t)n + (size_t)i) * 3 + (size_t)c] =
                    (float)(sum[c] * norm);
        }
    return true;
}
