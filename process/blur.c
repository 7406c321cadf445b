// blur.c - separable Gaussian passes in bands of rows, or FFTs on the reflected picture.
#define _GNU_SOURCE
#include "process/blur.h"
#include "core/mem.h"
#include "process/fft.h"
#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

struct blur {
    int w, h;
    // direct: kernel[0..radius] is one half; all taps are symmetric
    float *kernel;
    int radius;
    // FFT: the picture with px, py reflected samples on each side, in a transform of fw x fh
    struct fft *forward, *backward;
    float *plane;    // [fh][fw]
    float *spectrum; // [fh][fw/2+1][2]
    float *psf;      // [fh][fw/2+1][2], scaled by 1 / (fw fh)
    int px, py, fw, fh;
};

enum { LANES = 32, BAND = 256 }; // samples kept in registers; rows that a core does at a time

// Index of the reflected sample; |i| may exceed the side by any amount.
static int reflect(int i, int n)
{
    const int period = 2 * n;
    i = ((i % period) + period) % period;
    return i < n ? i : period - 1 - i;
}

// Sixteen samples, loaded from anywhere. Without AVX-512 the compiler takes two or four registers
// for it.
typedef float vec __attribute__((vector_size(64), aligned(4), may_alias));

// A macro: a function that returns a vec would have another ABI in each clone.
#define load(p) (*(const vec *)(p))

#define CLONES __attribute__((target_clones("avx512f", "avx2", "default")))

// out[i] = k[0] in[i] + sum over m of k[m] (in[i - m] + in[i + m]), along a row.
CLONES static void row_pass(const float *in, float *out, int n, const float *k, int radius)
{
    int i = 0;
    for (; i + LANES <= n; i += LANES) {
        vec a = k[0] * load(in + i), b = k[0] * load(in + i + 16);
        for (int m = 1; m <= radius; m++) {
            a += k[m] * (load(in + i - m) + load(in + i + m));
            b += k[m] * (load(in + i + 16 - m) + load(in + i + 16 + m));
        }
        *(vec *)(out + i) = a;
        *(vec *)(out + i + 16) = b;
    }
    for (; i < n; i++) {
        float sum = k[0] * in[i];
        for (int m = 1; m <= radius; m++)
            sum += k[m] * (in[i - m] + in[i + m]);
        out[i] = sum;
    }
}

// The same down the columns; row[m] for m in -radius..radius are the rows around.
CLONES static void column_pass(const float *const *row, float *out, int n, const float *k,
                               int radius)
{
    int i = 0;
    for (; i + LANES <= n; i += LANES) {
        vec a = k[0] * load(row[0] + i), b = k[0] * load(row[0] + i + 16);
        for (int m = 1; m <= radius; m++) {
            a += k[m] * (load(row[-m] + i) + load(row[m] + i));
            b += k[m] * (load(row[-m] + i + 16) + load(row[m] + i + 16));
        }
        *(vec *)(out + i) = a;
        *(vec *)(out + i + 16) = b;
    }
    for (; i < n; i++) {
        float sum = k[0] * row[0][i];
        for (int m = 1; m <= radius; m++)
            sum += k[m] * (row[-m][i] + row[m][i]);
        out[i] = sum;
    }
}

// Rows of 2^n samples would all fall into the same lines of the cache.
static size_t row_stride(int w)
{
    return ((size_t)w + 15) / 16 * 16 + 16;
}

// A band of rows: each row is blurred along itself into a ring of as many rows as the kernel is
// high; once the ring is full, every new row completes one row of the result.
static void direct_band(const struct blur *b, const float *in, float *out, int first, int last,
                        float *line, float *ring, const float **row)
{
    const int w = b->w, r = b->radius, high = 2 * r + 1;
    for (int j = first - r; j < last + r; j++) {
        const float *from = in + (size_t)reflect(j, b->h) * (size_t)w;
        memcpy(line + r, from, (size_t)w * sizeof *line);
        for (int m = 1; m <= r; m++) {
            line[r - m] = from[reflect(-m, w)];
            line[r + w - 1 + m] = from[reflect(w - 1 + m, w)];
        }
        const int k = j - first + r;
        float *to = ring + (size_t)(k % high) * row_stride(w);
        row_pass(line + r, to, w, b->kernel, r);
        row[k] = to;
        if (k >= 2 * r)
            column_pass(row + (k - r), out + (size_t)(j - r) * (size_t)w, w, b->kernel, r);
    }
}

static void direct(const struct blur *b, const float *in, float *out)
{
    const int bands = (b->h + BAND - 1) / BAND;
#pragma omp parallel
    {
        float *line = xcalloc((size_t)(b->w + 2 * b->radius), sizeof *line);
        float *ring = xcalloc((size_t)(2 * b->radius + 1) * row_stride(b->w), sizeof *ring);
        const float **row = xcalloc((size_t)(BAND + 2 * b->radius), sizeof *row);
#pragma omp for schedule(static)
        for (int k = 0; k < bands; k++)
            direct_band(b, in, out, k * BAND, (k + 1) * BAND < b->h ? (k + 1) * BAND : b->h, line,
                        ring, row);
        free(row);
        free(ring);
        free(line);
    }
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

void blur_apply(struct blur *b, const float *in, float *out)
{
    if (!b->forward) {
        direct(b, in, out);
        return;
    }
    memset(b->plane, 0, (size_t)b->fw * (size_t)b->fh * sizeof *b->plane);
    for (int j = -b->py; j < b->h + b->py; j++)
        for (int i = -b->px; i < b->w + b->px; i++)
            b->plane[(size_t)(j + b->py) * (size_t)b->fw + (size_t)(i + b->px)] =
                in[(size_t)reflect(j, b->h) * (size_t)b->w + (size_t)reflect(i, b->w)];
    convolve(b, false);
    for (int j = 0; j < b->h; j++)
        memcpy(out + (size_t)j * (size_t)b->w,
               b->plane + (size_t)(j + b->py) * (size_t)b->fw + b->px, (size_t)b->w * sizeof *out);
}

void blur_adjoint(struct blur *b, const float *in, float *out)
{
    if (!b->forward) { // a symmetric kernel between reflecting borders is its own adjoint
        direct(b, in, out);
        return;
    }
    memset(b->plane, 0, (size_t)b->fw * (size_t)b->fh * sizeof *b->plane);
    for (int j = 0; j < b->h; j++)
        memcpy(b->plane + (size_t)(j + b->py) * (size_t)b->fw + b->px,
               in + (size_t)j * (size_t)b->w, (size_t)b->w * sizeof *in);
    convolve(b, true);
    memset(out, 0, (size_t)b->w * (size_t)b->h * sizeof *out);
    for (int j = -b->py; j < b->h + b->py; j++) // what was reflected outwards folds back
        for (int i = -b->px; i < b->w + b->px; i++)
            out[(size_t)reflect(j, b->h) * (size_t)b->w + (size_t)reflect(i, b->w)] +=
                b->plane[(size_t)(j + b->py) * (size_t)b->fw + (size_t)(i + b->px)];
}

void blur_free(struct blur *b)
{
    if (!b)
        return;
    fft_free(b->forward);
    fft_free(b->backward);
    free(b->kernel);
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
// are it.
static float *gauss_kernel(double sigma_px, int radius)
{
    float *k = xcalloc((size_t)radius + 1, sizeof *k);
    double sum = 0;
    for (int m = -radius; m <= radius; m++)
        sum += exp(-0.5 * m * m / (sigma_px * sigma_px));
    for (int m = 0; m <= radius; m++)
        k[m] = (float)(exp(-0.5 * m * m / (sigma_px * sigma_px)) / sum);
    return k;
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
    const int radius = (int)ceil(4.5 * sigma_px);
    float *kernel = gauss_kernel(sigma_px, radius);
    if (radius <= FFT_RADIUS || 2 * radius + 1 > side) {
        struct blur *b = xcalloc(1, sizeof *b);
        *b = (struct blur){.w = w, .h = h, .kernel = kernel, .radius = radius};
        return b;
    }
    const int n = 2 * radius + 1;
    float *psf = xcalloc((size_t)n * (size_t)n, sizeof *psf);
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++)
            psf[j * n + i] = kernel[abs(i - radius)] * kernel[abs(j - radius)];
    struct blur *b = blur_psf(w, h, psf, n, n, e);
    free(psf);
    free(kernel);
    return b;
}
