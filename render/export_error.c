// export_error.c - what a format makes of a material, against the material itself.
#define _GNU_SOURCE
#include "render/export.h"

enum { PAIRS = 40000 };

// Radical inverse: the k-th point of Halton's sequence.
static double halton(int k, int base)
{
    double x = 0;
    for (double digit = 1.0 / base; k > 0; k /= base, digit /= base)
        x += digit * (k % base);
    return x;
}

// Half vectors fill the table, incident directions a cone of 60 degrees; false: no such wo.
static bool pair(const struct material *m, int k, struct vec3 *wi, struct vec3 *wo)
{
    const double reach = fmin(m->table.range, 1);
    const double u = reach * (2 * halton(k, 2) - 1), v = reach * (2 * halton(k, 3) - 1);
    const double z = 1 - 0.5 * halton(k, 5), phi = 2 * M_PI * halton(k, 7), r = sqrt(1 - z * z);
    *wi = v3(r * cos(phi), r * sin(phi), z);
    const double x = u - wi->x, y = v - wi->y, rest = 1 - x * x - y * y;
    *wo = v3(x, y, sqrt(fmax(rest, 0)));
    return rest > 0.01;
}

double export_error(const struct material *m, export_eval *eval, const void *file)
{
    double diff = 0, norm = 0;
    for (int k = 1; k <= PAIRS; k++) {
        struct vec3 wi, wo;
        double got[3], want[3];
        if (!pair(m, k, &wi, &wo))
            continue;
        material_diffraction(m, wo, wi, want); // f cos of its first argument
        eval(file, wi, wo, got);
        for (int c = 0; c < 3; c++) {
            diff += (got[c] - want[c]) * (got[c] - want[c]);
            norm += want[c] * want[c];
        }
    }
    return norm > 0 ? sqrt(diff / norm) : 0;
}
