// surface.c - height maps as sums of waves with whole numbers of periods in the tile.
#define _GNU_SOURCE
#include "sim/surface.h"
#include "core/mem.h"
#include "sim/rng.h"
#include <math.h>
#include <stdlib.h>

struct wave {
    int m, n;
    double strength, phase;
};

// Every (m, n) of the half plane m > 0 or (m = 0, n > 0) whose wave vector is in the band.
static int find_waves(const struct surface_recipe *r, struct wave *out, int max)
{
    const double centre = r->tile_m / r->period_m, width = fmax(0.5, r->spread * centre);
    const int last = (int)ceil(centre + 3 * width);
    int count = 0;
    for (int m = 0; m <= last; m++)
        for (int n = -last; n <= last; n++) {
            if (m == 0 && n <= 0)
                continue;
            const double off = (hypot(m, n) - centre) / width, turn = atan2(n, m);
            const double aside = r->spread_rad < M_PI ? turn / fmax(1e-3, r->spread_rad) : 0;
            const double weight = exp(-0.5 * (off * off + aside * aside));
            if (weight < 0.02 || count == max)
                continue;
            struct rng rng = rng_at(r->seed, RNG_SURFACE, (uint64_t)count);
            out[count++] = (struct wave){m, n, weight * sqrt(-2 * log(rng_uniform(&rng))),
                                         2 * M_PI * rng_uniform(&rng)};
        }
    return count;
}

bool surface_make(struct hfield *hf, const struct surface_recipe *r, struct err *e)
{
    enum { MAX_WAVES = 4000 };
    struct wave *waves = xcalloc(MAX_WAVES, sizeof *waves);
    const int count = r->period_m <= r->tile_m ? find_waves(r, waves, MAX_WAVES) : 0;
    double power = 0;
    bool coarse = false;
    for (int k = 0; k < count; k++) {
        power += 0.5 * waves[k].strength * waves[k].strength;
        coarse |= 2 * abs(waves[k].m) >= r->nodes || 2 * abs(waves[k].n) >= r->nodes;
    }
    bool ok = count || err_set(e, ERR_DATA, "no wave of period %g m fits a tile of %g m",
                               r->period_m, r->tile_m);
    if (ok && coarse)
        ok = err_set(e, ERR_DATA, "%d nodes are too few for waves of %g m on %g m", r->nodes,
                     r->period_m, r->tile_m);
    const double dx_m = r->tile_m / r->nodes, scale = r->rms_m / sqrt(power);
    if (ok && (ok = hfield_init(hf, r->nodes, r->nodes, dx_m, dx_m, e))) {
#pragma omp parallel for schedule(static)
        for (int j = 0; j < r->nodes; j++)
            for (int i = 0; i < r->nodes; i++) {
                double sum = 0;
                for (int k = 0; k < count; k++) {
                    const long at = (long)waves[k].m * i + (long)waves[k].n * j;
                    sum += waves[k].strength *
                           cos(2 * M_PI * (double)(at % r->nodes) / r->nodes + waves[k].phase);
                }
                hf->z[(size_t)j * (size_t)r->nodes + (size_t)i] = (float)(scale * sum);
            }
    }
    free(waves);
    return ok;
}

bool surface_egg_crate(struct hfield *hf, double period_m, int nodes, double depth_m, struct err *e)
{
    if (!hfield_init(hf, nodes, nodes, period_m / nodes, period_m / nodes, e))
        return false;
    for (int j = 0; j < nodes; j++)
        for (int i = 0; i < nodes; i++)
            hf->z[j * nodes + i] =
                (float)(0.25 * depth_m *
                        (2 + cos(2 * M_PI * i / nodes) + cos(2 * M_PI * j / nodes)));
    return true;
}
