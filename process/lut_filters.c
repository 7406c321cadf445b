// lut_filters.c - weights of photographs over the wavelength.
#define _GNU_SOURCE
#include "process/lut_filters.h"
#include <math.h>
#include <stddef.h>

bool lut_filters_check(const struct lut_filters *f, struct err *e)
{
    for (int k = 1; k < f->n; k++)
        if (!(f->lambda_m[k] - f->lambda_m[k - 1] >= 5e-9))
            return err_set(e, ERR_DATA,
                           "photographs at %.0f nm and %.0f nm: give them from short to long "
                           "wavelengths, 5 nm apart or more",
                           f->lambda_m[k - 1] * 1e9, f->lambda_m[k] * 1e9);
    return true;
}

// 1/l in units that keep products of differences near 1.
static double place(double lambda_m)
{
    return 1e-6 / lambda_m;
}

// Slope at node j of what is 1 at node k and 0 at the others: of the parabola through three nodes
// (two: of the line).
static double slope(const struct lut_filters *f, int k, int j)
{
    const int first = j == 0 ? 0 : j < f->n - 1 ? j - 1 : f->n > 2 ? j - 2 : j - 1;
    const int last = first + (f->n > 2 ? 2 : 1);
    if (k < first || k > last)
        return 0;
    const double x = place(f->lambda_m[j]), xk = place(f->lambda_m[k]);
    double sum = 0; // derivative of the product over m != k of (x - x_m) / (x_k - x_m)
    for (int out = first; out <= last; out++) {
        if (out == k)
            continue;
        double product = 1 / (xk - place(f->lambda_m[out]));
        for (int m = first; m <= last; m++)
            if (m != k && m != out)
                product *= (x - place(f->lambda_m[m])) / (xk - place(f->lambda_m[m]));
        sum += product;
    }
    return sum;
}

double lut_filters_weight(const struct lut_filters *f, int k, double lambda_m)
{
    const int n = f->n;
    const double x = place(lambda_m);
    if (n < 2)
        return 1;
    for (int end = 0; end < n; end += n - 1) {
        const double far = x - place(f->lambda_m[end]);
        if (end ? far <= 0 : far >= 0)
            return (k == end) + slope(f, k, end) * far;
    }
    int j = 0;
    while (lambda_m > f->lambda_m[j + 1])
        j++;
    const double h = place(f->lambda_m[j + 1]) - place(f->lambda_m[j]);
    const double s = (x - place(f->lambda_m[j])) / h, r = 1 - s;
    return (k == j) * (1 + 2 * s) * r * r + (k == j + 1) * s * s * (3 - 2 * s) +
           h * s * r * (slope(f, k, j) * r - slope(f, k, j + 1) * s);
}

void lut_filters_add(struct table *sum, const struct table *part)
{
    const size_t nodes = (size_t)sum->n * (size_t)sum->n;
    for (size_t i = 0; i < 3 * nodes; i++)
        sum->tab[i] += part->tab[i];
    for (size_t i = 0; sum->sigma && part->sigma && i < 3 * nodes; i++)
        sum->sigma[i] = hypotf(sum->sigma[i], part->sigma[i]);
    for (size_t i = 0; sum->cover && part->cover && i < nodes; i++)
        sum->cover[i] = fminf(sum->cover[i], part->cover[i]);
}
