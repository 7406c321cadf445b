// taps.h - reading a padded FFT between its bins: the few taps that make up one frequency.
//
// Kaiser-Bessel interpolation (Fessler & Sutton 2003; Beatty 2005): samples are divided by the
// kernel's transform, zero-padded to about twice their number and transformed; any frequency then
// is a weighted sum of TAPS neighbouring bins. With TAPS = 8 the error is below float rounding and
// relative to the neighbouring bins, so dim places stay right beside bright ones.
#pragma once

enum { TAPS = 8 };

// One axis: n samples padded to `fine` bins; frequencies in cycles per sample.
double taps_correction(int fine,
                       int offset); // factor for the sample `offset` nodes from the centre

// The first bin that frequency f in [-0.5, 0.5] reads (negative ones are allowed, bins repeat after
// `fine`), and the weights of it and the following ones.
int taps_first(int fine, double f);
void taps_weights(int fine, double f, float weight[TAPS]);

// f folded to [-0.5, 0.5]: the transform of samples repeats after one cycle per sample.
double taps_fold(double f);
