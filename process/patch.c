// patch.c - a height field under its coherence window.
#include "process/patch.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

static double *window_of(enum window window, double sigma_m, double step_m, int nodes, int *first,
                         int *count)
{
    const double middle = 0.5 * (nodes - 1), reach = 6.5 * sigma_m / step_m;
    *first = 0, *count = nodes;
    if (window == WINDOW_GAUSS && reach < middle) {
        *first = (int)ceil(middle - reach);
        *count = nodes - 2 * *first;
    }
    if (*count < 1)
        return NULL;
    double *g = xcalloc((size_t)*count, sizeof *g), sum = 0;
    for (int i = 0; i < *count; i++) {
        const double t = (*first + i - middle) * step_m / sigma_m;
        sum += g[i] = window == WINDOW_GAUSS ? exp(-0.5 * t * t) : 1;
    }
    for (int i = 0; i < *count; i++)
        g[i] /= sum;
    return g;
}

static bool heights_of(struct patch *p, int first_x, int first_y, struct err *e)
{
    double lo = INFINITY, hi = -INFINITY;
    for (int j = 0; j < p->ny; j++)
        for (int i = 0; i < p->nx; i++) {
            const double h = p->z[(size_t)j * (size_t)p->stride + (size_t)i];
            if (!isfinite(h))
                return err_set(e, ERR_DATA,
                               "node (%d, %d) was not measured (NaN): fill the holes (--fill)",
                               first_x + i, first_y + j);
            lo = fmin(lo, h);
            hi = fmax(hi, h);
        }
    p->mid_m = 0.5 * (lo + hi);
    p->half_m = fmax(hi - p->mid_m, p->mid_m - lo);
    return true;
}

bool patch_init(struct patch *p, const struct hfield *hf, enum window window, double coherence_m,
                struct err *e)
{
    if (!(coherence_m > 0 && coherence_m < 1))
        return err_set(e, ERR_DATA, "bad coherence %g m: must be above 0 and below 1 m",
                       coherence_m);
    struct patch got = {.dx_m = hf->dx_m, .dy_m = hf->dy_m, .stride = hf->nx};
    int first_x, first_y;
    got.gx = window_of(window, coherence_m / 4, hf->dx_m, hf->nx, &first_x, &got.nx);
    got.gy = window_of(window, coherence_m / 4, hf->dy_m, hf->ny, &first_y, &got.ny);
    if (!got.gx || !got.gy) {
        patch_finish(&got);
        return err_set(e, ERR_DATA,
                       "a coherence of %g um holds no node: nodes are %g x %g um apart",
                       coherence_m * 1e6, hf->dx_m * 1e6, hf->dy_m * 1e6);
    }
    got.z = hf->z + (size_t)first_y * (size_t)hf->nx + first_x;
    got.centre_x = got.nx / 2;
    got.centre_y = got.ny / 2;
    if (!heights_of(&got, first_x, first_y, e)) {
        patch_finish(&got);
        return false;
    }
    *p = got;
    return true;
}

void patch_finish(struct patch *p)
{
    if (!p)
        return;
    free(p->gx);
    free(p->gy);
    *p = (struct patch){0};
}

double patch_area(const struct patch *p)
{
    double xx = 0, yy = 0;
    for (int i = 0; i < p->nx; i++)
        xx += p->gx[i] * p->gx[i];
    for (int j = 0; j < p->ny; j++)
        yy += p->gy[j] * p->gy[j];
    return p->dx_m * p->dy_m / (xx * yy);
}
