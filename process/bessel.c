// bessel.c - Bessel functions by Miller's backward recurrence.
#include "process/bessel.h"
#include <math.h>

void bessel_j(double z, int n, double *j)
{
    for (int k = 0; k < n; k++)
        j[k] = 0;
    if (z < 1e-9) { // J_0 = 1 - z^2 / 4, J_1 = z / 2
        j[0] = 1;
        if (n > 1)
            j[1] = 0.5 * z;
        return;
    }
    // Start where J is far below rounding; J_0 + 2 (J_2 + J_4 + ...) = 1 then gives the scale.
    const double top = fmax(n, z);
    const int start = 2 * ((int)(top + 20 + 8 * cbrt(top)) / 2);
    double above = 0, now = 1e-300, sum = 0;
    for (int k = start; k >= 0; k--) {
        if (k < n)
            j[k] = now;
        if (k % 2 == 0)
            sum += k ? 2 * now : now;
        const double below = 2 * k / z * now - above;
        above = now;
        now = below;
        if (fabs(now) > 1e250) {
            above *= 1e-250;
            now *= 1e-250;
            sum *= 1e-250;
            for (int i = k; i < n; i++)
                j[i] *= 1e-250;
        }
    }
    for (int k = 0; k < n; k++)
        j[k] /= sum;
}
