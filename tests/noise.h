// noise.h - fixed random numbers for tests and benchmarks: the same on every machine.
#pragma once
#include <math.h>
#include <stdint.h>

static inline double noise_uniform(uint64_t *seed) // 0 < u < 1, splitmix64
{
    uint64_t z = *seed += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return ((double)((z ^ z >> 31) >> 11) + 0.5) / 9007199254740992.0;
}

static inline double noise_gauss(uint64_t *seed) // mean 0, variance 1, by Box and Muller
{
    const double r = sqrt(-2 * log(noise_uniform(seed)));
    return r * cos(6.283185307179586 * noise_uniform(seed));
}
