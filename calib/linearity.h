// linearity.h - whether a sensor's counts are proportional to exposure.
//
// Two frames of one scene whose exposures differ: given their sum s, the longer one's mean is
// share * s + offset at every level if the sensor is linear. What is left over by level is not.
#pragma once
#include "calib/record.h"

enum { LINEARITY_BINS = 32 };

struct linearity {
    struct record head;
    double white;                 // counts above black
    double level[LINEARITY_BINS]; // of the longer frame, counts above black
    double off[LINEARITY_BINS];   // measured minus linear, relative to white
    double sigma[LINEARITY_BINS]; // of that
    int bins, pairs;
    double worst; // largest |off| that exceeds 3 sigma, less 3 sigma; 0 where none does
};

struct linearity_sums { // zeroed at first
    double n[LINEARITY_BINS], level[LINEARITY_BINS], off[LINEARITY_BINS], square[LINEARITY_BINS];
    int pairs;
};

// Frames above black; time_b > time_a. Samples from `white` on are saturated.
void linearity_add(struct linearity_sums *s, const float *a, const float *b, size_t n,
                   double time_a, double time_b, double white);
// ERR_DATA: fewer than 4 levels seen.
bool linearity_end(const struct linearity_sums *s, double white, struct linearity *out,
                   struct err *e);
bool linearity_write(const struct linearity *l, const char *command, const char *path,
                     struct err *e);
