// direct.c - XYZ at single points by direct summation in double.
#include "process/direct.h"
#include "core/log.h"
#include "core/mem.h"
#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

enum { LANES = 8 }; // sums side by side, in a fixed order
typedef double lanes __attribute__((vector_size(LANES * sizeof(double))));

static const double tau = 6.28318530717958647693;

struct sum {
    const struct direct *d;
    int nx, ny, blocks; // nodes; blocks of LANES along x
    double *gx, *gy;    // window, normalised
    double area_m2;     // of coherence
    lanes *re, *im;     // [ny][blocks] window times exp(i 2 pi w h / lambda)
    lanes *wave;        // [threads][2][blocks]
};

static double *window_of(const struct direct *d, int nodes, double step_m, double *squares)
{
    double *g = xcalloc((size_t)nodes, sizeof *g), sum = 0;
    for (int i = 0; i < nodes; i++) {
        const double x = (i - 0.5 * (nodes - 1)) * step_m / (d->coherence_m / 4);
        sum += g[i] = d->window == WINDOW_FLAT ? 1 : exp(-0.5 * x * x);
    }
    *squares = 0;
    for (int i = 0; i < nodes; i++) {
        g[i] /= sum;
        *squares += g[i] * g[i];
    }
    return g;
}

static void phases(const struct sum *s, double q)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < s->ny; j++)
        for (int i = 0; i < s->nx; i++) {
            const double h = s->d->heights->z[(size_t)j * (size_t)s->nx + (size_t)i];
            const double g = s->gx[i] * s->gy[j], angle = tau * q * h;
            const size_t at = (size_t)j * (size_t)s->blocks + (size_t)(i / LANES);
            s->re[at][i % LANES] = g * cos(angle);
            s->im[at][i % LANES] = g * sin(angle);
        }
}

__attribute__((target_clones("avx512f", "avx2", "default"))) static void
row_sum(const lanes *restrict re, const lanes *restrict im, const lanes *restrict wave, int blocks,
        double out[2])
{
    lanes a = {0}, b = {0};
    for (int k = 0; k < blocks; k++) {
        a += re[k] * wave[k] - im[k] * wave[blocks + k];
        b += re[k] * wave[blocks + k] + im[k] * wave[k];
    }
    out[0] = out[1] = 0;
    for (int k = 0; k < LANES; k++) {
        out[0] += a[k];
        out[1] += b[k];
    }
}

// |S|^2 at (fx, fy) cycles per node.
static double power(const struct sum *s, double fx, double fy, lanes *wave)
{
    for (int i = 0; i < s->nx; i++) {
        wave[i / LANES][i % LANES] = cos(tau * fx * i);
        wave[s->blocks + i / LANES][i % LANES] = -sin(tau * fx * i);
    }
    double re = 0, im = 0;
    for (int j = 0; j < s->ny; j++) {
        double row[2];
        const size_t at = (size_t)j * (size_t)s->blocks;
        row_sum(s->re + at, s->im + at, wave, s->blocks, row);
        const double c = cos(tau * fy * j), t = -sin(tau * fy * j);
        re += row[0] * c - row[1] * t;
        im += row[0] * t + row[1] * c;
    }
    return re * re + im * im;
}

// |sum of the copies|^2 over their number squared, by adding them.
static double copies(int n, double cycles)
{
    double re = 0, im = 0;
    for (int k = 0; k < n; k++) {
        re += cos(tau * cycles * k);
        im += sin(tau * cycles * k);
    }
    return (re * re + im * im) / ((double)n * n);
}

static void add_wavelength(const struct sum *s, int l, int first, int end, const int *order,
                           const double (*point)[3], double (*xyz)[3])
{
    const struct direct *d = s->d;
    const double lambda_m = d->light->lambda_m[l];
    const double scale =
        d->absolute ? s->area_m2 * d->repeat[0] * d->repeat[1] / (lambda_m * lambda_m) : 1;
#pragma omp parallel for schedule(static)
    for (int k = first; k < end; k++) {
        const double *p = point[order[k]];
        const double fx = p[0] * d->heights->dx_m / lambda_m,
                     fy = p[1] * d->heights->dy_m / lambda_m;
        const double value =
            power(s, fx, fy, s->wave + (size_t)omp_get_thread_num() * 2 * (size_t)s->blocks) *
            copies(d->repeat[0], fx * s->nx) * copies(d->repeat[1], fy * s->ny) * scale;
        for (int c = 0; c < 3; c++)
            xyz[order[k]][c] += d->light->weight[l][c] * value;
    }
}

struct by_w {
    double w;
    int k;
};

static int compare_w(const void *a, const void *b)
{
    const struct by_w *x = a, *y = b;
    return x->w != y->w ? (x->w > y->w) - (x->w < y->w) : x->k - y->k;
}

static int *order_by_w(int n, const double (*point)[3])
{
    struct by_w *item = xcalloc((size_t)n + 1, sizeof *item);
    int *order = xcalloc((size_t)n + 1, sizeof *order);
    for (int k = 0; k < n; k++)
        item[k] = (struct by_w){point[k][2], k};
    qsort(item, (size_t)n, sizeof *item, compare_w);
    for (int k = 0; k < n; k++)
        order[k] = item[k].k;
    free(item);
    return order;
}

static void run(const struct sum *s, int n, const double (*point)[3], double (*xyz)[3])
{
    int *order = order_by_w(n, point);
    struct progress bar;
    progress_start(&bar, "summing", (long)n * s->d->light->n);
    memset(xyz, 0, (size_t)n * sizeof *xyz);
    for (int first = 0, end; first < n; first = end) {
        const double w = point[order[first]][2];
        for (end = first + 1; end < n && point[order[end]][2] == w;)
            end++;
        for (int l = 0; l < s->d->light->n; l++) {
            phases(s, w / s->d->light->lambda_m[l]);
            add_wavelength(s, l, first, end, order, point, xyz);
            progress_step(&bar, end - first);
        }
    }
    progress_end(&bar);
    free(order);
}

bool direct_xyz(const struct direct *d, int n, const double (*point)[3], double (*xyz)[3],
                struct err *e)
{
    const struct hfield *hf = d->heights;
    for (int j = 0; j < hf->ny; j++)
        for (int i = 0; i < hf->nx; i++)
            if (!isfinite(hf->z[(size_t)j * (size_t)hf->nx + (size_t)i]))
                return err_set(e, ERR_DATA, "node (%d, %d) was not measured (NaN)", i, j);
    struct sum s = {.d = d, .nx = hf->nx, .ny = hf->ny, .blocks = (hf->nx + LANES - 1) / LANES};
    const size_t nodes = (size_t)s.ny * (size_t)s.blocks;
    double xx, yy;
    s.gx = window_of(d, s.nx, hf->dx_m, &xx);
    s.gy = window_of(d, s.ny, hf->dy_m, &yy);
    s.area_m2 = hf->dx_m * hf->dy_m / (xx * yy);
    s.re = sample_alloc(nodes, sizeof(lanes), "phases", e);
    s.im = sample_alloc(nodes, sizeof(lanes), "phases", e);
    s.wave = sample_alloc((size_t)omp_get_max_threads() * 2 * (size_t)s.blocks, sizeof(lanes),
                          "phases", e);
    const bool ok = s.re && s.im && s.wave;
    if (ok)
        run(&s, n, point, xyz);
    free(s.gx);
    free(s.gy);
    free(s.re);
    free(s.im);
    free(s.wave);
    return ok;
}
