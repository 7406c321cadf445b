// cell.c - folding a periodic picture into its cell, and pictures made of it.
#define _GNU_SOURCE
#include "process/cell.h"
#include "core/mem.h"
#include "process/fft.h"
#include <math.h>
#include <stdlib.h>

enum { TILE = 16, MOST_SIDE = 320 };
static const double INSIDE = 0.93; // share of the radius that is used: the rim is blurred

static int samples_of(double side_px)
{
    const int n = fft_good_size((int)ceil(4 * side_px));
    return n < MOST_SIDE ? n : MOST_SIDE;
}

// Place of pixel (i, j) in the cell, in samples.
static void place(const struct cell *c, double i, double j, double *s, double *t)
{
    const struct lattice *l = &c->lattice;
    const double x = i - c->cx_px, y = j - c->cy_px, p = l->kx[0] * x + l->ky[0] * y,
                 q = l->kx[1] * x + l->ky[1] * y;
    *s = c->ns * (p - floor(p));
    *t = c->nt * (q - floor(q));
}

static size_t bin(const struct cell *c, double i, double j)
{
    double s, t;
    place(c, i, j, &s, &t);
    return (size_t)((int)(t + 0.5) % c->nt) * (size_t)c->ns + (size_t)((int)(s + 0.5) % c->ns);
}

void cell_picture(const struct cell *c, int w, int h, float *out)
{
    for (int j = 0; j < h; j++)
        for (int i = 0; i < w; i++, out++) {
            const size_t k = bin(c, i, j);
            *out = c->count[k] > 0 ? (float)c->mean[k] : 1;
        }
}

// Keys' cubic: what four samples at -1 .. 2 weigh at 0 <= f < 1.
static void cubic(double f, double weight[4])
{
    const double g = 1 - f;
    weight[0] = -0.5 * f * g * g;
    weight[1] = 1 + f * f * (1.5 * f - 2.5);
    weight[2] = 1 + g * g * (1.5 * g - 2.5);
    weight[3] = -0.5 * g * f * f;
}

double cell_at(const struct cell *c, const double *samples, double i, double j)
{
    double s, t, ws[4], wt[4], sum = 0;
    place(c, i, j, &s, &t);
    const int s0 = (int)s, t0 = (int)t;
    cubic(s - s0, ws);
    cubic(t - t0, wt);
    for (int q = 0; q < 4; q++) {
        const double *row = samples + (size_t)((t0 + q - 1 + c->nt) % c->nt) * (size_t)c->ns;
        for (int p = 0; p < 4; p++)
            sum += wt[q] * ws[p] * row[(s0 + p - 1 + c->ns) % c->ns];
    }
    return sum;
}

// The noise of a pixel, from bins that pixels of both halves of a checkerboard fell into: what
// neighbours share is counted, too.
static double noise_of(const double *sum[2], const double *count[2], size_t n)
{
    double square = 0;
    long bins = 0;
    for (size_t k = 0; k < n; k++)
        if (count[0][k] > 0 && count[1][k] > 0) {
            const double off = sum[0][k] / count[0][k] - sum[1][k] / count[1][k];
            square += off * off / (1 / count[0][k] + 1 / count[1][k]);
            bins++;
        }
    return bins ? sqrt(square / (double)bins) : 0;
}

// Means and counts of the bins. With a model of the blurred cell, what pixels deviate from it at
// their own places is added to it: a bin then has the value of its middle, however pixels lie in
// it.
static bool fill_bins(struct cell *c, const struct disc *d, const float *flat, int w, int h,
                      const double *model, struct err *e)
{
    const size_t n = (size_t)c->ns * (size_t)c->nt;
    double *half[4]; // sums and counts of both halves of a checkerboard
    bool ok = true;
    for (int k = 0; k < 4; k++)
        ok = (half[k] = sample_alloc(n, sizeof *half[k], "cell", e)) && ok;
    for (int j = 0; ok && j < h; j++)
        for (int i = 0; i < w; i++) {
            if (hypot(i - d->cx_px, j - d->cy_px) > INSIDE * d->radius_px)
                continue;
            const size_t k = bin(c, i, j);
            const int side = (i / TILE + j / TILE) % 2;
            half[side][k] += (double)flat[(size_t)j * (size_t)w + (size_t)i] -
                             (model ? cell_at(c, model, i, j) : 0);
            half[2 + side][k]++;
        }
    if (ok) {
        c->noise =
            noise_of((const double *[]){half[0], half[1]}, (const double *[]){half[2], half[3]}, n);
        for (size_t k = 0; k < n; k++) {
            c->count[k] = half[2][k] + half[3][k];
            c->mean[k] = (c->count[k] > 0 ? (half[0][k] + half[1][k]) / c->count[k] : 0) +
                         (model ? model[k] : 0);
        }
        c->centred = model;
    }
    for (int k = 0; k < 4; k++)
        free(half[k]);
    return ok;
}

bool cell_fold(struct cell *out, const struct lattice *l, const struct disc *d, const float *flat,
               int w, int h, struct err *e)
{
    struct cell c = {.lattice = *l, .cx_px = d->cx_px, .cy_px = d->cy_px};
    c.ns = samples_of(hypot(l->ax[0], l->ay[0]));
    c.nt = samples_of(hypot(l->ax[1], l->ay[1]));
    double **const owned[] = {&c.mean, &c.count, &c.blurred, &c.sharp};
    bool ok = true;
    for (int k = 0; k < 4; k++)
        ok = ok &&
             (*owned[k] = sample_alloc((size_t)c.ns * (size_t)c.nt, sizeof **owned[k], "cell", e));
    ok = ok && fill_bins(&c, d, flat, w, h, NULL, e);
    if (ok)
        *out = c;
    else
        cell_finish(&c);
    return ok;
}

bool cell_refold(struct cell *c, const struct disc *d, const float *flat, int w, int h,
                 struct err *e)
{
    return fill_bins(c, d, flat, w, h, c->blurred, e);
}

void cell_judge(struct cell *c, const struct disc *d, const float *flat, int w, int h)
{
    double sum = 0, square = 0, off = 0, jumps = 0;
    long n = 0;
    for (int j = 0; j < h; j++)
        for (int i = 1; i < w; i++) {
            if (hypot(i - d->cx_px, j - d->cy_px) > INSIDE * d->radius_px)
                continue;
            const float *v = flat + (size_t)j * (size_t)w + (size_t)i;
            const double model = cell_at(c, c->blurred, i, j), miss = (double)v[0] - model,
                         before = (double)v[-1] - cell_at(c, c->blurred, i - 1, j);
            sum += model;
            square += model * model;
            off += miss * miss;
            jumps += (miss - before) * (miss - before);
            n++;
        }
    const double mean = sum / (double)n;
    c->unexplained = fmax(0, off - jumps / 2) / (square - (double)n * mean * mean);
}

void cell_finish(struct cell *c)
{
    free(c->mean);
    free(c->count);
    free(c->blurred);
    free(c->sharp);
    *c = (struct cell){0};
}
