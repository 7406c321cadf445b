// lut_deband.c - a photograph through a band of wavelengths: its effective wavelength, and the way
// back to one wavelength.
//
// Through the band b (integral 1) the camera sees M = integral b(l) (lm/l)^e L(h lm/l) dl, which in
// s = ln(lm/l) is a correlation of L with B, as the table is one of L with K. So the table of M
// wants the kernel K / B (in frequencies of s), and undoing the blur costs nothing but a regular
// inverse: conj(B) / (|B|^2 + eps), eps the least that keeps the noise within its limit.
#define _GNU_SOURCE
#include "core/mem.h"
#include "process/fft.h"
#include "process/lut_kernel.h"
#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = 32768 };              // steps of s, around 0
static const double step = 2e-4; // a tenth of a nanometre

double lut_effective_wavelength(const struct spectrum *band, double exponent)
{
    double sum = 0, weight = 0; // centre of B in s: the blur then moves nothing
    for (int k = 0; k + 1 < band->n; k++) {
        const double from = band->lambda_m[k], to = band->lambda_m[k + 1];
        for (int q = 0; q < 16; q++) {
            const double l = from + (to - from) * (q + 0.5) / 16;
            const double w = spectrum_at(band, l) * pow(l, -exponent) * (to - from);
            sum += w * log(l);
            weight += w;
        }
    }
    return weight > 0 ? exp(sum / weight) : (double)NAN;
}

// Adds weight at s to a periodic grid, shared by the two nearest steps.
static void add_line(double *grid, double s, double weight)
{
    const double at = s / step + N;
    const int i = (int)at;
    grid[i % N] += weight * (1 - (at - i));
    grid[(i + 1) % N] += weight * (at - i);
}

static void add_band(double *grid, const struct lut_request *r)
{
    const struct spectrum *b = r->band;
    double whole = 0;
    for (int k = 0; k + 1 < b->n; k++)
        whole += 0.5 * (b->value[k] + b->value[k + 1]) * (b->lambda_m[k + 1] - b->lambda_m[k]);
    for (int k = 0; k + 1 < b->n; k++) {
        const double from = b->lambda_m[k], to = b->lambda_m[k + 1];
        const int parts = (int)ceil(log(to / from) / step);
        for (int q = 0; q < parts; q++) {
            const double l = from + (to - from) * (q + 0.5) / parts, ratio = r->lambda_m / l;
            add_line(grid, log(ratio),
                     spectrum_at(b, l) * pow(ratio, r->exponent) * (to - from) / parts / whole);
        }
    }
}

struct spectra {
    double *grid;              // [N]
    double complex *blur;      // [N / 2 + 1] B
    double complex *kernel[3]; // [N / 2 + 1] K
};

// |K / B|^2 over |K|^2, the largest of the channels: what happens to white noise.
static double noise_gain(const struct spectra *f, double eps)
{
    double worst = 0;
    for (int c = 0; c < 3; c++) {
        double after = 0, before = 0;
        for (int k = 0; k <= N / 2; k++) {
            const double b2 = creal(f->blur[k] * conj(f->blur[k]));
            const double k2 = creal(f->kernel[c][k] * conj(f->kernel[c][k]));
            before += k2;
            after += k2 * b2 / ((b2 + eps) * (b2 + eps));
        }
        worst = fmax(worst, before > 0 ? sqrt(after / before) : 0);
    }
    return worst;
}

// The least eps, to 1 %, that keeps the limit.
static double pick_eps(const struct spectra *f, double limit)
{
    double low = -14, high = 4; // powers of ten
    if (noise_gain(f, pow(10, low)) <= limit)
        return pow(10, low);
    while (high - low > 0.004) {
        const double middle = 0.5 * (low + high);
        *(noise_gain(f, pow(10, middle)) <= limit ? &high : &low) = middle;
    }
    return pow(10, high);
}

// The steps where any channel is more than nothing become the kernel's lines.
static void take_lines(struct lp_kernel *k, double (*value)[3])
{
    double top[3] = {0};
    for (int m = 0; m < N; m++)
        for (int c = 0; c < 3; c++)
            top[c] = fmax(top[c], fabs(value[m][c]));
    lut_kernel_finish(k);
    *k = (struct lp_kernel){0, xcalloc(N, sizeof(double)), xcalloc(N, sizeof(double[3]))};
    for (int m = N / 2; m < N / 2 + N; m++) {
        const double *v = value[m % N];
        if (fabs(v[0]) > 1e-5 * top[0] || fabs(v[1]) > 1e-5 * top[1] ||
            fabs(v[2]) > 1e-5 * top[2]) {
            k->s[k->n] = (m - N) * step;
            memcpy(k->weight[k->n++], v, sizeof(double[3]));
        }
    }
}

bool lut_deband(struct lp_kernel *k, const struct lut_request *r, double *gain, struct err *e)
{
    struct fft *forward = fft_new(FFT_R2C, FFT_DOUBLE, 1, N, 1, false, e);
    struct fft *backward = forward ? fft_new(FFT_C2R, FFT_DOUBLE, 1, N, 1, false, e) : NULL;
    const size_t half = N / 2 + 1;
    struct spectra f = {.grid = sample_alloc(N, sizeof(double), "kernel", e)};
    double complex *all = f.grid ? sample_alloc(4 * half, sizeof *all, "kernel", e) : NULL;
    double(*value)[3] = all ? sample_alloc(N, sizeof *value, "kernel", e) : NULL;
    const bool ok = backward && value;
    if (ok) {
        f.blur = all;
        add_band(f.grid, r);
        fft_run(forward, f.grid, f.blur);
        for (int c = 0; c < 3; c++) {
            f.kernel[c] = all + (size_t)(c + 1) * half;
            memset(f.grid, 0, N * sizeof(double));
            for (int q = 0; q < k->n; q++)
                add_line(f.grid, k->s[q], k->weight[q][c]);
            fft_run(forward, f.grid, f.kernel[c]);
        }
        const double eps = pick_eps(&f, r->noise_limit);
        *gain = noise_gain(&f, eps);
        for (int c = 0; c < 3; c++) {
            for (size_t i = 0; i < half; i++)
                f.kernel[c][i] *= conj(f.blur[i]) / (creal(f.blur[i] * conj(f.blur[i])) + eps) / N;
            fft_run(backward, f.kernel[c], f.grid);
            for (int m = 0; m < N; m++)
                value[m][c] = f.grid[m];
        }
        take_lines(k, value);
    }
    free(value);
    free(all);
    free(f.grid);
    fft_free(backward);
    fft_free(forward);
    return ok;
}
