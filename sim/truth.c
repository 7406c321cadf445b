// truth.c - integrals over wavelength of the exact far field.
#define _GNU_SOURCE
#include "sim/truth.h"
#include <math.h>

// Gauss-Legendre, 4 points on -1..1.
static const double gauss_x[4] = {-0.86113631159405258, -0.33998104358485626, 0.33998104358485626,
                                  0.86113631159405258};
static const double gauss_w[4] = {0.34785484513745386, 0.65214515486254614, 0.65214515486254614,
                                  0.34785484513745386};

// Panels per 5 nm so that 4 points lie on a lobe's standard deviation. A lobe of width f (1/m) is
// passed by lambda at |h| / lambda^2 per metre.
static int panels(const struct sample *s, double h, double lambda_m)
{
    const double sigma_f = 4 / (sqrt(8) * M_PI * s->coherence_m);
    const double sigma_lambda = sigma_f * lambda_m * lambda_m / fmax(h, 1e-9);
    return (int)fmin(200, ceil(5e-9 / fmin(5e-9, sigma_lambda)));
}

typedef double density(const void *ctx, double u, double v, double w, double lambda_m);

static void integrate(const struct sample *s, density *d, const void *ctx,
                      const struct spectrum *illuminant, double scale, double u, double v, double w,
                      double xyz[3])
{
    double sum[3] = {0};
    for (int nm = CIE_FIRST_NM; nm < CIE_LAST_NM; nm += CIE_STEP_NM) {
        const int count = panels(s, hypot(u, v), nm * 1e-9);
        const double step = CIE_STEP_NM * 1e-9 / count;
        for (int p = 0; p < count; p++)
            for (int g = 0; g < 4; g++) {
                const double lambda_m = nm * 1e-9 + step * (p + 0.5 + 0.5 * gauss_x[g]);
                double cmf[3];
                cie_xyz(lambda_m, cmf);
                const double x = 0.5 * step * gauss_w[g] * spectrum_at(illuminant, lambda_m) *
                                 d(ctx, u, v, w, lambda_m);
                for (int c = 0; c < 3; c++)
                    sum[c] += x * cmf[c];
            }
    }
    for (int c = 0; c < 3; c++)
        xyz[c] = scale * sum[c] / (4 * M_PI * M_PI * w * w);
}

static double by_ref(const void *ctx, double u, double v, double w, double lambda_m)
{
    return farfield_ref(ctx, u, v, w, lambda_m);
}

static double by_farfield(const void *ctx, double u, double v, double w, double lambda_m)
{
    return farfield_at(ctx, u, v, w, lambda_m);
}

void truth_xyz(const struct sample *s, const struct spectrum *illuminant, double u, double v,
               double w, double xyz[3])
{
    integrate(s, by_ref, s, illuminant, illuminant_scale(illuminant), u, v, w, xyz);
}

bool truth_table(const struct sample *s, const struct sim_view *v,
                 const struct spectrum *illuminant, struct table *t, struct err *e)
{
    const double scale = illuminant_scale(illuminant),
                 far = fmin(v->fourier ? 1 : 2, M_SQRT2 * t->range);
    struct farfield f;
    const struct farfield_range range = {.h_max = far,
                                         .lambda_min_m = CIE_FIRST_NM * 1e-9,
                                         .lambda_max_m = CIE_LAST_NM * 1e-9,
                                         .w_min = view_w(v, far, 0),
                                         .w_max = view_w(v, 0, 0)};
    if (!farfield_init(&f, s, &range, e))
        return false;
#pragma omp parallel for schedule(dynamic, 4)
    for (int j = 0; j < t->n; j++)
        for (int i = 0; i < t->n; i++) {
            const double u = table_node(t, i), v_ = table_node(t, j);
            double xyz[3] = {0};
            if (hypot(u, v_) < far)
                integrate(s, by_farfield, &f, illuminant, scale, u, v_, view_w(v, u, v_), xyz);
            for (int c = 0; c < 3; c++)
                t->tab[((size_t)j * (size_t)t->n + (size_t)i) * 3 + (size_t)c] = (float)xyz[c];
        }
    farfield_finish(&f);
    return true;
}
