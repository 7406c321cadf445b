// response.c - curves that are known beforehand, and what holds for every curve.
#include "calib/response.h"
#include "core/spectrum.h"
#include <math.h>

enum { N = RESPONSE_CODES };

double response_slope(const double log_x[RESPONSE_CODES], int z)
{
    const int lo = z > 0 ? z - 1 : 0, hi = z < N - 1 ? z + 1 : N - 1;
    return fmax((log_x[hi] - log_x[lo]) / (hi - lo), 1e-4);
}

// sigma of ln X when codes have this noise (in codes).
static void sigma_from_noise(struct response *r, int c, double noise)
{
    for (int z = 0; z < N; z++)
        r->log_sigma[c][z] = noise * response_slope(r->log_x[c], z);
}

static void from_curve(struct response *r, int nc, double (*linear)(double))
{
    *r = (struct response){.nc = nc, .code_min = 3, .code_max = 250};
    const double middle = linear((RESPONSE_MIDDLE + 0.0) / (N - 1));
    for (int c = 0; c < nc; c++) {
        for (int z = 0; z < N; z++) // code 0 stands for a third of a code: its logarithm is finite
            r->log_x[c][z] = log(linear((z ? z : 1 / 3.) / (N - 1)) / middle);
        sigma_from_noise(r, c, 1);
    }
}

static double identity(double x)
{
    return x;
}

void response_srgb(struct response *r, int nc)
{
    from_curve(r, nc, srgb_decode);
}

void response_linear(struct response *r, int nc)
{
    from_curve(r, nc, identity);
}

bool response_code_ok(const struct response *r, int code)
{
    return code >= r->code_min && code <= r->code_max;
}

// Real brackets leave 0.05 to 0.2 (noise, things that moved), frames of different scenes about 0.9.
bool response_check(const struct response *r, struct err *e)
{
    return r->residual < 0.5 ||
           err_set(e, ERR_DATA,
                   "the frames follow no curve: pixels miss it by a factor of %.1f (rms); not one "
                   "scene, or not these exposure times",
                   exp(r->residual));
}

// Pool adjacent violators.
void response_make_monotone(double y[RESPONSE_CODES])
{
    double mean[N];
    int size[N], n = 0;
    for (int z = 0; z < N; z++) {
        mean[n] = y[z];
        size[n++] = 1;
        for (; n > 1 && mean[n - 2] > mean[n - 1]; n--) {
            const int both = size[n - 2] + size[n - 1];
            mean[n - 2] = (mean[n - 2] * size[n - 2] + mean[n - 1] * size[n - 1]) / both;
            size[n - 2] = both;
        }
    }
    for (int k = 0, z = 0; k < n; k++)
        for (int m = 0; m < size[k]; m++)
            y[z++] = mean[k];
}
