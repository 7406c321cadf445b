// rainbow.c - Stam's shader of GPU Gems ch. 8.
#include "process/rainbow.h"
#include <math.h>
#include <string.h>

static double highlight(const struct rainbow *r, double u_um, double w)
{
    const double e = r->roughness * u_um / w;
    return r->roughness > 0 ? exp(-e * e) : 0;
}

static double bump(double x)
{
    return fmax(0, 1 - x * x);
}

void rainbow_rgb(const struct rainbow *r, double u, double w, double rgb[3])
{
    static const double peak[3] = {0.75, 0.5, 0.25};
    const double u_um = fabs(u) * r->spacing_m * 1e6;
    for (int c = 0; c < 3; c++) {
        rgb[c] = r->highlight[c] * highlight(r, u_um, w);
        for (int n = 1; n < 8; n++)
            rgb[c] += bump(4 * (2 * u_um / n - 1 - peak[c]));
    }
}

// Scale of P: the mean of P ybar over that of ybar becomes 1.
static double light_scale(const struct spectrum *light)
{
    double of_light = 0, even = 0;
    for (int nm = CIE_FIRST_NM; nm <= CIE_LAST_NM; nm += CIE_STEP_NM) {
        double xyz[3];
        cie_xyz(nm * 1e-9, xyz);
        of_light += xyz[1] * spectrum_at(light, nm * 1e-9);
        even += xyz[1];
    }
    return of_light > 0 ? even / of_light : 0;
}

static void orders(const struct rainbow *r, const struct spectrum *light, double scale, double u,
                   double w, double xyz[3])
{
    const double path_m = fabs(u) * r->spacing_m, first_m = CIE_FIRST_NM * 1e-9;
    for (int c = 0; c < 3; c++)
        xyz[c] = r->highlight[c] * highlight(r, path_m * 1e6, w);
    for (int n = (int)fmax(1, path_m / (CIE_LAST_NM * 1e-9)); path_m / n >= first_m; n++) {
        double cmf[3];
        cie_xyz(path_m / n, cmf);
        const double power = scale * spectrum_at(light, path_m / n);
        for (int c = 0; c < 3; c++)
            xyz[c] += power * cmf[c];
    }
}

void rainbow_xyz(const struct rainbow *r, const struct spectrum *light, double u, double w,
                 double xyz[3])
{
    orders(r, light, light_scale(light), u, w, xyz);
}

bool rainbow_table(struct table *t, const struct rainbow *r, const struct spectrum *light, double w,
                   int n, double range, int power, struct err *e)
{
    if (!(r->spacing_m > 0 && r->spacing_m < 1))
        return err_set(e, ERR_DATA, "bad pitch %g m: must be above 0 and below 1 m", r->spacing_m);
    if (!(w > 0 && w <= 2))
        return err_set(e, ERR_DATA, "bad w %g: must be above 0 and at most 2", w);
    if (!(r->roughness >= 0 && r->roughness < 1e9))
        return err_set(e, ERR_DATA, "bad roughness %g: must be 0 or more", r->roughness);
    const double scale = light ? light_scale(light) : 1;
    if (!(scale > 0))
        return err_set(e, ERR_DATA, "the illuminant has no visible power");
    if (!table_init(t, n, range, power, 1, e))
        return false;
    t->is_rgb = !light;
    for (int i = 0; i < n; i++) {
        double colour[3];
        if (light)
            orders(r, light, scale, table_node(t, i), w, colour);
        else
            rainbow_rgb(r, table_node(t, i), w, colour);
        for (int j = 0; j < n; j++)
            for (int c = 0; c < 3; c++)
                t->tab[((size_t)j * (size_t)n + (size_t)i) * 3 + (size_t)c] = (float)colour[c];
    }
    return true;
}
