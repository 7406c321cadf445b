// taps.c - Kaiser-Bessel interpolation of padded transforms.
#include "process/taps.h"
#include <math.h>

static const double beta = 2.3 * TAPS; // near-optimal for two-fold padding (Beatty 2005, eq. 5)

static double bessel_i0(double x)
{
    double sum = 1, term = 1;
    for (int k = 1; term > 1e-17 * sum; k++) {
        term *= (0.5 * x / k) * (0.5 * x / k);
        sum += term;
    }
    return sum;
}

double taps_correction(int fine, int offset)
{
    const double phase = 3.14159265358979323846 * TAPS * offset / fine;
    const double root = sqrt(beta * beta - phase * phase); // phase <= pi TAPS / 4 < beta
    return bessel_i0(beta) * root / (TAPS * sinh(root));
}

int taps_first(int fine, double f)
{
    return (int)ceil(f * fine - 0.5 * TAPS);
}

void taps_weights(int fine, double f, float weight[TAPS])
{
    const double at = f * fine;
    const double scale = 1 / bessel_i0(beta);
    const int first = taps_first(fine, f);
    for (int t = 0; t < TAPS; t++) {
        const double x = (first + t - at) / (0.5 * TAPS);
        weight[t] = (float)(bessel_i0(beta * sqrt(fmax(0, 1 - x * x))) * scale);
    }
}

double taps_fold(double f)
{
    return f - rint(f);
}
