// optics_ref.c - the sums, written down as they stand.
//
// Points that share w share the nodes' factors, and exp(-2 pi i (u x + v y) / l) is a product of a
// factor per column and one per row; nothing else is done for speed.
#define _GNU_SOURCE
#include "sim/optics_ref.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool check(const struct optics_ref *o, struct err *e)
{
    const long missing = hfield_missing(o->height);
    if (missing)
        return err_set(e, ERR_DATA, "%ld of the height field's nodes are not measured", missing);
    return o->coherence_m > 0 || err_set(e, ERR_DATA, "coherence length %g m", o->coherence_m);
}

static double complex cis(double turns)
{
    const double x = 2 * M_PI * (turns - rint(turns));
    return CMPLX(cos(x), sin(x));
}

// One axis of the window, sum 1.
static double *window(int n, double step_m, double coherence_m)
{
    double *g = xcalloc((size_t)n, sizeof *g), sum = 0;
    for (int i = 0; i < n; i++) {
        const double x = (i - 0.5 * (n - 1)) * step_m / (coherence_m / 4);
        sum += g[i] = exp(-0.5 * x * x);
    }
    for (int i = 0; i < n; i++)
        g[i] /= sum;
    return g;
}

// One row of nodes against all points: line[n] += sum over i of node[i] column[i][n].
static void sum_row(const double complex *node, int nx, const double complex *column, int n,
                    double complex *line)
{
    for (int p = 0; p < n; p++)
        line[p] = 0;
    for (int i = 0; i < nx; i++) {
        const double a = creal(node[i]), b = cimag(node[i]);
        const double *c = (const double *)(column + (size_t)i * (size_t)n);
        double *l = (double *)line;
        for (int p = 0; p < n; p++) {
            l[2 * p] += a * c[2 * p] - b * c[2 * p + 1];
            l[2 * p + 1] += a * c[2 * p + 1] + b * c[2 * p];
        }
    }
}

// Points that all have the same w.
static void sum_nodes(const struct optics_ref *o, const double *gx, const double *gy,
                      const struct uvw *at, int n, double lambda_m, double complex *out)
{
    const struct hfield *h = o->height;
    double complex *column = xcalloc((size_t)h->nx * (size_t)n, sizeof *column);
    double complex *line = xcalloc((size_t)h->ny * (size_t)n, sizeof *line);
    for (int i = 0; i < h->nx; i++)
        for (int p = 0; p < n; p++)
            column[(size_t)i * (size_t)n + (size_t)p] =
                cis(-at[p].u * (i - 0.5 * (h->nx - 1)) * h->dx_m / lambda_m);
#pragma omp parallel for schedule(static)
    for (int j = 0; j < h->ny; j++) {
        double complex *node = xcalloc((size_t)h->nx, sizeof *node);
        for (int i = 0; i < h->nx; i++) {
            const double turns =
                at->w * (double)h->z[(size_t)j * (size_t)h->nx + (size_t)i] / lambda_m;
            node[i] = gx[i] * gy[j] * (o->first_order ? CMPLX(1, 2 * M_PI * turns) : cis(turns));
        }
        sum_row(node, h->nx, column, n, line + (size_t)j * (size_t)n);
        free(node);
    }
    for (int p = 0; p < n; p++) {
        out[p] = 0;
        for (int j = 0; j < h->ny; j++)
            out[p] += line[(size_t)j * (size_t)n + (size_t)p] *
                      cis(-at[p].v * (j - 0.5 * (h->ny - 1)) * h->dy_m / lambda_m);
    }
    free(line);
    free(column);
}

bool optics_ref_amplitude(const struct optics_ref *o, const struct uvw *at, int n, double lambda_m,
                          double complex *out, struct err *e)
{
    if (!check(o, e))
        return false;
    double *gx = window(o->height->nx, o->height->dx_m, o->coherence_m);
    double *gy = window(o->height->ny, o->height->dy_m, o->coherence_m);
    for (int first = 0, last; first < n; first = last) {
        for (last = first + 1; last < n && at[last].w == at[first].w && last - first < 256;)
            last++;
        sum_nodes(o, gx, gy, at + first, last - first, lambda_m, out + first);
    }
    free(gx);
    free(gy);
    return true;
}

bool optics_ref_xyz(const struct optics_ref *o, const struct spectrum *illuminant,
                    const struct uvw *at, int n, double (*out)[3], struct err *e)
{
    double complex *s = xcalloc((size_t)n, sizeof *s);
    double white = 0;
    bool ok = true;
    memset(out, 0, (size_t)n * sizeof *out);
    for (int nm = CIE_FIRST_NM; ok && nm <= CIE_LAST_NM; nm += CIE_STEP_NM) {
        double cmf[3];
        const double ends = nm == CIE_FIRST_NM || nm == CIE_LAST_NM ? 0.5 : 1; // trapezoidal rule
        const double power = ends * spectrum_at(illuminant, nm * 1e-9);
        cie_xyz(nm * 1e-9, cmf);
        white += power * cmf[1];
        ok = optics_ref_amplitude(o, at, n, nm * 1e-9, s, e);
        for (int p = 0; ok && p < n; p++)
            for (int c = 0; c < 3; c++)
                out[p][c] +=
                    power * cmf[c] * (creal(s[p]) * creal(s[p]) + cimag(s[p]) * cimag(s[p]));
    }
    free(s);
    if (ok && !(white > 0))
        ok = err_set(e, ERR_DATA, "the illuminant has no luminance");
    for (int p = 0; ok && p < n; p++)
        for (int c = 0; c < 3; c++)
            out[p][c] /= white;
    return ok;
}
