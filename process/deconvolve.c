// deconvolve.c - Richardson-Lucy iterations, their acceleration, their end.
#define _GNU_SOURCE
#include "process/deconvolve.h"
#include "core/mem.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

struct rl {
    struct blur *b;
    int w, h;
    size_t n;
    const float *data; // [h][w], >= 0
    float *keep;       // [h][w] 1 where a sample is used, 0 where held out; NULL: all used
    float *norm;       // [h][w] H^T keep
    float *model;      // [h][w] H u
    float *step;       // [h][w] scratch
    double least;      // a model sample under it counts as dark: no division
    double tv;
};

// Sum of f over the rows in double, rows in order: the same bytes for any number of threads.
#define SUM_ROWS(rl, result, expression)                                                           \
    do {                                                                                           \
        double *part = xcalloc((size_t)(rl)->h, sizeof *part);                                     \
        _Pragma("omp parallel for schedule(static)") for (int j = 0; j < (rl)->h; j++)             \
        {                                                                                          \
            double sum = 0;                                                                        \
            for (size_t k = (size_t)j * (size_t)(rl)->w, end = k + (size_t)(rl)->w; k < end; k++)  \
                sum += (expression);                                                               \
            part[j] = sum;                                                                         \
        }                                                                                          \
        (result) = 0;                                                                              \
        for (int j = 0; j < (rl)->h; j++)                                                          \
            (result) += part[j];                                                                   \
        free(part);                                                                                \
    } while (0)

// div(grad u / |grad u|), the slope smoothed at a thousandth of the picture's mean.
static float curvature(const struct rl *r, const float *u, int i, int j, float smooth)
{
    const int w = r->w, left = i > 0 ? i - 1 : i, right = i < w - 1 ? i + 1 : i;
    const int up = j > 0 ? j - 1 : j, down = j < r->h - 1 ? j + 1 : j;
#define U(p, q) u[(size_t)(q) * (size_t)w + (size_t)(p)]
#define SLOPE(p, q, pr, qd)                                                                        \
    sqrtf((U(pr, q) - U(p, q)) * (U(pr, q) - U(p, q)) +                                            \
          (U(p, qd) - U(p, q)) * (U(p, qd) - U(p, q)) + smooth * smooth)
    const float here = SLOPE(i, j, right, down), west = SLOPE(left, j, i, down),
                north = SLOPE(i, up, right, j);
    const float c = (U(right, j) - U(i, j)) / here - (U(i, j) - U(left, j)) / west +
                    (U(i, down) - U(i, j)) / here - (U(i, j) - U(i, up)) / north;
#undef SLOPE
#undef U
    return c;
}

// The factor of total variation (Dey et al. 2006); |curvature| <= 4 and tv < 0.1 keep it positive.
static void pull_flat(const struct rl *r, const float *u, float *factor)
{
    const float smooth = (float)(1e6 * r->least), tv = (float)r->tv;
#pragma omp parallel for schedule(static)
    for (int j = 0; j < r->h; j++)
        for (int i = 0; i < r->w; i++)
            factor[(size_t)j * (size_t)r->w + (size_t)i] /= 1 - tv * curvature(r, u, i, j, smooth);
}

// One iteration: next from u. `model` is left holding H u.
static void iterate(struct rl *r, const float *u, float *next)
{
    blur_apply(r->b, u, r->model);
    const float least = (float)r->least;
#pragma omp parallel for schedule(static)
    for (int j = 0; j < r->h; j++)
        for (size_t k = (size_t)j * (size_t)r->w, end = k + (size_t)r->w; k < end; k++) {
            const float ratio = r->model[k] > least ? r->data[k] / r->model[k] : 0;
            r->step[k] = r->keep ? r->keep[k] * ratio : ratio;
        }
    blur_adjoint(r->b, r->step, next);
    if (r->tv > 0)
        pull_flat(r, u, next);
    const float *norm = r->norm;
#pragma omp parallel for schedule(static)
    for (int j = 0; j < r->h; j++)
        for (size_t k = (size_t)j * (size_t)r->w, end = k + (size_t)r->w; k < end; k++) {
            const float factor = norm[k] > 1e-6f ? next[k] / norm[k] : 1;
            next[k] =
                factor > 0 ? u[k] * factor : 0; // an FFT's adjoint may dip under 0 by rounding
        }
}

// The path u0, u1, ... with Biggs & Andrews' extrapolation when asked: alpha from successive
// changes.
struct path {
    struct rl *r;
    bool accelerate;
    float *u, *last, *start, *change, *change_last; // [h][w]
    int k;
};

static void path_step(struct path *p)
{
    struct rl *r = p->r;
    if (!p->accelerate) {
        iterate(r, p->u, p->last);
        float *swap = p->u;
        p->u = p->last;
        p->last = swap;
        p->k++;
        return;
    }
    double above = 0, below = 0;
    if (p->k >= 2) {
        SUM_ROWS(r, above, (double)p->change[k] * (double)p->change_last[k]);
        SUM_ROWS(r, below, (double)p->change_last[k] * (double)p->change_last[k]);
    }
    const float alpha = below > 0 ? (float)fmax(0, fmin(0.95, above / below)) : 0;
    for (size_t k = 0; k < r->n; k++) {
        const float ahead = p->u[k] + alpha * (p->u[k] - p->last[k]);
        p->start[k] = ahead > 0 ? ahead : 0;
        p->last[k] = p->u[k];
    }
    iterate(r, p->start, p->u);
    float *swap = p->change_last;
    p->change_last = p->change;
    p->change = swap;
    for (size_t k = 0; k < r->n; k++)
        p->change[k] = p->u[k] - p->start[k];
    p->k++;
}

static void path_finish(struct path *p)
{
    free(p->u);
    free(p->last);
    free(p->start);
    free(p->change);
    free(p->change_last);
}

// Starts from the mean: the flattest picture with the data's flux, and no zero that could never
// grow.
static bool path_init(struct path *p, struct rl *r, bool accelerate, double mean, struct err *e)
{
    *p = (struct path){.r = r, .accelerate = accelerate};
    float **buffer[] = {&p->u, &p->last, &p->start, &p->change, &p->change_last};
    for (int k = 0; k < (accelerate ? 5 : 2); k++)
        if (!(*buffer[k] = sample_alloc(r->n, sizeof(float), "deconvolution", e))) {
            path_finish(p);
            return false;
        }
    for (size_t k = 0; k < r->n; k++)
        p->u[k] = (float)mean;
    return true;
}

static uint32_t hash(uint32_t x)
{
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) * 0x846ca68bu;
    return x ^ (x >> 16);
}

// Runs with one sample in ten held out; the count at which the model predicts those best.
static bool choose_iterations(struct rl *r, const struct deconvolve_options *opt, double mean,
                              int *best, bool *reached_most, struct err *e)
{
    const int most = opt->most > 0 ? opt->most : 400;
    struct path p;
    float *keep = sample_alloc(r->n, sizeof *keep, "deconvolution", e);
    float *norm = sample_alloc(r->n, sizeof *norm, "deconvolution", e);
    const bool ok = keep && norm && path_init(&p, r, opt->accelerate, mean, e);
    if (ok) {
        for (size_t k = 0; k < r->n; k++)
            keep[k] = hash((uint32_t)k) % 10 != 0;
        blur_adjoint(r->b, keep, norm);
        float *old_norm = r->norm;
        r->keep = keep;
        r->norm = norm;
        double least = INFINITY;
        *best = 1;
        for (int it = 0; it <= most; it++) { // each step leaves H u of the picture before it
            path_step(&p);
            double miss = 0;
            SUM_ROWS(r, miss,
                     r->keep[k] > 0 ? 0
                                    : ((double)r->model[k] - (double)r->data[k]) *
                                          ((double)r->model[k] - (double)r->data[k]));
            if (miss < least) {
                least = miss;
                *best = it;
            }
            if (it > *best + 5 + *best / 4)
                break;
        }
        *best = *best > 0 ? *best : 1;
        *reached_most = *best == most;
        r->keep = NULL;
        r->norm = old_norm;
        path_finish(&p);
    }
    free(keep);
    free(norm);
    return ok;
}

static bool check(int w, int h, const float *data, struct deconvolve_result *res, struct err *e)
{
    const size_t n = (size_t)w * (size_t)h;
    for (size_t k = 0; k < n; k++) {
        if (!isfinite(data[k]))
            return err_set(e, ERR_DATA, "pixel (%zu, %zu) is not finite", k % (size_t)w,
                           k / (size_t)w);
        res->negative += data[k] < 0;
        res->flux_in += data[k] > 0 ? (double)data[k] : 0;
    }
    return res->flux_in > 0 || err_set(e, ERR_DATA, "the picture is black: nothing to deconvolve");
}

bool deconvolve(struct blur *b, int w, int h, const float *data,
                const struct deconvolve_options *opt, float *out, struct deconvolve_result *result,
                struct err *e)
{
    struct deconvolve_result res = {0};
    if (opt->iterations < 0 || opt->iterations > 100000)
        return err_set(e, ERR_DATA, "bad number of iterations %d: must be 1 to 100000",
                       opt->iterations);
    if (!(opt->tv >= 0 && opt->tv < 0.1))
        return err_set(e, ERR_DATA, "bad weight of total variation %g: must be 0 to 0.1", opt->tv);
    if (!check(w, h, data, &res, e))
        return false;
    struct rl r = {.b = b, .w = w, .h = h, .n = (size_t)w * (size_t)h, .tv = opt->tv};
    const double mean = res.flux_in / (double)r.n;
    r.least = 1e-9 * mean;
    float *clean = sample_alloc(r.n, sizeof *clean, "deconvolution", e);
    float *ones = sample_alloc(r.n, sizeof *ones, "deconvolution", e);
    r.model = sample_alloc(r.n, sizeof *r.model, "deconvolution", e);
    r.step = sample_alloc(r.n, sizeof *r.step, "deconvolution", e);
    r.norm = sample_alloc(r.n, sizeof *r.norm, "deconvolution", e);
    struct path p = {0};
    bool ok = clean && ones && r.model && r.step && r.norm;
    if (ok) {
        for (size_t k = 0; k < r.n; k++) {
            clean[k] = data[k] > 0 ? data[k] : 0;
            ones[k] = 1;
        }
        r.data = clean;
        blur_adjoint(b, ones, r.norm); // 1 but for rounding when the PSF is symmetric
        res.iterations = opt->iterations;
        ok = (opt->iterations ||
              choose_iterations(&r, opt, mean, &res.iterations, &res.reached_most, e)) &&
             path_init(&p, &r, opt->accelerate, mean, e);
    }
    if (ok) {
        while (p.k < res.iterations)
            path_step(&p);
        double flux = 0, miss = 0;
        SUM_ROWS(&r, flux, (double)p.u[k]);
        const float scale =
            (float)(res.flux_in / flux); // takes rounding, and total variation's pull, back
        for (size_t k = 0; k < r.n; k++)
            out[k] = scale * p.u[k];
        SUM_ROWS(&r, res.flux, (double)out[k]);
        blur_apply(b, out, r.model);
        SUM_ROWS(&r, miss,
                 ((double)r.model[k] - (double)clean[k]) * ((double)r.model[k] - (double)clean[k]));
        res.residual = sqrt(miss / (double)r.n);
        *result = res;
    }
    path_finish(&p);
    free(clean);
    free(ones);
    free(r.model);
    free(r.step);
    free(r.norm);
    return ok;
}
