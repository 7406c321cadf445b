// sensor.c - photons, electrons, counts.
#define _GNU_SOURCE
#include "sim/sensor.h"
#include "core/mem.h"
#include "sim/rng.h"
#include <math.h>
#include <stdlib.h>

bool sensor_init(struct sensor *s, const struct sim_sensor *spec, int w, int h, uint64_t seed,
                 struct err *e)
{
    const size_t n = (size_t)w * (size_t)h;
    float *maps = sample_alloc(5 * n, sizeof *maps, "sensor", e);
    if (!maps)
        return false;
    *s =
        (struct sensor){spec, w, h, seed, maps, maps + n, maps + 2 * n, maps + 3 * n, maps + 4 * n};
    float *column = xcalloc((size_t)w, sizeof *column);
    for (int i = 0; i < w; i++) {
        struct rng r = rng_at(seed, RNG_OFFSET, n + (uint64_t)i);
        column[i] = (float)(spec->column_pattern * rng_normal(&r));
    }
#pragma omp parallel for schedule(static)
    for (int j = 0; j < h; j++)
        for (int i = 0; i < w; i++) {
            const size_t k = (size_t)j * (size_t)w + (size_t)i;
            struct rng a = rng_at(seed, RNG_PRNU, k), b = rng_at(seed, RNG_OFFSET, k),
                       c = rng_at(seed, RNG_HOT, k);
            s->response[k] = (float)fmax(0, 1 + spec->prnu * rng_normal(&a));
            s->offset[k] = column[i] + (float)(spec->fixed_pattern * rng_normal(&b));
            const bool hot = rng_uniform(&c) < spec->hot_pixels;
            s->dark[k] =
                (float)(spec->dark_current - (hot ? spec->hot_current * log(rng_uniform(&c)) : 0));
        }
    free(column);
    return true;
}

void sensor_finish(struct sensor *s)
{
    if (!s)
        return;
    free(s->response);
    *s = (struct sensor){0};
}

double sensor_drift(const struct sensor *s, uint64_t frame)
{
    double sum = 0;
    for (uint64_t k = 0; k < 3; k++) { // slow waves of unrelated periods
        struct rng r = rng_at(s->seed, RNG_DRIFT, k);
        const double period = 20 + 200 * rng_uniform(&r), phase = rng_uniform(&r);
        sum += sin(2 * M_PI * ((double)frame / period + phase));
    }
    return s->spec->black_drift * sum / 3;
}

// The Bayer channel of a pixel (RGGB).
static int channel(const struct sim_sensor *s, int i, int j)
{
    return s->bayer ? (j & 1) + (i & 1) : 0;
}

static void expose_row(struct sensor *s, const struct sensor_layer *layers, int n_layers,
                       double exposure_s, uint64_t frame, int j)
{
    const struct sim_sensor *spec = s->spec;
    const size_t nc = spec->bayer ? 3 : 1;
    const double per_radiance = spec->responsivity * spec->electrons_per_count;
    for (int i = 0; i < s->w; i++) {
        const size_t k = (size_t)j * (size_t)s->w + (size_t)i;
        double light = 0;
        for (int l = 0; l < n_layers; l++)
            light += (double)layers[l].radiance[k * nc + (size_t)channel(spec, i, j)] *
                     layers[l].seconds[j];
        const double mean =
            per_radiance * light * (double)s->response[k] + (double)s->dark[k] * exposure_s;
        struct rng r = rng_at(s->seed, RNG_NOISE, (frame << 32) + k);
        s->charge[k] = (float)(spec->shot_noise ? rng_poisson(&r, mean) : mean);
        s->read[k] = spec->read_noise > 0 ? (float)(spec->read_noise * rng_normal(&r)) : 0;
    }
}

// What does not fit spills to the neighbours in its column, half each way, as far as it must.
static void bloom(struct sensor *s)
{
    const float full = (float)s->spec->full_well, share = (float)(0.5 * s->spec->blooming);
    const size_t w = (size_t)s->w, h = (size_t)s->h;
    float *down = xcalloc(2 * w, sizeof *down), *up = down + w;
    for (size_t pass = 0; pass < 2 && share > 0; pass++) { // pass 0 down the rows, pass 1 up
        float *carry = pass ? up : down;
        for (size_t n = 0; n < h; n++) {
            float *row = s->charge + (pass ? h - 1 - n : n) * w;
            for (size_t i = 0; i < w; i++) {
                const float excess = row[i] > full ? row[i] - full : 0;
                const float room = row[i] < full ? full - row[i] : 0;
                const float taken = carry[i] < room ? carry[i] : room;
                row[i] += taken;
                carry[i] += share * excess - taken;
            }
        }
    }
    free(down);
    for (size_t k = 0; k < w * h; k++)
        s->charge[k] = s->charge[k] > full ? full : s->charge[k];
}

void sensor_expose(struct sensor *s, const struct sensor_layer *layers, int n_layers,
                   double exposure_s, double gain, uint64_t frame, uint16_t *raw)
{
    const struct sim_sensor *spec = s->spec;
    const double top = (double)((1 << spec->bits) - 1), drift = sensor_drift(s, frame);
    bool spills = false;
#pragma omp parallel for schedule(static) reduction(|| : spills)
    for (int j = 0; j < s->h; j++) {
        expose_row(s, layers, n_layers, exposure_s, frame, j);
        for (int i = 0; i < s->w; i++)
            spills =
                spills || (double)s->charge[(size_t)j * (size_t)s->w + (size_t)i] > spec->full_well;
    }
    if (spills)
        bloom(s);
#pragma omp parallel for schedule(static)
    for (int j = 0; j < s->h; j++)
        for (int i = 0; i < s->w; i++) {
            const size_t k = (size_t)j * (size_t)s->w + (size_t)i;
            const double electrons = (double)s->charge[k] + (double)s->read[k];
            const double x = spec->black + drift + (double)s->offset[k] +
                             gain * electrons / spec->electrons_per_count;
            raw[k] = (uint16_t)fmax(0, fmin(top, floor(x + 0.5)));
        }
}
