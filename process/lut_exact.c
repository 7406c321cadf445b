// lut_exact.c - the table by correlation along the logarithm of the radius (logpolar.h).
#define _GNU_SOURCE
#include "core/mem.h"
#include "process/logpolar.h"
#include "process/lut.h"
#include "process/lut_band.h"
#include <math.h>
#include <stdlib.h>

// With s = ln(lm / l) the integral of lut.h is a sum over scalings e^s.
static void to_kernel(const struct lut_request *r, const struct lut_band *band, struct lp_kernel *k)
{
    *k = (struct lp_kernel){band->n, xcalloc((size_t)band->n, sizeof *k->s), band->weight};
    for (int q = 0; q < band->n; q++) {
        k->s[q] = log(r->lambda_m / band->lambda_m[q]);
        const double factor = exp(r->exponent * k->s[q]) / (4 * M_PI * M_PI * r->f0 * r->f0);
        for (int c = 0; c < 3; c++)
            k->weight[q][c] *= factor;
    }
}

// What a table of a pattern that is nowhere below its least value cannot be below.
static void find_lowest(const struct lut_pattern *p, const struct lp_kernel *k, float lowest[3])
{
    float least = 0;
    for (size_t i = 0; i < (size_t)p->w * (size_t)p->h; i++)
        least = fminf(least, p->px[i]);
    for (int c = 0; c < 3; c++) {
        double sum = 0;
        for (int q = 0; q < k->n; q++)
            sum += k->weight[q][c];
        lowest[c] = (float)(sum * (double)least);
    }
}

bool lut_exact(const struct lut_request *r, struct table *t, struct lut_report *report,
               struct err *e)
{
    static const double rgb_from_xyz_rows[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const struct lut_pattern *p = r->pattern;
    struct lut_band band;
    if (!lut_band_init(&band, r->light, 1e-3, e))
        return false;
    report->skipped_band = band.skipped;
    struct lp_kernel k;
    to_kernel(r, &band, &k);
    double mix[3][3]; // columns: the sRGB of X, Y, Z
    for (int c = 0; c < 3; c++) {
        double rgb[3];
        xyz_to_rgb(rgb_from_xyz_rows[c], rgb);
        for (int q = 0; q < 3; q++)
            mix[q][c] = rgb[q];
    }
    double *x = xcalloc((size_t)t->n, sizeof *x);
    for (int i = 0; i < t->n; i++)
        x[i] = table_node(t, i) / p->h_per_px;
    struct lp_nodes nodes = {.n = t->n, .x = x, .mix = r->is_rgb ? (const double(*)[3])mix : NULL};
    find_lowest(p, &k, nodes.lowest);
    const struct lp_picture picture = {p->px, p->w, p->h, p->cx, p->cy};
    struct lp_stats stats;
    const double part = 0.2 * r->tolerance; // ray spacing, steps of the results: a share each
    const bool ok =
        lp_correlate(&picture, &k, &nodes, lp_density(&picture, part), part, t->tab, &stats, e);
    report->skipped_nodes = stats.nodes;
    free(x);
    free(k.s);
    lut_band_finish(&band);
    return ok;
}
