// slits.c - slits in double, wavelength by wavelength.
#define _GNU_SOURCE
#include "render/slits.h"
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

// |P|^2 / (lambda A) along one axis.
static double row(const struct multislit *m, double u, double lambda_m)
{
    return multislit_peak(m, lambda_m) * multislit_power(m, u, lambda_m);
}

static void sum_light(const struct slits *s, double u, double v, bool crossed, double out[3])
{
    out[0] = out[1] = out[2] = 0;
    for (int k = 0; k < s->n; k++) {
        const double lambda_m = s->lambda_m + k * (s->last_m - s->lambda_m) / (s->n - 1);
        const double power =
            row(&s->row[0], u, lambda_m) * (crossed ? row(&s->row[1], v, lambda_m) : 1);
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
    return s->lambda_m / (s->row[0].count * s->row[0].pitch_m);
}

void slits_eval(const struct slits *s, double u, double v, double out[3])
{
    if (slits_are_crossed(s)) {
        sum_light(s, u, v, true, out);
        return;
    }
    if (s->row[0].radial) {
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

bool light_color(const struct spectrum *light, double rgb[3], struct err *e)
{
    struct slits all = {0}; // their weights add up to it
    rgb[0] = rgb[1] = rgb[2] = 0;
    const bool ok = slits_light(&all, light, CIE_LAST_NM - CIE_FIRST_NM + 1, e);
    for (int k = 0; k < all.n && ok; k++)
        for (int c = 0; c < 3; c++)
            rgb[c] += all.weight[k][c];
    slits_finish(&all);
    return ok;
}
