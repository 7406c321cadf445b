// blur.c - direct passes for small Gaussians, FFTs on the reflected picture for any other PSF.
#define _GNU_SOURCE
#include "process/blur.h"
#include "core/mem.h"
#include "process/blur_direct.h"
#include "process/fft.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct blur {
    int w, h;
    struct direct direct; // taps NULL: FFT
    // the picture with px, py reflected samples on each side, in a transform of fw x fh
    struct fft *forward, *backward;
    float *plane;    // [fh][fw]
    float *spectrum; // [fh][fw/2+1][2]
    float *psf;      // [fh][fw/2+1][2], scaled by 1 / (fw fh)
    int px, py, fw, fh;
};

int blur_reflect(int i, int n)
{
    if (i < -n || i >= 2 * n) {
        const int period = 2 * n;
        i = ((i % period) + period) % period;
    }
    return i < 0 ? -1 - i : i < n ? i : 2 * n - 1 - i;
}

// plane := plane convolved with the PSF, or correlated when `adjoint`.
static void convolve(struct blur *b, bool adjoint)
{
    fft_run(b->forward, b->plane, b->spectrum);
    const size_t n = (size_t)b->fh * (size_t)(b->fw / 2 + 1);
    const float sign = adjoint ? -1.0f : 1.0f;
    for (size_t k = 0; k < n; k++) {
        const float a = b->spectrum[2 * k], c = b->spectrum[2 * k + 1], p = b->psf[2 * k],
                    q = sign * b->psf[2 * k + 1];
        b->spectrum[2 * k] = a * p - c * q;
        b->spectrum[2 * k + 1] = a * q + c * p;
    }
    fft_run(b->backward, b->spectrum, b->plane);
}

static float *plane_row(const struct blur *b, int j)
{
    return b->plane + (size_t)(j + b->py) * (size_t)b->fw + b->px;
}

// plane := H in, in its middle.
static void transform(struct blur *b, const float *in)
{
    memset(b->plane, 0, (size_t)b->fw * (size_t)b->fh * sizeof *b->plane);
    for (int j = -b->py; j < b->h + b->py; j++)
        for (int i = -b->px; i < b->w + b->px; i++)
            plane_row(b, j)[i] =
                in[(size_t)blur_reflect(j, b->h) * (size_t)b->w + (size_t)blur_reflect(i, b->w)];
    convolve(b, false);
}

// What was reflected outwards folds back: first the columns at the sides, then the rows above and
// below.
static void fold(struct blur *b)
{
    const size_t fw = (size_t)b->fw;
    for (int j = 0; j < b->h + 2 * b->py; j++) {
        float *row = b->plane + (size_t)j * fw + b->px;
        for (int i = 1; i <= b->px; i++) {
            row[blur_reflect(-i, b->w)] += row[-i];
            row[blur_reflect(b->w - 1 + i, b->w)] += row[b->w - 1 + i];
        }
    }
    for (int q = 1; q <= b->py; q++) {
        const int beyond[2] = {-q, b->h - 1 + q};
        for (int k = 0; k < 2; k++) {
            const float *from = b->plane + (size_t)(beyond[k] + b->py) * fw + b->px;
            float *to = b->plane + (size_t)(blur_reflect(beyond[k], b->h) + b->py) * fw + b->px;
            for (int i = 0; i < b->w; i++)
                to[i] += from[i];
        }
    }
}

// plane := H^T of its middle, in its middle.
static void transform_back(struct blur *b)
{
    const size_t right = (size_t)(b->fw - b->px - b->w);
    memset(b->plane, 0, (size_t)b->py * (size_t)b->fw * sizeof *b->plane);
    for (int j = 0; j < b->h; j++) {
        memset(plane_row(b, j) - b->px, 0, (size_t)b->px * sizeof *b->plane);
        memset(plane_row(b, j) + b->w, 0, right * sizeof *b->plane);
    }
    memset(plane_row(b, b->h) - b->px, 0,
           (size_t)(b->fh - b->py - b->h) * (size_t)b->fw * sizeof *b->plane);
    convolve(b, true);
    fold(b);
}

static void hand_out(struct blur *b, blur_on_run *fn, void *ctx)
{
    for (int j = 0; j < b->h; j++)
        fn(ctx, &(struct blur_run){0, j, b->w, false, plane_row(b, j)});
}

void blur_round(struct blur *b, const float *in, blur_on_run *between, blur_on_run *fn, void *ctx)
{
    if (b->direct.taps) { // a symmetric kernel between reflecting borders is its own adjoint
        direct_round(&b->direct, in, between, fn, ctx);
        return;
    }
    transform(b, in);
    hand_out(b, between, ctx);
    transform_back(b);
    hand_out(b, fn, ctx);
}

size_t blur_stride(const struct blur *b)
{
    return (size_t)(b->direct.steps ? 16 * b->direct.steps : b->w);
}

void blur_order(const struct blur *b, const float *in, float *out)
{
    if (b->direct.steps)
        direct_order(&b->direct, in, out);
    else
        memcpy(out, in, (size_t)b->w * (size_t)b->h * sizeof *out);
}

void blur_unorder(const struct blur *b, const float *in, float *out)
{
    if (b->direct.steps)
        direct_unorder(&b->direct, in, out);
    else
        memcpy(out, in, (size_t)b->w * (size_t)b->h * sizeof *out);
}

struct store {
    float *out; // [h][w]
    int w;
};

static void store_run(void *ctx, const struct blur_run *run)
{
    const struct store *s = ctx;
    memcpy(s->out + (size_t)run->j * (size_t)s->w + run->i, run->px,
           (size_t)run->n * sizeof *run->px);
}

void blur_apply(struct blur *b, const float *in, float *out)
{
    struct store to = {out, b->w};
    if (b->direct.taps) {
        direct_apply(&b->direct, in, store_run, &to);
        return;
    }
    transform(b, in);
    hand_out(b, store_run, &to);
}

void blur_adjoint(struct blur *b, const float *in, float *out)
{
    struct store to = {out, b->w};
    if (b->direct.taps) {
        direct_apply(&b->direct, in, store_run, &to);
        return;
    }
    for (int j = 0; j < b->h; j++)
        memcpy(plane_row(b, j), in + (size_t)j * (size_t)b->w, (size_t)b->w * sizeof *in);
    transform_back(b);
    hand_out(b, store_run, &to);
}

bool blur_is_symmetric(const struct blur *b)
{
    return b->direct.taps;
}

void blur_free(struct blur *b)
{
    if (!b)
        return;
    fft_free(b->forward);
    fft_free(b->backward);
    direct_finish(&b->direct);
    free(b->plane);
    free(b->spectrum);
    free(b->psf);
    free(b);
}

struct blur *blur_psf(int w, int h, const float *psf, int pw, int ph, struct err *e)
{
    if (pw > w || ph > h) {
        err_set(e, ERR_DATA, "a PSF of %d x %d is larger than the picture of %d x %d", pw, ph, w,
                h);
        return NULL;
    }
    double sum = 0;
    for (int k = 0; k < pw * ph; k++) {
        if (!(psf[k] >= 0)) {
            err_set(e, ERR_DATA, "PSF sample (%d, %d) is %g: must not be negative", k % pw, k / pw,
                    (double)psf[k]);
            return NULL;
        }
        sum += (double)psf[k];
    }
    if (!(sum > 0 && isfinite(sum))) {
        err_set(e, ERR_DATA, "the PSF sums to %g: must be positive", sum);
        return NULL;
    }
    struct blur *b = xcalloc(1, sizeof *b);
    *b = (struct blur){.w = w, .h = h, .px = pw / 2 + 1, .py = ph / 2 + 1};
    b->fw = fft_good_size(w + 2 * b->px);
    b->fh = fft_good_size(h + 2 * b->py);
    const size_t half = (size_t)b->fh * (size_t)(b->fw / 2 + 1);
    b->forward = fft_new(FFT_R2C, FFT_FLOAT, b->fh, b->fw, 1, false, e);
    b->backward = fft_new(FFT_C2R, FFT_FLOAT, b->fh, b->fw, 1, false, e);
    b->plane = sample_alloc((size_t)b->fw * (size_t)b->fh, sizeof *b->plane, "blur", e);
    b->spectrum = sample_alloc(half * 2, sizeof *b->spectrum, "blur", e);
    b->psf = sample_alloc(half * 2, sizeof *b->psf, "blur", e);
    if (!b->forward || !b->backward || !b->plane || !b->spectrum || !b->psf) {
        blur_free(b);
        return NULL;
    }
    const double scale = 1 / (sum * b->fw * b->fh);
    for (int q = 0; q < ph; q++)
        for (int p = 0; p < pw; p++) {
            const int i = (p - pw / 2 + b->fw) % b->fw, j = (q - ph / 2 + b->fh) % b->fh;
            b->plane[(size_t)j * (size_t)b->fw + (size_t)i] =
                (float)((double)psf[q * pw + p] * scale);
        }
    fft_run(b->forward, b->plane, b->psf);
    return b;
}

// The Gaussian integrated over each pixel would blur by the pixel twice: the samples of the curve
// are it. One half.
static double *gauss_kernel(double sigma_px, int radius)
{
    double *k = xcalloc((size_t)radius + 1, sizeof *k), sum = 0;
    for (int m = -radius; m <= radius; m++)
        sum += exp(-0.5 * m * m / (sigma_px * sigma_px));
    for (int m = 0; m <= radius; m++)
        k[m] = exp(-0.5 * m * m / (sigma_px * sigma_px)) / sum;
    return k;
}

static struct blur *gauss_by_fft(int w, int h, const double *k, int radius, struct err *e)
{
    const int n = 2 * radius + 1;
    float *psf = sample_alloc((size_t)n * (size_t)n, sizeof *psf, "blur", e);
    for (int j = 0; psf && j < n; j++)
        for (int i = 0; i < n; i++)
            psf[j * n + i] = (float)(k[abs(i - radius)] * k[abs(j - radius)]);
    struct blur *b = psf ? blur_psf(w, h, psf, n, n, e) : NULL;
    free(psf);
    return b;
}

struct blur *blur_gauss(int w, int h, double sigma_px, struct err *e)
{
    const int side = w < h ? w : h;
    if (!(sigma_px > 0) || sigma_px > side / 4.0) {
        err_set(e, ERR_DATA,
                "sigma %g px: must be positive and at most a quarter of the smaller side (%d px)",
                sigma_px, side);
        return NULL;
    }
    enum {
        FFT_RADIUS = 110
    }; // measured at 1024 x 1024, one thread: beyond it two FFTs are cheaper
    const int radius = (int)ceil(4 * sigma_px);
    double *kernel = gauss_kernel(sigma_px, radius);
    struct blur *b;
    if (radius > FFT_RADIUS && 2 * radius + 1 <= side) {
        b = gauss_by_fft(w, h, kernel, radius, e);
    } else {
        b = xcalloc(1, sizeof *b);
        *b = (struct blur){.w = w, .h = h};
        if (!direct_init(&b->direct, w, h, kernel, radius, e)) {
            free(b);
            b = NULL;
        }
    }
    free(kernel);
    return b;
}
