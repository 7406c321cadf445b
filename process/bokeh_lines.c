// bokeh_lines.c - a grating's profile, and pictures made of it.
#include "process/bokeh_lines.h"
#include "calib/grating.h"
#include <math.h>
#include <string.h>

bool lines_find(struct lines *l, const struct disc *d, const float *flat, int w, int h,
                double sigma_px, struct err *e)
{
    struct grating g;
    if (!grating_find(&g, d, flat, w, h, e))
        return false;
    double power = 0;
    for (int m = 1; m <= g.harmonics; m++)
        power += 2 * pow(cabs(g.f[m]), 2);
    *l = (struct lines){g.kx, g.ky, d->cx_px, d->cy_px, g.noise * g.noise / power, {0}};
    _Static_assert(sizeof l->profile == GRATING_SAMPLES * sizeof(double), "one profile");
    grating_sharpen(&g, sigma_px, l->profile);
    return true;
}

double lines_at(const struct lines *l, double i, double j)
{
    enum { PARTS = 5, N = GRATING_SAMPLES }; // of a pixel's side
    double sum = 0;
    for (int q = 0; q < PARTS; q++)
        for (int p = 0; p < PARTS; p++) {
            const double x = i + (p + 0.5) / PARTS - 0.5 - l->cx_px,
                         y = j + (q + 0.5) / PARTS - 0.5 - l->cy_px;
            const double phase = l->kx * x + l->ky * y, at = N * (phase - floor(phase));
            const int k = (int)at % N;
            const double f = at - floor(at);
            sum += (1 - f) * l->profile[k] + f * l->profile[(k + 1) % N];
        }
    return sum / (PARTS * PARTS);
}
