// rng.c - Philox, Box-Muller, and Poisson numbers by inversion and by Hoermann's PTRS.
#define _GNU_SOURCE
#include "sim/rng.h"

#include <math.h>
#include <string.h>

struct rng rng_at(uint64_t seed, uint32_t stream, uint64_t index)
{
    return (struct rng){
        .key = {(uint32_t)seed, (uint32_t)(seed >> 32)},
        .counter = {(uint32_t)index, (uint32_t)(index >> 32), stream, 0},
    };
}

static void block(struct rng *r)
{
    uint32_t c[4], k0 = r->key[0], k1 = r->key[1];
    memcpy(c, r->counter, sizeof c);
    for (int round = 0; round < 10; round++) {
        const uint64_t a = (uint64_t)0xD2511F53u * c[0], b = (uint64_t)0xCD9E8D57u * c[2];
        const uint32_t x = (uint32_t)(b >> 32) ^ c[1] ^ k0, y = (uint32_t)(a >> 32) ^ c[3] ^ k1;
        c[0] = x;
        c[1] = (uint32_t)b;
        c[2] = y;
        c[3] = (uint32_t)a;
        k0 += 0x9E3779B9u;
        k1 += 0xBB67AE85u;
    }
    memcpy(r->out, c, sizeof c);
    r->counter[3]++;
    r->left = 4;
}

uint32_t rng_word(struct rng *r)
{
    if (!r->left)
        block(r);
    return r->out[--r->left];
}

double rng_uniform(struct rng *r)
{
    return ((double)rng_word(r) + 0.5) * 0x1p-32;
}

double rng_normal(struct rng *r)
{
    const double radius = sqrt(-2 * log(rng_uniform(r)));
    return radius * cos(2 * M_PI * rng_uniform(r));
}

// ln k! : Stirling's series, whose error is under 1e-10 from k = 10 on.
static double log_factorial(double k)
{
    static const double small[10] = {0,
                                     0,
                                     0.69314718055994531,
                                     1.7917594692280550,
                                     3.1780538303479458,
                                     4.7874917427820458,
                                     6.5792512120101012,
                                     8.5251613610654147,
                                     10.604602902745251,
                                     12.801827480081469};
    if (k < 10)
        return small[(int)k];
    const double r = 1 / (k + 1), r2 = r * r;
    return (k + 0.5) * log(k + 1) - (k + 1) + 0.91893853320467274 +
           r * (1. / 12 - r2 * (1. / 360 - r2 * (1. / 1260 - r2 / 1680)));
}

// W. Hoermann, "The transformed rejection method for generating Poisson random variables",
// Insurance: Mathematics and Economics 12 (1993), algorithm PTRS; for means from 10 on.
static double poisson_ptrs(struct rng *r, double mean)
{
    const double b = 0.931 + 2.53 * sqrt(mean), a = -0.059 + 0.02483 * b;
    const double inv_alpha = 1.1239 + 1.1328 / (b - 3.4), v_r = 0.9277 - 3.6224 / (b - 2);
    for (;;) {
        const double u = rng_uniform(r) - 0.5, v = rng_uniform(r), us = 0.5 - fabs(u);
        const double k = floor((2 * a / us + b) * u + mean + 0.43);
        if (us >= 0.07 && v <= v_r)
            return k;
        if (k < 0 || (us < 0.013 && v > us))
            continue;
        if (log(v * inv_alpha / (a / (us * us) + b)) <= k * log(mean) - mean - log_factorial(k))
            return k;
    }
}

double rng_poisson(struct rng *r, double mean)
{
    if (!(mean > 0))
        return 0;
    if (mean >= 10)
        return poisson_ptrs(r, mean);
    double p = exp(-mean), below = p, k = 0; // inversion: walk up the distribution
    const double x = rng_uniform(r);
    while (x > below && k < 200) {
        p *= mean / ++k;
        below += p;
    }
    return k;
}
