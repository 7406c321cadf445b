// multislit.c - the analytic grating: equal slits.
#define _GNU_SOURCE
#include "process/multislit.h"
#include "process/diffraction_rows.h"
#include "process/spectral.h"
#include <math.h>

static const double pi = 3.14159265358979323846;

double multislit_power(const struct multislit *s, double u, double lambda_m)
{
    const double x = pi * s->width_m * u / lambda_m;
    const double slit = fabs(x) < 1e-8 ? 1 : sin(x) / x;
    return slit * slit * array_factor(s->count, s->pitch_m * u / lambda_m);
}

double multislit_peak(const struct multislit *s, double lambda_m)
{
    return s->count * s->width_m * s->width_m / (s->pitch_m * lambda_m);
}

double multislit_step(const struct multislit *s, double u)
{
    // The sums' highest frequency in 1 / lambda is (N - 1) d u + a u, twice that of the amplitude.
    const double shortest_m = CIE_FIRST_NM * 1e-9;
    const double nyquist_m = shortest_m * shortest_m / (2 * s->pitch_m * s->count * fabs(u));
    return fmax(0.02e-9, fmin(5e-9, nyquist_m));
}

static bool check(const struct multislit *s, struct err *e)
{
    if (!(s->pitch_m > 0 && s->pitch_m < 1))
        return err_set(e, ERR_DATA, "bad pitch %g m: must be above 0 and below 1 m", s->pitch_m);
    if (!(s->width_m > 0 && s->width_m <= s->pitch_m))
        return err_set(e, ERR_DATA, "bad slit width %g um: must be above 0 and at most the pitch",
                       s->width_m * 1e6);
    if (s->count < 1 || s->count > 1000000)
        return err_set(e, ERR_DATA, "bad number of slits %d: must be 1 to 1000000", s->count);
    for (int k = 0; k < 2; k++)
        if (!(s->window[k] >= 0 && s->window[k] < 1e6))
            return err_set(e, ERR_DATA, "bad window %g: must be above 0", s->window[k]);
    if (s->absolute && (s->window[1] == 0 || s->radial))
        return err_set(e, ERR_DATA,
                       "an absolute scale needs a row with a window across it: the lobe's width");
    if (!(fabs(s->exponent) <= 10))
        return err_set(e, ERR_DATA, "bad exponent %g: must be -10 to 10", s->exponent);
    return true;
}

// Weight of a wavelength beside P cmf, and the window, at (along, across).
static double wavelength_factor(const struct multislit *s, double lambda_m)
{
    if (!s->absolute)
        return pow(550e-9 / lambda_m, s->exponent);
    const double lobe = sqrt(2 * pi) * s->window[1]; // |P|^2 / (lambda^2 A w^2) at w = 2, / 4 pi^2
    return multislit_peak(s, lambda_m) / (16 * pi * pi * lobe);
}

static double window(const struct multislit *s, double along, double across)
{
    double exponent = 0;
    if (s->window[0] > 0)
        exponent += along * along / (2 * s->window[0] * s->window[0]);
    if (s->window[1] > 0)
        exponent += across * across / (2 * s->window[1] * s->window[1]);
    return exp(-exponent);
}

static void value(const struct multislit *s, const struct spectral *light, double u, double v,
                  double xyz[3])
{
    const double c = cos(s->turn_rad), t = sin(s->turn_rad);
    const double along = s->radial ? hypot(u, v) : c * u + t * v;
    const double shade = s->radial ? window(s, u, v) : window(s, along, c * v - t * u);
    xyz[0] = xyz[1] = xyz[2] = 0;
    for (int l = 0; l < light->n; l++) {
        const double power = shade * multislit_power(s, along, light->lambda_m[l]);
        for (int k = 0; k < 3; k++)
            xyz[k] += light->weight[l][k] * power;
    }
}

bool multislit_table(struct table *t, const struct multislit *s, const struct spectrum *light,
                     double step_m, int n, double range, int power, struct err *e)
{
    struct spectral spectral;
    if (!check(s, e) || !spectral_init(&spectral, light, step_m, e))
        return false;
    double centre = 0;
    for (int l = 0; l < spectral.n; l++) {
        for (int c = 0; c < 3; c++)
            spectral.weight[l][c] *= wavelength_factor(s, spectral.lambda_m[l]);
        centre += spectral.weight[l][1];
    }
    for (int l = 0; l < spectral.n && !s->absolute; l++)
        for (int c = 0; c < 3; c++)
            spectral.weight[l][c] /= centre;
    const bool ok = table_init(t, n, range, power, 1, e);
#pragma omp parallel for schedule(dynamic, 8)
    for (int j = 0; j < (ok ? n : 0); j++)
        for (int i = 0; i < n; i++) {
            double xyz[3];
            value(s, &spectral, table_node(t, i), table_node(t, j), xyz);
            for (int c = 0; c < 3; c++)
                t->tab[((size_t)j * (size_t)n + (size_t)i) * 3 + (size_t)c] = (float)xyz[c];
        }
    spectral_finish(&spectral);
    return ok;
}

void table_mask(struct table *t, const struct image *mask)
{
    for (int j = 0; j < t->n; j++)
        for (int i = 0; i < t->n; i++) {
            const double x = (table_node(t, i) / t->range + 1) * 0.5 * (mask->w - 1);
            const double y = (table_node(t, j) / t->range + 1) * 0.5 * (mask->h - 1);
            const int x0 = (int)fmax(0, fmin(mask->w - 2, floor(x)));
            const int y0 = (int)fmax(0, fmin(mask->h - 2, floor(y)));
            const int x1 = mask->w > 1 ? x0 + 1 : 0, y1 = mask->h > 1 ? y0 + 1 : 0;
            const double fx = x - x0, fy = y - y0;
            const size_t w = (size_t)mask->w, nc = (size_t)mask->nc;
            const float *px = mask->px;
            const double top = (1 - fx) * px[((size_t)y0 * w + (size_t)x0) * nc] +
                               fx * px[((size_t)y0 * w + (size_t)x1) * nc];
            const double low = (1 - fx) * px[((size_t)y1 * w + (size_t)x0) * nc] +
                               fx * px[((size_t)y1 * w + (size_t)x1) * nc];
            for (int c = 0; c < 3; c++)
                t->tab[((size_t)j * (size_t)t->n + (size_t)i) * 3 + (size_t)c] *=
                    (float)((1 - fy) * top + fy * low);
        }
}
