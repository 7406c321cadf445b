// noise.h - photon transfer: how the noise of a sensor grows with the signal.
//
// variance = read^2 + gain * signal per pixel, in counts (signal above black), and PRNU: the rms of
// the pixels' sensitivities. From pairs of frames of the same exposure: half the squared difference
// is the variance whatever the scene; what the two have in common from pixel to pixel is PRNU.
#pragma once
#include "calib/record.h"
#include <stdint.h>

struct noise {
    struct record head;
    double gain, gain_sigma; // counts per electron
    double read, read_sigma; // counts rms
    double prnu, prnu_sigma; // relative; NAN: the scene hides it
    double black, white;     // counts; white is where pixels saturate
    int pairs;
    long samples;
};

enum { NOISE_BINS = 64, NOISE_STEPS = 96 };
struct noise_sums { // zeroed at first but for black, white and model
    double black, white;
    int pairs;
    struct noise_bin {
        double n, level, square; // sums of pixels, of signals, of half squared differences
        double common;           // sum of products of the two frames' high-passed pixels
        long step[NOISE_STEPS];  // histogram of the half squared differences, half octaves
    } bin[NOISE_BINS];
    // read^2 and gain of the round before, to leave out what it does not explain (flicker, spilled
    // charge); 0, 0 in the first round, which goes by medians.
    double model[2];
    // Known from dark frames, else 0: their level, variance and how many samples it stands on. Then
    // faint pixels are not used: sorted by their own counts, most of them are fainter than they
    // look.
    double dark_level, dark_variance, dark_samples;
};

// A pair of equal exposures; hot[h][w] or NULL marks pixels to leave out. Neighbours of saturated
// pixels are left out too.
void noise_add(struct noise_sums *s, const float *a, const float *b, const uint8_t *hot, int w,
               int h);
// ERR_DATA: no pair; all black; all saturated; fewer than 3 levels of signal.
bool noise_end(const struct noise_sums *s, struct noise *out, struct err *e);

bool noise_write(const struct noise *n, const char *command, const char *path, struct err *e);
bool noise_read(struct noise *n, const char *path, struct err *e);
