// periods.h - the dominant periods of a height field and their directions, finer than a bin of its
// spectrum.
#pragma once
#include "core/hfield.h"

struct period {
    double period_m;
    double direction_rad; // of the wave vector from x towards y, in (-pi/2, pi/2]
    double amplitude_m;   // of the sinusoid
};

// Up to two, in different directions (at least 20 degrees apart); the one nearer to the x axis
// comes first. The peaks are sought in the spectrum under a Hann window and refined on the
// transform itself, which is continuous in frequency. NAN nodes count as the mean. Returns how many
// stand out of the noise (6 times the median of the spectrum, and 2 % of the strongest): 0, 1 or 2;
// -1 and an error when there is no memory.
int hfield_periods(const struct hfield *hf, struct period out[2], struct err *e);
