// rng.h - random numbers by counter: (seed, stream, index) gives the same numbers on any thread, in
// any order.
//
// Philox 4x32-10 (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC 2011).
#pragma once
#include <stdint.h>

// What a stream is for; two streams of one seed are independent.
enum rng_stream {
    RNG_NOISE,
    RNG_READ,
    RNG_PRNU,
    RNG_OFFSET,
    RNG_HOT,
    RNG_SURFACE,
    RNG_FAULT,
    RNG_DRIFT
};

struct rng {
    uint32_t key[2], counter[4], out[4];
    int left; // unused words of out
};

struct rng rng_at(uint64_t seed, uint32_t stream, uint64_t index);
uint32_t rng_word(struct rng *r);
double rng_uniform(struct rng *r);              // 0 < x < 1
double rng_normal(struct rng *r);               // mean 0, variance 1
double rng_poisson(struct rng *r, double mean); // a whole number; 0 for a mean <= 0
