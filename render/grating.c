// grating.c - slits and Stam's rainbow in double.
#define _GNU_SOURCE
#include "render/grating.h"
#include "core/mem.h"
#include <stdlib.h>

bool slits_light(struct slits *s, const struct spectrum *light, int n, struct err *e)
{
    const double scale = illuminant_scale(light);
    if (!(scale > 0))
        return err_set(e, ERR_DATA, "the illuminant has no light between 380 and 780 nm");
    free(s->weight);
    s->weight = xcalloc((size_t)n, sizeof *s->weight);
    s->n = n;
    s->lambda_m = CIE_FIRST_NM * 1e-9;
    s->last_m = CIE_LAST_NM * 1e-9;
    const double step_m = (s->last_m - s->lambda_m) / (n - 1);
    for (int k = 0; k < n; k++) {
        const double lambda_m = s->lambda_m + k * step_m;
        double xyz[3];
        cie_xyz(lambda_m, xyz);
        for (int c = 0; c < 3; c++)
            xyz[c] *=
                scale * step_m * spectrum_at(light, lambda_m) * (k == 0 || k == n - 1 ? .5 : 1);
        xyz_to_rgb(xyz, s->weight[k]);
    }
    return true;
}

void slits_finish(struct slits *s)
{
    if (!s)
        return;
    free(s->weight);
    s->weight = NULL;
}

double slits_comb(int n, double x)
{
    const double frac = x - round(x), below = n * sin(M_PI * frac);
    if (fabs(frac) * n < 1e-5) // to the second order: 1 - (n^2 - 1) (pi frac)^2 / 3
        return 1 - ((double)n * n - 1) * M_PI * M_PI * frac * frac / 3;
    const double ratio = sin(n * M_PI * frac) / below;
    return ratio * ratio;
}

static double sinc2(double x)
{
    const double y = M_PI * x;
    return fabs(y) < 1e-4 ? 1 - y * y / 3 : sin(y) * sin(y) / (y * y);
}

// |P|^2 / (lambda A) along one axis.
static double row(const struct slits *s, int axis, double u, double lambda_m)
{
    const double a = s->width_m[axis], d = s->pitch_m[axis];
    return s->count[axis] * a * a / (d * lambda_m) * sinc2(a * u / lambda_m) *
           slits_comb(s->count[axis], d * u / lambda_m);
}

static void sum_light(const struct slits *s, double u, double v, bool crossed, double out[3])
{
    out[0] = out[1] = out[2] = 0;
    for (int k = 0; k < s->n; k++) {
        const double lambda_m = s->lambda_m + k * (s->last_m - s->lambda_m) / (s->n - 1);
        const double power = row(s, 0, u, lambda_m) * (crossed ? row(s, 1, v, lambda_m) : 1);
        for (int c = 0; c < 3; c++)
            out[c] += power / (16 * M_PI * M_PI) * s->weight[k][c];
    }
}

void slits_row(const struct slits *s, double u, double out[3])
{
    sum_light(s, u, 0, false, out);
}

double slits_detail(const struct slits *s)
{
    return s->lambda_m / (s->count[0] * s->pitch_m[0]);
}

void slits_eval(const struct slits *s, double u, double v, double out[3])
{
    if (slits_are_crossed(s)) {
        sum_light(s, u, v, true, out);
        return;
    }
    if (s->radial) {
        u = hypot(u, v);
        v = 0;
    }
    if (fabs(v) > 8 * s->across) { // 1e-14 of the lobe
        out[0] = out[1] = out[2] = 0;
        return;
    }
    const double across = exp(-v * v / (2 * s->across * s->across)) / (sqrt(2 * M_PI) * s->across);
    sum_light(s, u, 0, false, out);
    for (int c = 0; c < 3; c++)
        out[c] *= across;
}

static double bump(double x)
{
    return fmax(0, 1 - x * x);
}

void stam_eval(const struct stam *s, struct vec3 h, double out[3])
{
    const double u = h.x * s->spacing_um, e = s->roughness * u / h.z;
    for (int c = 0; c < 3; c++)
        out[c] = s->highlight[c] * exp(-e * e);
    for (int n = 1; n < 8; n++) {
        const double y = 2 * fabs(u) / n - 1;
        out[0] += bump(4 * (y - 0.75));
        out[1] += bump(4 * (y - 0.5));
        out[2] += bump(4 * (y - 0.25));
    }
}
