// lens.c - direct convolutions.
#define _GNU_SOURCE
#include "sim/lens.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

static double *kernel(double sigma, int *reach)
{
    *reach = (int)ceil(5 * sigma);
    double *k = xcalloc((size_t)*reach + 1, sizeof *k);
    for (int i = 0; i <= *reach; i++)
        k[i] = exp(-0.5 * i * i / (sigma * sigma));
    return k;
}

// out[i] from in[0], in[step], ...: n samples.
static void blur_line(const float *in, float *out, int n, size_t step, const double *k, int reach)
{
    for (int i = 0; i < n; i++) {
        const int a = i - reach > 0 ? i - reach : 0, b = i + reach < n ? i + reach : n - 1;
        double sum = 0, weight = 0;
        for (int j = a; j <= b; j++) {
            sum += k[abs(j - i)] * (double)in[(size_t)j * step];
            weight += k[abs(j - i)];
        }
        out[(size_t)i * step] = (float)(sum / weight);
    }
}

bool lens_blur(struct image *im, int channel, double sigma_px, struct err *e)
{
    if (!(sigma_px > 0))
        return true;
    const size_t nc = (size_t)im->nc, row = (size_t)im->w * nc;
    float *tmp = sample_alloc(row * (size_t)im->h, sizeof *tmp, "blur", e);
    if (!tmp)
        return false;
    int reach;
    double *k = kernel(sigma_px, &reach);
#pragma omp parallel for schedule(static)
    for (int j = 0; j < im->h; j++) {
        const size_t at = (size_t)j * row + (size_t)channel;
        blur_line(im->px + at, tmp + at, im->w, nc, k, reach);
    }
#pragma omp parallel for schedule(static)
    for (int i = 0; i < im->w; i++) {
        const size_t at = (size_t)i * nc + (size_t)channel;
        blur_line(tmp + at, im->px + at, im->h, row, k, reach);
    }
    free(k);
    free(tmp);
    return true;
}

struct blocks {
    int side, w, h; // pixels of a block; blocks
    double *sum;    // [h][w] light of a block
    double *veil;   // [h][w] in its middle, per pixel
};

static void gather(const struct image *im, int c, struct blocks *b)
{
    for (int k = 0; k < b->w * b->h; k++)
        b->sum[k] = 0;
    for (int j = 0; j < im->h; j++)
        for (int i = 0; i < im->w; i++)
            b->sum[(j / b->side) * b->w + i / b->side] +=
                (double)
                    im->px[((size_t)j * (size_t)im->w + (size_t)i) * (size_t)im->nc + (size_t)c];
}

static void spread(struct blocks *b, double radius_px)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < b->h; j++)
        for (int i = 0; i < b->w; i++) {
            double sum = 0;
            for (int q = 0; q < b->h; q++)
                for (int p = 0; p < b->w; p++) {
                    const double x = (p - i) * b->side, y = (q - j) * b->side;
                    const double r2 = x * x + y * y + radius_px * radius_px;
                    sum += b->sum[q * b->w + p] * radius_px / (2 * M_PI * r2 * sqrt(r2));
                }
            b->veil[j * b->w + i] = sum;
        }
}

static double between(const struct blocks *b, double x, double y) // bilinear, in blocks
{
    x = fmax(0, fmin(b->w - 1, x));
    y = fmax(0, fmin(b->h - 1, y));
    const int i = x < b->w - 1 ? (int)x : b->w - 2 >= 0 ? b->w - 2 : 0;
    const int j = y < b->h - 1 ? (int)y : b->h - 2 >= 0 ? b->h - 2 : 0;
    const int i1 = i + 1 < b->w ? i + 1 : i, j1 = j + 1 < b->h ? j + 1 : j;
    const double fx = x - i, fy = y - j, *v = b->veil;
    return (1 - fy) * ((1 - fx) * v[j * b->w + i] + fx * v[j * b->w + i1]) +
           fy * ((1 - fx) * v[j1 * b->w + i] + fx * v[j1 * b->w + i1]);
}

bool lens_glare(struct image *im, double part, double radius_px, struct err *e)
{
    if (!(part > 0))
        return true;
    const int side = (int)fmax(1, fmax(floor(radius_px / 4), (im->w > im->h ? im->w : im->h) / 80));
    struct blocks b = {side, (im->w + side - 1) / side, (im->h + side - 1) / side, NULL, NULL};
    b.sum = sample_alloc(2 * (size_t)b.w * (size_t)b.h, sizeof *b.sum, "glare", e);
    if (!b.sum)
        return false;
    b.veil = b.sum + (size_t)b.w * (size_t)b.h;
    for (int c = 0; c < im->nc; c++) {
        gather(im, c, &b);
        spread(&b, radius_px);
#pragma omp parallel for schedule(static)
        for (int j = 0; j < im->h; j++)
            for (int i = 0; i < im->w; i++) {
                float *px =
                    im->px + ((size_t)j * (size_t)im->w + (size_t)i) * (size_t)im->nc + (size_t)c;
                const double veil = between(&b, (i + 0.5) / side - 0.5, (j + 0.5) / side - 0.5);
                *px = (float)((1 - part) * (double)*px + part * veil);
            }
    }
    free(b.sum);
    return true;
}
