// sensor.h - from light to counts: everything a real sensor adds on the way.
//
// electrons ~ Poisson(responsivity * L * seconds * electrons_per_count * (1 + prnu) + dark *
// exposure); what exceeds the full well spills along the column; counts = black + drift + offset +
// gain * (electrons + read noise) / electrons_per_count, rounded and clipped. All randomness is by
// counter: the same seed and frame give the same counts on any number of threads.
#pragma once
#include "sim/scene.h"

struct sensor {
    const struct sim_sensor *spec; // not owned
    int w, h;
    uint64_t seed;
    float *response, *offset, *dark; // [h][w] 1 + prnu; counts; electrons / s; owned
    float *charge, *read;            // [h][w] electrons of the frame being made, owned
};

// Light that is on during a frame: its radiance, and for how long each row sees it.
struct sensor_layer {
    const float *radiance; // [h][w][nc], nc as the scene's sensor has channels
    const double *seconds; // [h]
};

bool sensor_init(struct sensor *s, const struct sim_sensor *spec, int w, int h, uint64_t seed,
                 struct err *e);
void sensor_finish(struct sensor *s); // accepts a zeroed struct

// One frame into raw[h][w]. The frame's number selects its noise and drift.
void sensor_expose(struct sensor *s, const struct sensor_layer *layers, int n_layers,
                   double exposure_s, double gain, uint64_t frame, uint16_t *raw);

double sensor_drift(const struct sensor *s, uint64_t frame); // of the black level, counts
