// d14_peer.h - the algorithm of D14 as published, to be timed beside ours.
#pragma once
#include "core/hfield.h"

// Seconds that D14's precomputation would take on this machine, one core: orders 0..`order` of the
// Taylor series, `wavelengths`, `n` x `n` table. For each order the DFT of h^m; for each (u, v) and
// wavelength a Gaussian of the coherence window along each axis of frequency, and row * DFT *
// column. Extrapolated from `points` table nodes of one order and wavelength.
double d14_seconds(const struct hfield *hf, double sigma_m, int order, int wavelengths, int n,
                   int points, double *checksum);
