// lut_floor.c - the table as T17's released program makes it: 81 wavelengths, whole pixels.
//
// Kept as the yardstick, and as plain as that program's loop: a table per wavelength, one thread,
// added up by the trapezoidal rule over 5 nm steps (T17 4.3), the pattern read at the pixel whose
// index is the floor of the position.
#define _GNU_SOURCE
#include "core/mem.h"
#include "process/lut_band.h"
#include "process/lut_kernel.h"
#include <math.h>
#include <stdlib.h>

enum { WAVELENGTHS = 81 };

bool lut_floor(const struct lut_request *r, const struct lp_kernel *k, struct table *t,
               struct lut_report *report, struct err *e)
{
    (void)k; // on wavelengths of its own
    const struct lut_pattern *p = r->pattern;
    struct lut_band band;
    if (!lut_band_sampled(&band, r->light, WAVELENGTHS, e))
        return false;
    report->wavelengths = WAVELENGTHS;
    double *u = xcalloc((size_t)t->n, sizeof *u);
    for (int i = 0; i < t->n; i++)
        u[i] = table_node(t, i);
    for (int q = 0; q < WAVELENGTHS; q++) {
        const double ratio = r->lambda_m / band.lambda_m[q], px_per_u = ratio / p->h_per_px;
        const double factor = lut_factor(r, band.lambda_m[q]);
        for (int j = 0; j < t->n; j++) {
            const double y = floor(p->cy + u[j] * px_per_u);
            if (y < 0 || y >= p->h)
                continue;
            const float *line = p->px + (size_t)y * (size_t)p->w;
            float *row = t->tab + (size_t)j * (size_t)t->n * 3;
            for (int i = 0; i < t->n; i++) {
                const double x = floor(p->cx + u[i] * px_per_u);
                if (x < 0 || x >= p->w)
                    continue;
                const double l = factor * (double)line[(int)x];
                for (int c = 0; c < 3; c++)
                    row[3 * i + c] += (float)(l * band.weight[q][c]);
            }
        }
    }
    free(u);
    lut_band_finish(&band);
    return true;
}
