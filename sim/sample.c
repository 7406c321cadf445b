// sample.c - Fourier coefficients of a cell: closed forms for shapes, direct sums for nodes.
#define _GNU_SOURCE
#include "sim/sample.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

void sample_finish(struct sample *s)
{
    if (!s)
        return;
    free(s->shape);
    hfield_finish(&s->map);
    *s = (struct sample){0};
}

void sample_height_range(const struct sample *s, double *lo_m, double *hi_m)
{
    double lo = 0, hi = 0;
    if (s->map.z)
        hfield_range(&s->map, &lo, &hi);
    for (int k = 0; k < s->n_shapes; k++) {
        const double a = s->shape[k].height_m, b = a + s->shape[k].rise_m;
        lo = fmin(lo, fmin(a, b));
        hi = fmax(hi, fmax(a, b));
    }
    *lo_m = lo;
    *hi_m = hi;
}

double sample_fresnel(const struct sample *s, double cos_d)
{
    const double c = 1 - fmin(1, cos_d);
    return s->schlick ? s->r0 + (1 - s->r0) * c * c * c * c * c : s->r0;
}

static double complex cis(double turns)
{
    const double x = 2 * M_PI * (turns - rint(turns));
    return CMPLX(cos(x), sin(x));
}

static double sinc(double x) // sin(pi x) / (pi x)
{
    return fabs(x) < 1e-8 ? 1 : sin(M_PI * x) / (M_PI * x);
}

// Integral of the cell's phase factors over a shape whose reflectance is exp(2 pi i q rise s).
static double complex shape_integral(const struct shape *p, int m, int n, double q_rise)
{
    const double width = p->s1 - p->s0, height = p->t1 - p->t0;
    const double alpha = q_rise - m * width, beta = (m * p->shear + n) * height;
    return width * height * sinc(alpha) * sinc(beta) *
           cis(0.5 * (alpha - beta) - m * p->s0 - n * p->t0);
}

static double complex shapes_order(const struct sample *s, int m, int n, double q)
{
    double complex sum = m == 0 && n == 0 ? s->ground : 0;
    for (int k = 0; k < s->n_shapes; k++) {
        const struct shape *p = &s->shape[k];
        sum += p->amplitude * cis(q * p->height_m) * shape_integral(p, m, n, q * p->rise_m) -
               s->ground * shape_integral(p, m, n, 0);
    }
    return sum;
}

// A map's nodes are samples of a band-limited reflectance: orders past the band are zero.
static bool in_band(int m, int nodes)
{
    return 2 * m >= -nodes && 2 * m < nodes;
}

static int map_rows(const struct sample *s)
{
    return isinf(s->period_y_m) ? 1 : s->map.ny;
}

// Sums over x, then over y, for all orders asked for: (rows nx M + M rows N) products.
static void map_orders(const struct sample *s, double q, const int *m, int n_m, const int *n,
                       int n_n, double complex *out)
{
    const int nx = s->map.nx, ny = map_rows(s);
    double complex *wave = xcalloc((size_t)(nx + ny), sizeof *wave);
    double complex *line = xcalloc((size_t)n_m * (size_t)ny, sizeof *line);
    double complex *wave_y = wave + nx;
    for (int i = 0; i < nx; i++)
        wave[i] = cis(-(double)i / nx);
    for (int j = 0; j < ny; j++)
        wave_y[j] = cis(-(double)j / ny);
#pragma omp parallel for schedule(static)
    for (int j = 0; j < ny; j++) {
        double complex *r = xcalloc((size_t)nx, sizeof *r);
        for (int i = 0; i < nx; i++)
            r[i] = cis(q * (double)s->map.z[(size_t)j * (size_t)nx + (size_t)i]);
        for (int a = 0; a < n_m; a++) {
            double complex sum = 0;
            const int step = ((m[a] % nx) + nx) % nx;
            if (in_band(m[a], nx))
                for (int i = 0, at = 0; i < nx; i++) {
                    sum += r[i] * wave[at];
                    at += step;
                    at -= at >= nx ? nx : 0;
                }
            line[(size_t)a * (size_t)ny + (size_t)j] = sum / nx;
        }
        free(r);
    }
#pragma omp parallel for schedule(static)
    for (int b = 0; b < n_n; b++)
        for (int a = 0; a < n_m; a++) {
            double complex sum = 0;
            const int step = ((n[b] % ny) + ny) % ny;
            if (in_band(n[b], ny))
                for (int j = 0, at = 0; j < ny; j++) {
                    sum += line[(size_t)a * (size_t)ny + (size_t)j] * wave_y[at];
                    at += step;
                    at -= at >= ny ? ny : 0;
                }
            out[(size_t)b * (size_t)n_m + (size_t)a] = sum / ny;
        }
    free(line);
    free(wave);
}

double complex sample_order(const struct sample *s, int m, int n, double q)
{
    if (isinf(s->period_y_m) && n)
        return 0;
    if (!s->map.z)
        return shapes_order(s, m, n, q);
    double complex one;
    map_orders(s, q, &m, 1, &n, 1, &one);
    return one;
}

void sample_orders(const struct sample *s, double q, int m_max, int n_max, double complex *out)
{
    const int n_m = 2 * m_max + 1, n_n = 2 * n_max + 1;
    if (!s->map.z) {
        for (int b = 0; b < n_n; b++)
            for (int a = 0; a < n_m; a++)
                out[(size_t)b * (size_t)n_m + (size_t)a] =
                    isinf(s->period_y_m) && b != n_max ? 0
                                                       : shapes_order(s, a - m_max, b - n_max, q);
        return;
    }
    int *m = xcalloc((size_t)(n_m + n_n), sizeof *m), *n = m + n_m;
    for (int a = 0; a < n_m; a++)
        m[a] = a - m_max;
    for (int b = 0; b < n_n; b++)
        n[b] = b - n_max;
    map_orders(s, q, m, n_m, n, n_n, out);
    free(m);
}

// The shape at a place of the lattice, NULL on the ground; *part: how far from s0 to s1.
static const struct shape *shape_at(const struct sample *s, double x_m, double y_m, double *part)
{
    const double x = x_m / s->period_x_m, y = isinf(s->period_y_m) ? 0.5 : y_m / s->period_y_m;
    for (int k = 0; k < s->n_shapes; k++) {
        const struct shape *p = &s->shape[k];
        const double t = y - p->t0 - floor(y - p->t0);
        const double from = p->s0 + p->shear * t, at = x - from - floor(x - from);
        *part = at / (p->s1 - p->s0);
        if (t < p->t1 - p->t0 && at < p->s1 - p->s0)
            return p;
    }
    return NULL;
}

double complex sample_reflectance(const struct sample *s, double x_m, double y_m, double q)
{
    double part;
    const struct shape *p = shape_at(s, x_m, y_m, &part);
    return p ? p->amplitude * cis(q * (p->height_m + p->rise_m * part)) : s->ground;
}

static double map_height(const struct hfield *h, double x_m, double y_m)
{
    const double x = x_m / h->dx_m, y = y_m / h->dy_m, fx = x - floor(x), fy = y - floor(y);
    const int i = (int)(x - h->nx * floor(x / h->nx)) % h->nx;
    const int j = (int)(y - h->ny * floor(y / h->ny)) % h->ny;
    const int i1 = (i + 1) % h->nx, j1 = (j + 1) % h->ny;
    const float *a = h->z + (size_t)j * (size_t)h->nx, *b = h->z + (size_t)j1 * (size_t)h->nx;
    return (1 - fy) * ((1 - fx) * (double)a[i] + fx * (double)a[i1]) +
           fy * ((1 - fx) * (double)b[i] + fx * (double)b[i1]);
}

double sample_height(const struct sample *s, double x_m, double y_m, double *amplitude)
{
    const double c = cos(s->turn_rad), i = sin(s->turn_rad);
    const double x = c * x_m + i * y_m, y = c * y_m - i * x_m;
    double part;
    *amplitude = 1;
    if (s->map.z)
        return map_height(&s->map, x, y);
    const struct shape *p = shape_at(s, x, y, &part);
    *amplitude = p ? p->amplitude : s->ground;
    return p ? p->height_m + p->rise_m * part : 0;
}
