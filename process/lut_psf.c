// lut_psf.c - an even table with a margin, three FFT convolutions, and its reading at the nodes.
#define _GNU_SOURCE
#include "process/lut_psf.h"
#include "core/mem.h"
#include "process/bspline.h"
#include "process/fft.h"
#include "process/lp_source.h"
#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LARGEST = 4097 }; // nodes a side of the even table

// The light's picture on the even table's steps.
struct light {
    int reach; // steps to each side
    double step;
    float *px; // [3][side][side], each channel's sum 1
};

static bool light_init(struct light *l, const struct lut_psf *psf, double step, struct err *e)
{
    const struct image *im = psf->image;
    const double far_x = fmax(psf->cx, im->w - 1 - psf->cx) + 1;
    const double far_y = fmax(psf->cy, im->h - 1 - psf->cy) + 1;
    const double far = fmax(far_x, far_y) * psf->h_per_px;
    if (!(far <= 1))
        return err_set(e, ERR_DATA, "the picture of the light reaches |h| = %g: must be within 1",
                       far);
    *l = (struct light){.reach = (int)ceil(far / step), .step = step};
    const int side = 2 * l->reach + 1;
    const size_t count = (size_t)side * (size_t)side;
    if (!(l->px = sample_alloc(3 * count, sizeof *l->px, "light", e)))
        return false;
    for (int c = 0; c < 3; c++) {
        struct lut_pattern p;
        struct lp_source s;
        if (!lut_pattern_init(&p, im, im->nc >= 3 ? c : 0, 1, e))
            return false;
        const struct lp_picture picture = {p.px, p.w, p.h, psf->cx, psf->cy, NULL};
        if (!lp_source_init(&s, &picture, e)) {
            lut_pattern_finish(&p);
            return false;
        }
        double sum = 0;
        float *px = l->px + (size_t)c * count;
        for (size_t k = 0; k < count; k++) {
            const double x = (int)(k % (size_t)side) - l->reach;
            const double y = (int)(k / (size_t)side) - l->reach;
            px[k] = (float)fmax(
                0, lp_source_at(&s, x * step / psf->h_per_px, y * step / psf->h_per_px));
            sum += px[k];
        }
        lp_source_finish(&s);
        lut_pattern_finish(&p);
        if (!(sum > 0))
            return err_set(e, ERR_DATA, "the picture of the light is dark");
        for (size_t k = 0; k < count; k++)
            px[k] = (float)(px[k] / sum);
    }
    return true;
}

// plane[n][n] (stride `nc`) convolved with the light's channel c, in place; 0 beyond the border.
static bool convolve(float *plane, int n, int nc, const struct light *l, int c, struct err *e)
{
    const int side = 2 * l->reach + 1, m = fft_good_size(n + side - 1);
    const size_t real = (size_t)m * (size_t)m, half = (size_t)m * (size_t)(m / 2 + 1);
    struct fft *forward = fft_new(FFT_R2C, FFT_FLOAT, m, m, 1, false, e);
    struct fft *backward = forward ? fft_new(FFT_C2R, FFT_FLOAT, m, m, 1, false, e) : NULL;
    float *grid = backward ? sample_alloc(real, sizeof *grid, "table", e) : NULL;
    float complex *a = grid ? sample_alloc(half, sizeof *a, "table", e) : NULL;
    float complex *b = a ? sample_alloc(half, sizeof *b, "table", e) : NULL;
    if (b) {
        const float *px = l->px + (size_t)c * (size_t)side * (size_t)side;
        for (int j = 0; j < side; j++)
            memcpy(grid + (size_t)j * (size_t)m, px + (size_t)j * (size_t)side,
                   (size_t)side * sizeof *px);
        fft_run(forward, grid, b);
        memset(grid, 0, real * sizeof *grid);
        for (int j = 0; j < n; j++)
            for (int i = 0; i < n; i++)
                grid[(size_t)j * (size_t)m + (size_t)i] =
                    plane[((size_t)j * (size_t)n + (size_t)i) * (size_t)nc];
        fft_run(forward, grid, a);
        for (size_t k = 0; k < half; k++)
            a[k] *= b[k] / (float)real;
        fft_run(backward, a, grid);
        for (int j = 0; j < n; j++)
            for (int i = 0; i < n; i++)
                plane[((size_t)j * (size_t)n + (size_t)i) * (size_t)nc] =
                    grid[(size_t)(j + l->reach) * (size_t)m + (size_t)(i + l->reach)];
    }
    free(grid);
    free(a);
    free(b);
    fft_free(forward);
    fft_free(backward);
    return b != NULL;
}

// Channel `plane` (stride nc) of the even table, by a quintic spline, at all nodes of `to`.
static bool read_even(const struct table *even, const float *plane, const struct table *to,
                      float *out, int nc, struct err *e)
{
    const size_t n = (size_t)even->n;
    float *coef = sample_alloc(n * n, sizeof *coef, "table", e);
    if (!coef)
        return false;
    for (size_t k = 0; k < n * n; k++)
        coef[k] = plane[k * (size_t)nc];
    bspline_fit_image(coef, even->n, even->n, BSPLINE_QUINTIC);
#pragma omp parallel for
    for (int j = 0; j < to->n; j++)
        for (int i = 0; i < to->n; i++) {
            const double x = table_index(even, table_node(to, i));
            const double y = table_index(even, table_node(to, j));
            const int a = (int)fmin(x, even->n - 2), b = (int)fmin(y, even->n - 2);
            float wx[6], wy[6], sum = 0;
            bspline_weights_5((float)(x - a), wx);
            bspline_weights_5((float)(y - b), wy);
            for (int q = 0; q < 6; q++) {
                const float *row = coef + (size_t)bspline_mirror(b - 2 + q, even->n) * n;
                float line = 0;
                for (int p = 0; p < 6; p++)
                    line += wx[p] * row[bspline_mirror(a - 2 + p, even->n)];
                sum += wy[q] * line;
            }
            out[((size_t)j * (size_t)to->n + (size_t)i) * (size_t)nc] = sum;
        }
    free(coef);
    return true;
}

static bool spread(struct table *even, const struct light *l, struct table *t, struct err *e)
{
    const size_t count = (size_t)t->n * (size_t)t->n;
    t->cover = sample_alloc(count, sizeof *t->cover, "coverage", e);
    if (t->cover && even->sigma)
        t->sigma = sample_alloc(3 * count, sizeof *t->sigma, "variance", e);
    bool ok = t->cover && (!even->sigma || t->sigma);
    for (int c = 0; ok && c < 3; c++) {
        ok = convolve(even->tab + c, even->n, 3, l, c, e) &&
             read_even(even, even->tab + c, t, t->tab + c, 3, e);
        if (ok && t->sigma)
            ok = convolve(even->sigma + c, even->n, 3, l, c, e) &&
                 read_even(even, even->sigma + c, t, t->sigma + c, 3, e);
    }
    ok = ok && convolve(even->cover, even->n, 1, l, 1, e) &&
         read_even(even, even->cover, t, t->cover, 1, e);
    for (size_t k = 0; ok && k < count; k++)
        t->cover[k] = t->cover[k] > 0.999f;
    return ok;
}

bool lut_build_psf(const struct lut_request *r, const struct lut_psf *psf, struct table *t,
                   struct lut_report *report, struct err *e)
{
    if (!(psf->h_per_px > 0))
        return err_set(e, ERR_DATA, "bad h per pixel %g of the light: must be positive",
                       psf->h_per_px);
    double step = 0.7 * fmin(psf->h_per_px, r->pattern->h_per_px);
    struct light l = {0};
    struct table even = {0}, got = {0};
    bool ok = light_init(&l, psf, step, e);
    struct lut_request wide = *r;
    wide.power = 1;
    wide.is_rgb = true;
    if (ok) { // nodes at whole steps, so that the middle is one
        const int side = (int)fmin(ceil(r->range / step) + l.reach + 3, floor(2 / step));
        wide.n = 2 * side + 1;
        wide.range = side * step;
        if (wide.n > LARGEST)
            ok = err_set(e, ERR_DATA, "the light's picture needs %d nodes a side, more than %d",
                         wide.n, LARGEST);
    }
    ok = ok && table_init(&got, r->n, r->range, r->power, 1, e) &&
         lut_build(&wide, &even, report, e) && spread(&even, &l, &got, e);
    if (ok) {
        got.is_rgb = r->is_rgb;
        for (size_t k = 0; !r->is_rgb && k < (size_t)got.n * (size_t)got.n; k++) {
            double rgb[3], xyz[3];
            for (int c = 0; c < 3; c++)
                rgb[c] = got.tab[3 * k + (size_t)c];
            rgb_to_xyz(rgb, xyz);
            for (int c = 0; c < 3; c++)
                got.tab[3 * k + (size_t)c] = (float)xyz[c];
        }
        *t = got;
    } else
        table_finish(&got);
    table_finish(&even);
    free(l.px);
    return ok;
}
