// env_zonal.c - the zonal weight as polynomials in w, by least squares over the directions that
// exist.
#define _GNU_SOURCE
#include "process/env_zonal.h"
#include "core/mem.h"
#include "process/svd.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FIT = 48, CHECK = 97, VALUES = 129 };

static const double GRAZING = .5; // of tables over w: below it errors count as (w / GRAZING)^4

double zonal_weight(const struct fresnel *f, double x)
{
    const double s = fmax(0, 1 + x);
    if (!f->schlick)
        return s * s;
    const double lost = 1 - sqrt(.5 * s); // 1 - cos theta_d
    const double l5 = lost * lost * lost * lost * lost;
    return s * s * (f->r0 + (1 - f->r0) * l5) / f->r0;
}

double zonal_target(const struct table *t, const struct fresnel *f, int m, double q, double w)
{
    const double z = zonal_weight(f, .5 * (q + w * w) - 1);
    return t->basis == TABLE_PLAIN ? z : z * table_weight(t, m, w) / (4 * M_PI * M_PI * w * w);
}

// The w that pairs of directions with this q can have: 0 (both grazing) to 2 sqrt(1 - q/4) (both
// alike). Tables over w begin where they were made.
static void w_range(const struct table *t, double q, double *lo, double *hi)
{
    *hi = fmax(.5, 2 * sqrt(fmax(0, 1 - q / 4)));
    *lo = t->basis == TABLE_PLAIN ? 0 : fmin(fmax(t->w_min, .1), .5 * *hi);
}

// What a set is fitted with, and what errors of its tables count against.
struct fitting {
    const struct table *t;
    const struct fresnel *f;
    double *size; // [count] largest weight over w of any table, as much as its samples make it
    double tolerance;
};

static double root_of_squares(const struct table *t, int m)
{
    const size_t n = (size_t)t->n * (size_t)t->n * 3;
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum += (double)t->tab[(size_t)m * n + k] * (double)t->tab[(size_t)m * n + k];
    return sqrt(sum);
}

// A table that adds little to the sum needs little accuracy, nor do zeros of its curve.
static void fitting_init(struct fitting *g, const struct table *t, const struct fresnel *f,
                         double tolerance)
{
    *g = (struct fitting){t, f, xcalloc((size_t)t->count, sizeof *g->size), tolerance};
    double most = 0;
    for (int m = 0; m < t->count; m++) {
        double weight = t->basis == TABLE_PLAIN;
        for (int k = 0; k < CHECK && t->basis != TABLE_PLAIN; k++)
            weight = fmax(weight, fabs(table_weight(t, m, .1 + 1.9 * k / (CHECK - 1))));
        most = fmax(most, weight * root_of_squares(t, m));
    }
    for (int m = 0; m < t->count; m++) {
        const double mine = root_of_squares(t, m);
        g->size[m] = mine > 1e-9 * most ? most / mine : 1e9;
    }
}

// One over what the error at (q, w) counts against: the weight of the angle times the table's size.
// Tables over w divide by w^2: where light and viewer both graze it counts less.
static double strictness(const struct fitting *g, int m, double q, double w)
{

    if (g->t->basis == TABLE_PLAIN)
        return 1 / (zonal_weight(g->f, .5 * (q + w * w) - 1) + 1e-3 * zonal_weight(g->f, 1));
    const double z = zonal_weight(g->f, .5 * (q + w * w) - 1) / (4 * M_PI * M_PI * w * w);
    const double floor = 1e-3 * zonal_weight(g->f, 1) / (16 * M_PI * M_PI);
    const double part = fmin(1, w / GRAZING);
    return pow(part, 4) / (g->size[m] * (z + floor));
}

// Least squares, through the SVD of the weighted basis.
static bool fit_one(const struct fitting *g, int m, double q, int degree, double *coef,
                    struct err *e)
{
    double a[FIT * (ZONAL_MOST + 1)], u[FIT * (ZONAL_MOST + 1)], s[ZONAL_MOST + 1];
    double vt[(ZONAL_MOST + 1) * (ZONAL_MOST + 1)], b[FIT], lo, hi;
    const int n = degree + 1;
    w_range(g->t, q, &lo, &hi);
    for (int k = 0; k < FIT; k++) {
        const double w = lo + (hi - lo) * .5 * (1 - cos(M_PI * (k + .5) / FIT));
        const double weight = strictness(g, m, q, w);
        double power = weight;
        for (int d = 0; d < n; d++, power *= w / hi)
            a[k * n + d] = power;
        b[k] = weight * zonal_target(g->t, g->f, m, q, w);
    }
    if (!svd(FIT, n, a, u, s, vt, e))
        return false;
    for (int d = 0; d < n; d++)
        coef[d] = 0;
    for (int r = 0; r < n && s[r] > 1e-14 * s[0]; r++) {
        double dot = 0;
        for (int k = 0; k < FIT; k++)
            dot += u[k * n + r] * b[k];
        for (int d = 0; d < n; d++)
            coef[d] += vt[r * n + d] * dot / s[r];
    }
    double power = 1;
    for (int d = 0; d < n; d++, power /= hi)
        coef[d] *= power;
    return true;
}

static double error_of(const struct fitting *g, int m, double q, int degree, const double *coef)
{
    double lo, hi, most = 0;
    w_range(g->t, q, &lo, &hi);
    for (int k = 0; k < CHECK; k++) {
        const double w = lo + (hi - lo) * k / (CHECK - 1);
        double sum = 0;
        for (int d = degree; d >= 0; d--)
            sum = sum * w + coef[d];
        most = fmax(most, strictness(g, m, q, w) * fabs(sum - zonal_target(g->t, g->f, m, q, w)));
    }
    return most;
}

static bool fit_degree(struct zonal *z, const struct fitting *g, struct err *e)
{
    z->error = 0;
    for (int m = 0; m < z->count; m++)
        for (int k = z->n - 1; k >= 0; k--) {
            const double h = z->h_max * k / (z->n - 1);
            double *coef =
                z->coef + ((size_t)m * (size_t)z->n + (size_t)k) * (size_t)(z->degree + 1);
            if (!fit_one(g, m, h * h, z->degree, coef, e))
                return false;
            z->error = fmax(z->error, error_of(g, m, h * h, z->degree, coef));
            if (z->error > g->tolerance && z->degree < ZONAL_MOST)
                return true; // the next degree, then
        }
    return true;
}

bool zonal_fit(struct zonal *z, const struct table *t, const struct fresnel *f, double tolerance,
               struct err *e)
{
    const bool exact = t->basis == TABLE_PLAIN && !f->schlick;
    *z = (struct zonal){.count = t->count, .n = VALUES, .h_max = fmin(2, M_SQRT2 * t->range)};
    z->coef = xcalloc((size_t)z->count * VALUES * (ZONAL_MOST + 1), sizeof *z->coef);
    struct fitting g;
    bool ok = true, met = false;
    fitting_init(&g, t, f, tolerance);
    for (z->degree = 0; ok && z->degree <= (exact ? 3 : ZONAL_MOST); z->degree++) {
        ok = fit_degree(z, &g, e);
        met = ok && z->error <= tolerance;
        if (met)
            break;
    }
    free(g.size);
    if (met)
        return true;
    const double best = z->error;
    zonal_finish(z);
    if (ok && exact) {
        *z = (struct zonal){.degree = 4, .count = 1};
        return true;
    }
    return ok && err_set(e, ERR_DATA,
                         "bad tolerance %g: the zonal weight of this table can be had to %.2g",
                         tolerance, best);
}

void zonal_one(struct zonal *z)
{
    *z = (struct zonal){.count = 1, .n = 2, .h_max = 1, .coef = xcalloc(2, sizeof *z->coef)};
    z->coef[0] = z->coef[1] = 1;
}

void zonal_finish(struct zonal *z)
{
    if (z)
        free(z->coef);
    *z = (struct zonal){0};
}

double zonal_coef(const struct zonal *z, int m, double q, int k)
{
    if (!z->coef)
        return k == 0 ? q * q / 4 : k == 2 ? q / 2 : k == 4 ? .25 : 0;
    const double x = fmin(sqrt(q) / z->h_max, 1) * (z->n - 1);
    const int i = x < z->n - 2 ? (int)x : z->n - 2;
    const size_t n = (size_t)z->degree + 1;
    const double *c = z->coef + ((size_t)m * (size_t)z->n + (size_t)i) * n + k;
    return c[0] + (x - i) * (c[n] - c[0]);
}

bool zonal_uses(const struct zonal *z, int k)
{
    if (!z->coef)
        return k % 2 == 0;
    const int n = z->degree + 1;
    for (int i = 0; i < z->count * z->n; i++)
        if (z->coef[(size_t)i * (size_t)n + (size_t)k] != 0)
            return true;
    return false;
}
