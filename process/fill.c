// fill.c - heights for the nodes that were not measured, by relaxation on a pyramid.
#include "process/fill.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

struct level { // of the pyramid: each node the mean of the measured ones among four below
    int nx, ny;
    double *z;
    bool *hole;
};

static bool level_init(struct level *l, int nx, int ny, struct err *e)
{
    *l = (struct level){.nx = nx, .ny = ny};
    l->z = sample_alloc((size_t)nx * (size_t)ny, sizeof *l->z, "filled heights", e);
    l->hole =
        l->z ? sample_alloc((size_t)nx * (size_t)ny, sizeof *l->hole, "filled heights", e) : NULL;
    return l->hole;
}

static void level_finish(struct level *l)
{
    free(l->z);
    free(l->hole);
}

static void shrink(const struct level *fine, struct level *coarse)
{
    for (int j = 0; j < coarse->ny; j++)
        for (int i = 0; i < coarse->nx; i++) {
            double sum = 0;
            int n = 0;
            for (int k = 0; k < 4; k++) {
                const int x = 2 * i + k % 2, y = 2 * j + k / 2;
                if (x < fine->nx && y < fine->ny && !fine->hole[y * fine->nx + x]) {
                    sum += fine->z[y * fine->nx + x];
                    n++;
                }
            }
            coarse->hole[j * coarse->nx + i] = !n;
            coarse->z[j * coarse->nx + i] = n ? sum / n : 0;
        }
}

// One sweep of successive over-relaxation over the holes; returns the largest change.
static double relax(struct level *l)
{
    double most = 0;
    for (int j = 0; j < l->ny; j++)
        for (int i = 0; i < l->nx; i++) {
            double *z = l->z + j * l->nx + i;
            if (!l->hole[j * l->nx + i])
                continue;
            double sum = 0;
            int n = 0;
            if (i > 0)
                sum += z[-1], n++;
            if (i < l->nx - 1)
                sum += z[1], n++;
            if (j > 0)
                sum += z[-l->nx], n++;
            if (j < l->ny - 1)
                sum += z[l->nx], n++;
            const double change = 1.8 * (sum / n - *z);
            *z += change;
            most = fmax(most, fabs(change));
        }
    return most;
}

static bool fill_level(struct level *l, double small, struct err *e)
{
    bool any = false;
    for (int k = 0; k < l->nx * l->ny && !any; k++)
        any = l->hole[k];
    if (!any || (l->nx < 2 && l->ny < 2))
        return true;
    struct level coarse;
    bool ok = level_init(&coarse, (l->nx + 1) / 2, (l->ny + 1) / 2, e);
    if (ok) {
        shrink(l, &coarse);
        ok = fill_level(&coarse, small, e);
    }
    if (ok) {
        for (int j = 0; j < l->ny; j++)
            for (int i = 0; i < l->nx; i++)
                if (l->hole[j * l->nx + i])
                    l->z[j * l->nx + i] = coarse.z[j / 2 * coarse.nx + i / 2];
        for (int sweep = 0; sweep < 1000 && relax(l) > small;)
            sweep++;
    }
    level_finish(&coarse);
    return ok;
}

bool hfield_fill(struct hfield *hf, long *filled, struct err *e)
{
    double lo, hi;
    struct level l;
    const size_t n = (size_t)hf->nx * (size_t)hf->ny;
    *filled = hfield_missing(hf);
    if (!*filled)
        return true;
    if (!hfield_range(hf, &lo, &hi))
        return err_set(e, ERR_DATA, "no node was measured: nothing to fill from");
    bool ok = level_init(&l, hf->nx, hf->ny, e);
    for (size_t k = 0; ok && k < n; k++) {
        l.hole[k] = isnan(hf->z[k]);
        l.z[k] = l.hole[k] ? 0 : hf->z[k];
    }
    ok = ok && fill_level(&l, 1e-7 * (hi - lo), e);
    for (size_t k = 0; ok && k < n; k++)
        if (l.hole[k])
            hf->z[k] = (float)l.z[k];
    level_finish(&l);
    return ok;
}
