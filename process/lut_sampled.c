// lut_sampled.c - the plain method: for every node a sum over wavelengths of spline look-ups.
#define _GNU_SOURCE
#include "core/mem.h"
#include "process/bspline.h"
#include "process/lut_band.h"
#include "process/lut_kernel.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// The pattern at a place between pixels; 0 beyond the outermost pixel centres.
static double pattern_at(const float *coef, int w, int h, double x, double y)
{
    if (!(x >= 0 && y >= 0 && x <= w - 1 && y <= h - 1))
        return 0;
    const int i = x < w - 2 ? (int)x : w - 2, j = y < h - 2 ? (int)y : h - 2;
    float wx[4], wy[4];
    bspline_weights_3((float)(x - i), wx);
    bspline_weights_3((float)(y - j), wy);
    double sum = 0;
    for (int b = 0; b < 4; b++) {
        const float *row = coef + (size_t)bspline_mirror(j - 1 + b, h) * (size_t)w;
        double line = 0;
        if (i >= 1 && i + 2 < w)
            for (int a = 0; a < 4; a++)
                line += wx[a] * row[i - 1 + a];
        else
            for (int a = 0; a < 4; a++)
                line += wx[a] * row[bspline_mirror(i - 1 + a, w)];
        sum += wy[b] * line;
    }
    return sum;
}

// 5, 2.5 and 1 nm: errors of 1.3e-3, 3.3e-4 and 8e-5 on the reference pattern.
int lut_sampled_wavelengths(double tolerance)
{
    return tolerance >= 2e-3 ? 81 : tolerance >= 5e-4 ? 161 : 401;
}

bool lut_sampled(const struct lut_request *r, const struct lp_kernel *k, struct table *t,
                 struct lut_report *report, struct err *e)
{
    (void)k; // on wavelengths of its own
    const struct lut_pattern *p = r->pattern;
    const size_t count = (size_t)p->w * (size_t)p->h;
    float *coef = sample_alloc(count, sizeof *coef, "pattern", e);
    struct lut_band band;
    report->wavelengths = r->wavelengths ? r->wavelengths : lut_sampled_wavelengths(r->tolerance);
    if (!coef || !lut_band_sampled(&band, r->light, report->wavelengths, e)) {
        free(coef);
        return false;
    }
    memcpy(coef, p->px, count * sizeof *coef);
    bspline_fit_image(coef, p->w, p->h, BSPLINE_CUBIC);

    double *px_per_u = xcalloc((size_t)band.n, sizeof *px_per_u); // pixels per unit of h, scaled
    for (int q = 0; q < band.n; q++) {
        const double ratio = r->lambda_m / band.lambda_m[q];
        px_per_u[q] = ratio / p->h_per_px;
        for (int c = 0; c < 3; c++)
            band.weight[q][c] *= lut_factor(r, band.lambda_m[q]);
    }
#pragma omp parallel for schedule(dynamic, 4)
    for (int j = 0; j < t->n; j++)
        for (int i = 0; i < t->n; i++) {
            const double u = table_node(t, i), v = table_node(t, j);
            double sum[3] = {0};
            for (int q = 0; q < band.n; q++) {
                const double l =
                    pattern_at(coef, p->w, p->h, p->cx + u * px_per_u[q], p->cy + v * px_per_u[q]);
                for (int c = 0; c < 3; c++)
                    sum[c] += band.weight[q][c] * l;
            }
            for (int c = 0; c < 3; c++)
                t->tab[((size_t)j * (size_t)t->n + (size_t)i) * 3 + (size_t)c] = (float)sum[c];
        }
    free(px_per_u);
    free(coef);
    lut_band_finish(&band);
    return true;
}
