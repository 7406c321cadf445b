// lobes.h - patterns of Gaussian lobes whose table is known without any picture: the judge of lut.
#pragma once
#include "tests/test.h" // first: it says _GNU_SOURCE

#include "core/spectrum.h"
#include "process/lut.h"

enum { LOBES = 24 };

struct lobes {
    double x[LOBES], y[LOBES]; // px from the centre
    double height[LOBES], sigma[LOBES];
    double exponent, lambda_m, h_per_px;
    const struct spectrum *light;
};

// Always the same lobes, out to `reach` px, `sigma` px wide, the brightest one at the centre.
static inline struct lobes lobes_new(double reach, double sigma)
{
    struct lobes l = {0};
    uint32_t seed = 12345;
    for (int k = 0; k < LOBES; k++) {
        double r[4];
        for (int q = 0; q < 4; q++)
            r[q] = (seed = seed * 1664525u + 1013904223u) / 4294967296.0;
        l.x[k] = k ? (2 * r[0] - 1) * reach : 0.1;
        l.y[k] = k ? (2 * r[1] - 1) * reach : -0.2;
        l.height[k] = k ? 0.3 + r[2] : 5;
        l.sigma[k] = sigma * (1 + 0.3 * r[3]);
    }
    return l;
}

static inline double lobes_at(const struct lobes *l, double x, double y)
{
    double sum = 0;
    for (int k = 0; k < LOBES; k++) {
        const double dx = (x - l->x[k]) / l->sigma[k], dy = (y - l->y[k]) / l->sigma[k];
        if (dx * dx + dy * dy < 100)
            sum += l->height[k] * exp(-0.5 * (dx * dx + dy * dy));
    }
    return sum;
}

static inline struct lut_pattern lobes_picture(const struct lobes *l, int w, int h, double cx,
                                               double cy)
{
    struct lut_pattern p = {.w = w,
                            .h = h,
                            .px = calloc((size_t)(w * h), sizeof(float)),
                            .h_per_px = l->h_per_px,
                            .cx = cx,
                            .cy = cy};
    for (int j = 0; j < h; j++)
        for (int i = 0; i < w; i++)
            p.px[j * w + i] = (float)lobes_at(l, i - cx, j - cy);
    return p;
}

// S_d at (u, v) by the trapezoidal rule over `n` wavelengths, in double (T17 eq. 15), F0 = 1.
static inline void lobes_truth(const struct lobes *l, double u, double v, int n, double out[3])
{
    double luminance = 0;
    out[0] = out[1] = out[2] = 0;
    for (int q = 0; q < n; q++) {
        const double lambda_m = 380e-9 + 400e-9 * q / (n - 1), ratio = l->lambda_m / lambda_m;
        double cmf[3];
        cie_xyz(lambda_m, cmf);
        const double power = spectrum_at(l->light, lambda_m) * (q == 0 || q == n - 1 ? 0.5 : 1);
        const double value =
            pow(ratio, l->exponent) * lobes_at(l, u * ratio / l->h_per_px, v * ratio / l->h_per_px);
        luminance += power * cmf[1];
        for (int c = 0; c < 3; c++)
            out[c] += power * cmf[c] * value;
    }
    for (int c = 0; c < 3; c++)
        out[c] /= 4 * M_PI * M_PI * luminance;
}
