// d14_peer.c - a plain transcription of D14's windowed transforms, for the clock only.
#include "tests/bench/d14_peer.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/table.h"
#include "process/fft.h"
#include <complex.h>
#include <math.h>
#include <stdlib.h>

static const double tau = 6.28318530717958647693;

// exp(-(x - xi)^2 / (2 xi_f^2)) at the frequencies of a DFT of n samples a step apart (D16 table
// 1).
static void gauss(double *g, double x, int n, double step_m, double sigma_m)
{
    const double width = 1 / (tau * sigma_m);
    for (int k = 0; k < n; k++) {
        const double d = (x - (k < (n + 1) / 2 ? k : k - n) / (n * step_m)) / width;
        g[k] = exp(-0.5 * d * d);
    }
}

static double complex at_point(const double complex *dft, const struct hfield *hf, double u,
                               double v, double lambda_m, double sigma_m, double *gx, double *gy)
{
    gauss(gx, u / lambda_m, hf->nx, hf->dx_m, sigma_m);
    gauss(gy, v / lambda_m, hf->ny, hf->dy_m, sigma_m);
    double complex sum = 0;
    for (int j = 0; j < hf->ny; j++) {
        double complex row = 0;
        for (int i = 0; i < hf->nx; i++)
            row += gx[i] * dft[(size_t)j * (size_t)hf->nx + (size_t)i];
        sum += gy[j] * row;
    }
    return sum;
}

double d14_seconds(const struct hfield *hf, double sigma_m, int order, int wavelengths, int n,
                   int points, double *checksum)
{
    struct err e;
    const size_t nodes = (size_t)hf->nx * (size_t)hf->ny;
    double complex *h = sample_alloc(nodes, sizeof *h, "D14", &e);
    double *gx = xcalloc((size_t)hf->nx, sizeof *gx), *gy = xcalloc((size_t)hf->ny, sizeof *gy);
    struct fft *fft = fft_new(FFT_FORWARD, FFT_DOUBLE, hf->ny, hf->nx, 1, true, &e);
    double seconds = NAN;
    if (h && fft) {
        const double start_s = now_s();
        for (size_t k = 0; k < nodes; k++)
            h[k] = hf->z[k];
        fft_run(fft, h, h);
        const double dft_s = now_s() - start_s, points_s = now_s();
        const struct table t = {.n = n, .range = 2, .power = 5};
        for (int k = 0; k < points; k++) // spread over the table
            *checksum += cabs(at_point(h, hf, table_node(&t, k * 7919 % n),
                                       table_node(&t, k * 104729 % n), 550e-9, sigma_m, gx, gy));
        const double each_s = (now_s() - points_s) / points;
        seconds = (order + 1) * (dft_s + wavelengths * (double)n * n * each_s);
    }
    fft_free(fft);
    free(h);
    free(gx);
    free(gy);
    return seconds;
}
