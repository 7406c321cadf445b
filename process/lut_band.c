// lut_band.c - Gauss-Legendre lines between the knots of P and cmf.
#define _GNU_SOURCE
#include "process/lut_band.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

static const double first_m = CIE_FIRST_NM * 1e-9, last_m = CIE_LAST_NM * 1e-9;

// Weights below this share of a channel's whole are nothing: far below any table's error.
static const double nothing = 1e-7;

void lut_band_finish(struct lut_band *b)
{
    if (!b)
        return;
    free(b->lambda_m);
    free(b->weight);
    *b = (struct lut_band){0};
}

static void append(struct lut_band *b, double lambda_m, const double weight[3])
{
    if (!(b->n & (b->n - 1))) { // grows when n reaches a power of two
        const size_t room = b->n ? 2 * (size_t)b->n : 1;
        b->lambda_m = xrealloc(b->lambda_m, room, sizeof *b->lambda_m);
        b->weight = xrealloc(b->weight, room, sizeof *b->weight);
    }
    b->lambda_m[b->n] = lambda_m;
    for (int c = 0; c < 3; c++)
        b->weight[b->n][c] = weight[c];
    b->n++;
}

// Three Gauss points: exact for polynomials of degree 5, and P cmf has 2.
static void append_interval(struct lut_band *b, const struct spectrum *light, double scale,
                            double from_m, double to_m)
{
    static const double at[3] = {-0.774596669241483377, 0, 0.774596669241483377};
    static const double share[3] = {5 / 18.0, 8 / 18.0, 5 / 18.0};
    for (int q = 0; q < 3; q++) {
        const double l = 0.5 * (from_m + to_m) + 0.5 * (to_m - from_m) * at[q];
        double w[3];
        cie_xyz(l, w);
        for (int c = 0; c < 3; c++)
            w[c] *= scale * spectrum_at(light, l) * share[q] * (to_m - from_m);
        append(b, l, w);
    }
}

// The next knot of observer or light above l.
static double next_knot(const struct spectrum *light, double l, int *k)
{
    const double eps = 1e-15, step = CIE_STEP_NM * 1e-9;
    double next = first_m + step * (floor((l - first_m + eps) / step) + 1);
    while (*k < light->n && light->lambda_m[*k] <= l + eps)
        ++*k;
    if (*k < light->n && light->lambda_m[*k] < next - eps)
        next = light->lambda_m[*k];
    return fmin(next, last_m);
}

// Cuts the lines at both ends that together hold nothing.
static void trim(struct lut_band *b)
{
    double whole[3] = {0}, low[3] = {0}, high[3] = {0};
    for (int q = 0; q < b->n; q++)
        for (int c = 0; c < 3; c++)
            whole[c] += b->weight[q][c];
    int first = 0, last = b->n - 1;
    for (bool go = true; go && first < last; first += go)
        for (int c = 0; c < 3; c++)
            go &= (low[c] += b->weight[first][c]) <= nothing * whole[c];
    for (bool go = true; go && first < last; last -= go)
        for (int c = 0; c < 3; c++)
            go &= (high[c] += b->weight[last][c]) <= nothing * whole[c];
    b->skipped = 1 - (b->lambda_m[last] - b->lambda_m[first]) / (last_m - first_m);
    int kept = 0;
    for (int q = first; q <= last; q++) { // lines inside the band may be empty too
        const double *w = b->weight[q];
        if (w[0] == 0 && w[1] == 0 && w[2] == 0)
            continue;
        b->lambda_m[kept] = b->lambda_m[q];
        for (int c = 0; c < 3; c++)
            b->weight[kept][c] = w[c];
        kept++;
    }
    b->n = kept;
}

bool lut_band_init(struct lut_band *b, const struct spectrum *light, double step, struct err *e)
{
    const double scale = illuminant_scale(light);
    if (!(scale > 0) || !isfinite(scale))
        return err_set(e, ERR_DATA, "the illuminant has no luminance between %d and %d nm",
                       CIE_FIRST_NM, CIE_LAST_NM);
    *b = (struct lut_band){0};
    int k = 0;
    for (double from = first_m; from < last_m - 1e-15;) {
        const double to = next_knot(light, from, &k);
        const int parts = (int)ceil(log(to / from) / (2 * step));
        for (int p = 0; p < parts; p++)
            append_interval(b, light, scale, from + (to - from) * p / parts,
                            from + (to - from) * (p + 1) / parts);
        from = to;
    }
    trim(b);
    return true;
}

bool lut_band_sampled(struct lut_band *b, const struct spectrum *light, int n, struct err *e)
{
    struct lut_band fine, got = {0};
    if (!lut_band_init(&fine, light, 1e-3, e))
        return false;
    static const double zero[3];
    const double step = (last_m - first_m) / (n - 1);
    for (int k = 0; k < n; k++)
        append(&got, first_m + k * step, zero);
    for (int q = 0; q < fine.n; q++) { // each line shares its weight between its two neighbours
        const double at = (fine.lambda_m[q] - first_m) / step;
        const int k = at < n - 2 ? (int)at : n - 2;
        for (int c = 0; c < 3; c++) {
            got.weight[k][c] += (1 - (at - k)) * fine.weight[q][c];
            got.weight[k + 1][c] += (at - k) * fine.weight[q][c];
        }
    }
    got.skipped = fine.skipped;
    lut_band_finish(&fine);
    *b = got;
    return true;
}
