// env_kernel.c - shares a table out to the grid and transforms it, once per kernel.
#define _GNU_SOURCE
#include "process/env_kernel.h"
#include "core/mem.h"
#include "process/bspline.h"
#include "process/fft.h"
#include "process/table_cubic.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// How the table's nodes share out to the grid along one axis: row k is the grid node
// (k - reach) * step, of the band of table nodes first[k] .. first[k] + count[k] - 1.
struct raster {
    int reach, n;
    double *weight; // [2 reach + 1][n]
    int *first, *count;
};

// In nodes; `turned` makes room for the table's corners.
static int reach_of(const struct table *t, bool turned, double step)
{
    const double range = turned ? fmax(t->range, fmin(2, M_SQRT2 * t->range)) : t->range;
    return (int)ceil(range / step) + ENV_RIM;
}

// Two-point Gauss per piece: B-spline times cubic is smooth within pieces of half a step.
static bool raster_init(struct raster *r, const struct table *t, const struct env_grid *grid,
                        struct err *e)
{
    const double step = grid->step;
    *r = (struct raster){.reach = grid->reach, .n = t->n};
    const int rows = 2 * r->reach + 1;
    r->weight = sample_alloc((size_t)rows * (size_t)t->n, sizeof *r->weight, "table raster", e);
    r->first = xcalloc((size_t)rows, sizeof *r->first);
    r->count = xcalloc((size_t)rows, sizeof *r->count);
    if (!r->weight)
        return false;
    for (int i = 0; i + 1 < t->n; i++) {
        const double u0 = table_node(t, i), u1 = table_node(t, i + 1);
        const int pieces = 1 + (int)ceil(2 * (u1 - u0) / step);
        const double size = (u1 - u0) / pieces;
        for (int p = 0; p < 2 * pieces; p++) {
            const double u = u0 + size * (p / 2 + .5 + (p % 2 ? .5 : -.5) / sqrt(3));
            double from[STENCIL], to[4];
            int first;
            if (!table_stencil(t, u, &first, from))
                continue;
            const double at = u / step + r->reach;
            const int g = (int)floor(at);
            bspline_weights(at - g, to);
            for (int q = 0; q < 4; q++)
                for (int k = 0; k < STENCIL && first + k < t->n; k++)
                    r->weight[(size_t)(g - 1 + q) * (size_t)t->n + (size_t)(first + k)] +=
                        .5 * size / step * to[q] * from[k];
        }
    }
    for (int k = 0; k < rows; k++) {
        const double *w = r->weight + (size_t)k * (size_t)t->n;
        int lo = 0, hi = t->n;
        while (lo < hi && w[lo] == 0)
            lo++;
        while (hi > lo && w[hi - 1] == 0)
            hi--;
        r->first[k] = lo;
        r->count[k] = hi - lo;
    }
    return true;
}

static void raster_finish(struct raster *r)
{
    free(r->weight);
    free(r->first);
    free(r->count);
}

// plane[rows][rows][3] of table m, through the columns first.
static bool rasterise(const struct raster *r, const struct table *t, int m, double *plane,
                      struct err *e)
{
    const int rows = 2 * r->reach + 1;
    const size_t n = (size_t)t->n, width = (size_t)rows * 3;
    const float *tab = t->tab + (size_t)m * n * n * 3;
    double *mid = sample_alloc(n * width, sizeof *mid, "table raster", e); // [n][rows][3]
    if (!mid)
        return false;
#pragma omp parallel for
    for (int j = 0; j < t->n; j++)
        for (int k = 0; k < rows; k++) {
            double *out = mid + (size_t)j * width + 3 * (size_t)k;
            for (int i = r->first[k]; i < r->first[k] + r->count[k]; i++)
                for (size_t c = 0; c < 3; c++)
                    out[c] += r->weight[(size_t)k * n + (size_t)i] *
                              (double)tab[((size_t)j * n + (size_t)i) * 3 + c];
        }
#pragma omp parallel for
    for (int k = 0; k < rows; k++) {
        double *out = plane + (size_t)k * width;
        memset(out, 0, width * sizeof *out);
        for (int j = r->first[k]; j < r->first[k] + r->count[k]; j++)
            for (size_t x = 0; x < width; x++)
                out[x] += r->weight[(size_t)k * n + (size_t)j] * mid[(size_t)j * width + x];
    }
    free(mid);
#pragma omp parallel for
    for (int k = 0; k < rows; k++)
        bspline_fit_vectors(plane + (size_t)k * width, rows, 3, 3);
    bspline_fit_vectors(plane, rows, width, width);
    return true;
}

// The look-up behind the product reads with B-spline weights.
static void shape_spectrum(double *spec, const struct env_grid *g)
{
    const int half = g->period / 2 + 1;
    const double scale = 4 * M_PI * M_PI / ((double)g->period * g->period);
    for (int j = 0; j < g->period; j++)
        for (int i = 0; i < half; i++) {
            double *s = spec + 2 * ((size_t)j * (size_t)half + (size_t)i);
            const double x = scale * bspline_gain(j, g->period) * bspline_gain(i, g->period);
            s[0] *= x;
            s[1] *= x;
        }
}

// A plane of samples turned by an angle: read at the places turned back, as the spline through it.
static bool turn_plane(double *plane, int reach, double angle_rad, struct err *e)
{
    const int rows = 2 * reach + 1;
    const size_t width = (size_t)rows * 3;
    double *fit = sample_alloc((size_t)rows * width, sizeof *fit, "table raster", e);
    if (!fit)
        return false;
    memcpy(fit, plane, (size_t)rows * width * sizeof *fit);
    for (int k = 0; k < rows; k++)
        bspline_fit_vectors(fit + (size_t)k * width, rows, 3, 3);
    bspline_fit_vectors(fit, rows, width, width);
    const double c = cos(angle_rad), s = sin(angle_rad);
#pragma omp parallel for
    for (int j = -reach; j <= reach; j++)
        for (int i = -reach; i <= reach; i++) {
            const double x = reach + c * i + s * j, y = reach - s * i + c * j;
            double *out = plane + (size_t)(j + reach) * width + 3 * (size_t)(i + reach);
            const int x0 = (int)floor(x), y0 = (int)floor(y);
            out[0] = out[1] = out[2] = 0;
            if (x0 < 1 || y0 < 1 || x0 + 2 >= rows || y0 + 2 >= rows)
                continue;
            double wx[4], wy[4];
            bspline_weights(x - x0, wx);
            bspline_weights(y - y0, wy);
            for (int q = 0; q < 4; q++) {
                const double *from = fit + (size_t)(y0 - 1 + q) * width + 3 * (size_t)(x0 - 1);
                for (int p = 0; p < 12; p++)
                    out[p % 3] += wy[q] * wx[p / 3] * from[p];
            }
        }
    free(fit);
    return true;
}

// The planes of channel c times a kernel's function of q, summed over the tables, transformed.
static bool transform(struct env_kernel *k, const struct fft *fft, int reach, double *const *planes,
                      int c, int kernel, struct err *e)
{
    const int p = k->grid.period;
    const size_t line = 2 * ((size_t)p / 2 + 1), rows = 2 * (size_t)reach + 1;
    double *spec = sample_alloc((size_t)p * line, sizeof *spec, "kernel", e);
    if (!spec)
        return false;
    for (int m = 0; m < k->terms.zonal.count; m++)
        for (int j = -reach; j <= reach; j++)
            for (int i = -reach; i <= reach; i++) {
                const double q = k->grid.step * k->grid.step * (i * i + j * j);
                const size_t from = ((size_t)(j + reach) * rows + (size_t)(i + reach)) * 3;
                spec[(size_t)((j + p) % p) * line + (size_t)((i + p) % p)] +=
                    zonal_coef(&k->terms.zonal, m, q, kernel) * planes[m][from + (size_t)c];
            }
    fft_run(fft, spec, spec);
    shape_spectrum(spec, &k->grid);
    k->spec[c][kernel] = spec;
    return true;
}

static bool transform_all(struct env_kernel *k, int reach, double *const *planes, struct err *e)
{
    struct fft *fft = fft_new(FFT_R2C, FFT_DOUBLE, k->grid.period, k->grid.period, 1, true, e);
    const int kernels = k->terms.n_kernel;
    bool ok = fft != NULL;
#pragma omp parallel for schedule(dynamic)
    for (int job = 0; job < 3 * kernels; job++) {
        struct err mine = {0};
        if (fft && zonal_uses(&k->terms.zonal, job % kernels) &&
            !transform(k, fft, reach, planes, job / kernels, job % kernels, &mine)) {
#pragma omp critical
            {
                ok = false;
                *e = mine;
            }
        }
    }
    fft_free(fft);
    return ok;
}

// A window of o needs light up to the table's reach around it, where there is any; the sums reach
// as far again, and must not come back into the window from the other side.
static struct env_grid grid_of(double step, double span, int reach)
{
    const int all = 2 * (int)ceil(1 / step) + 1 + 2 * ENV_RIM;
    const int window = span < 2 ? (int)ceil(span / step) + 1 + 2 * ENV_RIM : all;
    const int around = reach < all - window ? reach : all - window; // on one side at most
    const int both = 2 * reach < all - window ? 2 * reach : all - window;
    return (struct env_grid){step, span, reach, window + both,
                             fft_good_size(window + around + reach)};
}

// All spectra of kernel and light, and the planes of a channel.
static double bytes_of(const struct env_terms *t, const struct env_grid *g)
{
    const double period = g->period;
    return period * period * sizeof(double) * (3 * (t->n_kernel + t->n_pre) + t->n_post);
}

// A grid that is fine enough, or as fine as memory allows.
static struct env_grid fine_grid(const struct env_kernel *k, const struct table *t,
                                 const struct env_how *how)
{
    const double span = how->span > 0 ? fmin(2, how->span) : 2, most_bytes = 4e9;
    double step = fmax(table_detail(t) / 3.5, how->detail_rad / 8);
    step = how->step > 0 ? how->step : fmin(1 / 160., fmax(1 / 2048., step));
    for (;; step *= 1.1) {
        const struct env_grid g = grid_of(step, span, reach_of(t, how->turn_rad != 0, step));
        if (how->step > 0 || step > .05 || bytes_of(&k->terms, &g) <= most_bytes)
            return g;
    }
}

bool env_kernel_init(struct env_kernel *k, const struct table *t, const struct fresnel *f,
                     const struct env_how *how, struct err *e)
{
    *k = (struct env_kernel){.not_negative = table_not_negative(t)};
    if (!(how->products ? env_terms_products(&k->terms, t, f, how->products, e)
                        : env_terms_polynomial(&k->terms, t, f, how->tolerance, e)))
        return false;

    struct raster r;
    k->grid = fine_grid(k, t, how);
    bool ok = raster_init(&r, t, &k->grid, e);
    const size_t rows = 2 * (size_t)r.reach + 1;
    double **planes = xcalloc((size_t)t->count, sizeof *planes);
    for (int m = 0; ok && m < t->count; m++) {
        planes[m] = sample_alloc(rows * rows * 3, sizeof **planes, "table raster", e);
        ok = planes[m] && rasterise(&r, t, m, planes[m], e) &&
             (how->turn_rad == 0 || turn_plane(planes[m], r.reach, how->turn_rad, e));
    }
    ok = ok && transform_all(k, r.reach, planes, e);
    for (int m = 0; m < t->count; m++)
        free(planes[m]);
    free(planes);
    raster_finish(&r);
    if (!ok)
        env_kernel_finish(k);
    return ok;
}

void env_kernel_finish(struct env_kernel *k)
{
    if (!k)
        return;
    for (int c = 0; c < 3; c++)
        for (int p = 0; p < TERMS_MOST; p++)
            free(k->spec[c][p]);
    env_terms_finish(&k->terms);
    *k = (struct env_kernel){0};
}
