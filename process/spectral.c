// spectral.c - wavelengths and colour weights of a trapezoidal sum.
#include "process/spectral.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

bool spectral_init(struct spectral *s, const struct spectrum *light, double step_m, struct err *e)
{
    const double first_m = CIE_FIRST_NM * 1e-9, last_m = CIE_LAST_NM * 1e-9;
    if (!(step_m >= 0.01e-9 && step_m <= 100e-9))
        return err_set(e, ERR_DATA, "bad wavelength step %g nm: must be 0.01 to 100 nm",
                       step_m * 1e9);
    const int steps = (int)lrint(ceil((last_m - first_m) / step_m - 1e-9));
    struct spectral got = {.lambda_m = xcalloc((size_t)steps + 1, sizeof(double)),
                           .weight = xcalloc((size_t)steps + 1, sizeof *got.weight)};
    double total = 0;
    for (int k = 0; k <= steps; k++) {
        const double lambda_m = first_m + (last_m - first_m) * k / steps;
        const double power = spectrum_at(light, lambda_m) * (k == 0 || k == steps ? 0.5 : 1);
        double xyz[3];
        cie_xyz(lambda_m, xyz);
        if (power == 0)
            continue;
        got.lambda_m[got.n] = lambda_m;
        for (int c = 0; c < 3; c++)
            got.weight[got.n][c] = power * xyz[c];
        total += got.weight[got.n++][1];
    }
    if (!(total > 0)) {
        spectral_finish(&got);
        return err_set(e, ERR_DATA,
                       "the illuminant has no visible power on samples %g nm apart: a narrow line "
                       "needs a smaller wavelength step",
                       (last_m - first_m) / steps * 1e9);
    }
    for (int k = 0; k < got.n; k++)
        for (int c = 0; c < 3; c++)
            got.weight[k][c] /= total;
    *s = got;
    return true;
}

void spectral_finish(struct spectral *s)
{
    if (!s)
        return;
    free(s->lambda_m);
    free(s->weight);
    *s = (struct spectral){0};
}
