// deconvolve.c - Richardson-Lucy iterations, their acceleration, their end.
#define _GNU_SOURCE
#include "process/deconvolve.h"
#include "core/mem.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define CLONES __attribute__((target_clones("avx512f", "arch=x86-64-v3", "default")))

// Pictures are [h][stride] in the blur's order (process/blur.h) unless they are called plain; their
// padding is 0.
struct rl {
    struct blur *b;
    int w, h;
    size_t stride, n;  // n = h stride
    const float *data; // >= 0
    float *keep;       // 1 where a sample is used, 0 where held out; NULL: all used
    float *norm;       // 1 / H^T keep; NULL: 1 everywhere
    float *pull;       // the factor of total variation; NULL: none
    float *plain[2];   // [h][w] scratch; the second only for total variation
    double least;      // a model sample under it counts as dark: no division
    double tv;
};

// Sum of f over rows of `width` samples in double, rows in order: the same bytes for any number of
// threads.
#define SUM_ROWS(result, rows, width, expression)                                                  \
    do {                                                                                           \
        double *part = xcalloc((size_t)(rows), sizeof *part);                                      \
        _Pragma("omp parallel for schedule(static)") for (int j = 0; j < (rows); j++)              \
        {                                                                                          \
            double sum = 0;                                                                        \
            for (size_t k = (size_t)j * (width), end = k + (width); k < end; k++)                  \
                sum += (expression);                                                               \
            part[j] = sum;                                                                         \
        }                                                                                          \
        (result) = 0;                                                                              \
        for (int j = 0; j < (rows); j++)                                                           \
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
static void pull_flat(const struct rl *r, const float *u)
{
    const float smooth = (float)(1e6 * r->least), tv = (float)r->tv;
    blur_unorder(r->b, u, r->plain[0]);
#pragma omp parallel for schedule(static)
    for (int j = 0; j < r->h; j++)
        for (int i = 0; i < r->w; i++)
            r->plain[1][(size_t)j * (size_t)r->w + (size_t)i] =
                1 / (1 - tv * curvature(r, r->plain[0], i, j, smooth));
    blur_order(r->b, r->plain[1], r->pull);
}

struct turn { // one iteration, as the blurs' samples come
    struct rl *r;
    const float *u;
    float *next, *model; // model NULL: not kept
};

// Blurred rows come in fours: asks for those of the next turn.
static inline void prefetch(const float *px, int n, bool to_write)
{
    for (int k = 0; k < n; k += 16)
        if (to_write)
            __builtin_prefetch(px + k, 1);
        else
            __builtin_prefetch(px + k, 0);
}

CLONES static void take_ratio(void *ctx, const struct blur_run *run)
{
    const struct turn *t = ctx;
    const struct rl *r = t->r;
    const size_t at = (size_t)run->j * r->stride + (size_t)run->i;
    const float *data = r->data + at, least = (float)r->least;
    float *px = run->px;
    if (t->model && !run->again)
        memcpy(t->model + at, px, (size_t)run->n * sizeof *px);
    prefetch(data + 4 * r->stride, run->n, false);
    for (int k = 0; k < run->n; k++)
        px[k] = px[k] > least ? data[k] / px[k] : 0;
    if (r->keep)
        for (int k = 0; k < run->n; k++)
            px[k] *= r->keep[at + (size_t)k];
}

CLONES static void take_factor(void *ctx, const struct blur_run *run)
{
    const struct turn *t = ctx;
    const size_t at = (size_t)run->j * t->r->stride + (size_t)run->i;
    const float *u = t->u + at, *norm = t->r->norm, *px = run->px;
    float *restrict next = t->next + at;
    prefetch(next + 4 * t->r->stride, run->n, true);
    for (int k = 0; k < run->n; k++) // an FFT's adjoint may dip under 0 by rounding
        next[k] = px[k] > 0 ? u[k] * px[k] : 0;
    if (norm)
        for (int k = 0; k < run->n; k++)
            next[k] *= norm[at + (size_t)k];
}

// One iteration: next from u, another array. H u is left in model unless that is NULL.
static void iterate(struct rl *r, const float *u, float *next, float *model)
{
    struct turn t = {r, u, next, model};
    if (r->tv > 0)
        pull_flat(r, u);
    blur_round(r->b, u, take_ratio, take_factor, &t);
    if (r->tv > 0)
        for (size_t k = 0; k < r->n; k++)
            next[k] *= r->pull[k];
}

// The path u0, u1, ... with Biggs & Andrews' extrapolation when asked: alpha from successive
// changes.
struct path {
    struct rl *r;
    bool accelerate;
    float *u, *start, *last, *change, *change_last; // [h][w]; start: from where, or the next u
    int k;
};

// One step; H of the picture that the step started from is left in model unless that is NULL.
static void path_step(struct path *p, float *model)
{
    struct rl *r = p->r;
    if (!p->accelerate) {
        iterate(r, p->u, p->start, model);
        float *swap = p->u;
        p->u = p->start;
        p->start = swap;
        p->k++;
        return;
    }
    double above = 0, below = 0;
    if (p->k >= 2) {
        SUM_ROWS(above, r->h, r->stride, (double)p->change[k] * (double)p->change_last[k]);
        SUM_ROWS(below, r->h, r->stride, (double)p->change_last[k] * (double)p->change_last[k]);
    }
    const float alpha = below > 0 ? (float)fmax(0, fmin(0.95, above / below)) : 0;
    for (size_t k = 0; k < r->n; k++) {
        const float ahead = p->u[k] + alpha * (p->u[k] - p->last[k]);
        p->start[k] = ahead > 0 ? ahead : 0;
        p->last[k] = p->u[k];
    }
    iterate(r, p->start, p->u, model);
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
    float **buffer[] = {&p->u, &p->start, &p->last, &p->change, &p->change_last};
    for (int k = 0; k < (accelerate ? 5 : 2); k++)
        if (!(*buffer[k] = sample_alloc(r->n, sizeof(float), "deconvolution", e))) {
            path_finish(p);
            return false;
        }
    for (size_t k = 0; k < (size_t)r->w * (size_t)r->h; k++)
        r->plain[0][k] = (float)mean;
    blur_order(r->b, r->plain[0], p->u);
    return true;
}

static uint32_t hash(uint32_t x)
{
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) * 0x846ca68bu;
    return x ^ (x >> 16);
}

// norm := 1 / H^T keep, and 1 where nothing is kept near; keep plain, `scratch` too.
static void make_norm(struct rl *r, const float *keep, float *scratch, float *norm)
{
    blur_adjoint(r->b, keep, scratch);
    for (size_t k = 0; k < (size_t)r->w * (size_t)r->h; k++)
        scratch[k] = scratch[k] > 1e-6f ? 1 / scratch[k] : 1;
    blur_order(r->b, scratch, norm);
}

// Runs with one sample in ten held out; the count at which the model predicts those best.
static bool choose_iterations(struct rl *r, const struct deconvolve_options *opt, double mean,
                              int *best, bool *reached_most, struct err *e)
{
    const int most = opt->most > 0 ? opt->most : 400;
    struct path p;
    float *keep = sample_alloc(r->n, sizeof *keep, "deconvolution", e);
    float *norm = sample_alloc(r->n, sizeof *norm, "deconvolution", e);
    float *model = sample_alloc(r->n, sizeof *model, "deconvolution", e);
    const bool ok = keep && norm && model && path_init(&p, r, opt->accelerate, mean, e);
    if (ok) {
        float *plain = r->plain[0];
        for (size_t k = 0; k < (size_t)r->w * (size_t)r->h; k++)
            plain[k] = hash((uint32_t)k) % 10 != 0;
        make_norm(r, plain, model, norm);
        blur_order(r->b, plain, keep);
        float *old_norm = r->norm;
        r->keep = keep;
        r->norm = norm;
        double least = INFINITY;
        *best = 1;
        for (int it = 0; it <= most; it++) { // each step leaves H u of the picture before it
            path_step(&p, model);
            double miss = 0;
            SUM_ROWS(miss, r->h, r->stride,
                     r->keep[k] > 0 || !(norm[k] > 0) // used, or padding
                         ? 0
                         : ((double)model[k] - (double)r->data[k]) *
                               ((double)model[k] - (double)r->data[k]));
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
    free(model);
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
    struct rl r = {.b = b, .w = w, .h = h, .stride = blur_stride(b), .tv = opt->tv};
    const size_t n = (size_t)w * (size_t)h;
    const double mean = res.flux_in / (double)n;
    const bool symmetric = blur_is_symmetric(b); // then H^T 1 is 1 but for rounding
    r.n = (size_t)h * r.stride;
    r.least = 1e-9 * mean;
    r.plain[0] = out;
    float *clean = sample_alloc(r.n, sizeof *clean, "deconvolution", e);
    bool ok = clean != NULL;
    if (ok && opt->tv > 0)
        ok = (r.pull = sample_alloc(r.n, sizeof *r.pull, "deconvolution", e)) &&
             (r.plain[1] = sample_alloc(n, sizeof *r.plain[1], "deconvolution", e));
    if (ok && !symmetric)
        ok = (r.norm = sample_alloc(r.n, sizeof *r.norm, "deconvolution", e));
    struct path p = {0};
    if (ok) {
        if (!symmetric) {
            for (size_t k = 0; k < n; k++)
                out[k] = 1;
            make_norm(&r, out, clean, r.norm);
        }
        for (size_t k = 0; k < n; k++)
            out[k] = data[k] > 0 ? data[k] : 0;
        blur_order(b, out, clean);
        r.data = clean;
        res.iterations = opt->iterations;
        ok = (opt->iterations ||
              choose_iterations(&r, opt, mean, &res.iterations, &res.reached_most, e)) &&
             path_init(&p, &r, opt->accelerate, mean, e);
    }
    if (ok) {
        while (p.k < res.iterations)
            path_step(&p, NULL);
        double flux = 0, miss = 0;
        SUM_ROWS(flux, h, r.stride, (double)p.u[k]);
        const float scale =
            (float)(res.flux_in / flux); // takes rounding, and total variation's pull, back
        for (size_t k = 0; k < r.n; k++)
            p.u[k] *= scale;
        blur_unorder(b, p.u, out);
        SUM_ROWS(res.flux, h, (size_t)w, (double)out[k]);
        float *model = p.start; // plain: large enough
        blur_apply(b, out, model);
        SUM_ROWS(miss, h, (size_t)w,
                 ((double)model[k] - fmax(0, (double)data[k])) *
                     ((double)model[k] - fmax(0, (double)data[k])));
        res.residual = sqrt(miss / (double)n);
        *result = res;
    }
    path_finish(&p);
    free(clean);
    free(r.pull);
    free(r.plain[1]);
    free(r.norm);
    return ok;
}
