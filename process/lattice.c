// lattice.c - peaks of a disc's spectrum, and the wave vectors that all of them are made of.
#define _GNU_SOURCE // M_PI
#include "process/lattice.h"
#include "calib/grating.h"
#include "core/mem.h"
#include "core/sort.h"
#include "process/fft.h"
#include <math.h>
#include <stdlib.h>

enum { MOST_PEAKS = 16, MOST_DENOMINATOR = 6 };
static const double FLOOR = 0.02;  // of the strongest peak: (1 - r^2)^4 has lower side lobes
static const double ASTRAY = 0.01; // of the peaks' power that may stand beside the lattice

struct peak {
    double kx, ky, power;
    int p, q; // in D-ths of the two first vectors, then of the lattice's
};

// |F|^2 of the disc under (1 - r^2)^4, [n][n/2 + 1]; NULL without memory.
static float *spectrum(const struct disc *d, const float *flat, int w, int h, int n, struct err *e)
{
    const size_t half = (size_t)n / 2 + 1, all = (size_t)n * half;
    struct fft *plan = fft_new(FFT_R2C, FFT_FLOAT, n, n, 1, false, e);
    float *z = sample_alloc((size_t)n * (size_t)n, sizeof *z, "spectrum", e),
          *f = sample_alloc(2 * all, sizeof *f, "spectrum", e),
          *power = sample_alloc(all, sizeof *power, "spectrum", e);
    if (plan && z && f && power) {
        const int left = (int)d->cx_px - n / 2, top = (int)d->cy_px - n / 2;
        double sum = 0, weights = 0;
        for (int pass = 0; pass < 2; pass++) // the mean, then what deviates from it
            for (int j = 0; j < n; j++)
                for (int i = 0; i < n; i++) {
                    const int x = left + i, y = top + j;
                    const double r = hypot(x - d->cx_px, y - d->cy_px) / (0.95 * d->radius_px);
                    if (r >= 1 || x < 0 || y < 0 || x >= w || y >= h)
                        continue;
                    const double v = (double)flat[(size_t)y * (size_t)w + (size_t)x],
                                 window = pow(1 - r * r, 4);
                    if (pass) {
                        z[(size_t)j * (size_t)n + (size_t)i] =
                            (float)(window * (v - sum / weights));
                    } else {
                        sum += window * v;
                        weights += window;
                    }
                }
        fft_run(plan, z, f);
        for (size_t k = 0; k < all; k++)
            power[k] = f[2 * k] * f[2 * k] + f[2 * k + 1] * f[2 * k + 1];
    } else {
        free(power);
        power = NULL;
    }
    fft_free(plan);
    free(z);
    free(f);
    return power;
}

static float power_at(const float *power, int n, int i, int j)
{
    if (i < 0) { // a real picture: P(-k) = P(k)
        i = -i;
        j = -j;
    }
    return power[(size_t)((j % n + n) % n) * ((size_t)n / 2 + 1) + (size_t)i];
}

static bool is_top(const float *power, int n, int i, int j)
{
    const float here = power_at(power, n, i, j);
    for (int q = -1; q <= 1; q++)
        for (int p = -1; p <= 1; p++)
            if (i + p <= n / 2 && power_at(power, n, i + p, j + q) > here)
                return false;
    return true;
}

// The strongest peaks, strongest first, climbed to their tops; how many.
static int find_peaks(struct peak peak[MOST_PEAKS], const struct disc *d, const float *flat, int w,
                      int h, struct err *e)
{
    const int n = fft_good_size(2 * (int)d->radius_px + 2), lowest = 4; // bins: the window's lobe
    float *power = spectrum(d, flat, w, h, n, e), probe[4096];
    int found = 0;
    if (!power)
        return -1;
    const size_t some =
        sorted_probe(power, (size_t)n * ((size_t)n / 2 + 1), probe, sizeof probe / sizeof *probe);
    const double least = 36 * (double)probe[some / 2];
    for (int j = -n / 2 + 1; j < n / 2; j++)
        for (int i = 0; i <= (int)(0.45 * n); i++) {
            const double here = (double)power_at(power, n, i, j);
            if (here < least || hypot(i, j) < lowest || (i == 0 && j < 0) ||
                abs(j) > (int)(0.45 * n) || !is_top(power, n, i, j))
                continue;
            if (found == MOST_PEAKS && peak[found - 1].power >= here)
                continue;
            int at = found < MOST_PEAKS ? found++ : MOST_PEAKS - 1;
            for (; at > 0 && peak[at - 1].power < here; at--)
                peak[at] = peak[at - 1];
            peak[at] = (struct peak){(double)i / n, (double)j / n, here, 0, 0};
        }
    free(power);
    while (found > 0 && peak[found - 1].power < FLOOR * FLOOR * peak[0].power)
        found--;
    for (int k = 0; k < found; k++)
        grating_climb(d, flat, w, h, &peak[k].kx, &peak[k].ky);
    return found;
}

static double cross(double ax, double ay, double bx, double by)
{
    return ax * by - ay * bx;
}

// Coordinates of a vector in the lattice's wave vectors.
static void coordinates(const struct lattice *l, double kx, double ky, double *p, double *q)
{
    const double det = cross(l->kx[0], l->ky[0], l->kx[1], l->ky[1]);
    *p = cross(kx, ky, l->kx[1], l->ky[1]) / det;
    *q = cross(l->kx[0], l->ky[0], kx, ky) / det;
}

// Takes D-ths of the basis for the peaks' coordinates; power of those that they do not meet.
static double astray(const struct lattice *l, struct peak *peak, int n, int d, double tolerance)
{
    double off = 0;
    for (int k = 0; k < n; k++) {
        double p, q;
        coordinates(l, peak[k].kx, peak[k].ky, &p, &q);
        peak[k].p = (int)lround(d * p);
        peak[k].q = (int)lround(d * q);
        const double x = (peak[k].p * l->kx[0] + peak[k].q * l->kx[1]) / d - peak[k].kx,
                     y = (peak[k].p * l->ky[0] + peak[k].q * l->ky[1]) / d - peak[k].ky;
        if (hypot(x, y) > tolerance) {
            off += peak[k].power;
            peak[k].p = peak[k].q = 0;
        }
    }
    return off;
}

// One more integer vector into the basis ((a, b), (0, c)) of those so far (Hermite normal form).
static void join(int *a, int *b, int *c, int p, int q)
{
    while (p) { // Euclid on the first coordinate
        const int times = *a / p, rest = *a - times * p, rest_q = *b - times * q;
        *a = p;
        *b = q;
        p = rest;
        q = rest_q;
    }
    while (q) { // what is left has none
        const int rest = *c % q;
        *c = q;
        q = rest;
    }
    *b %= *c;
}

// The two shortest vectors of the lattice (Gauss), spanning a positive area.
static void reduce(struct lattice *l)
{
    for (int turn = 0; turn < 100; turn++) {
        const double aa = l->kx[0] * l->kx[0] + l->ky[0] * l->ky[0],
                     bb = l->kx[1] * l->kx[1] + l->ky[1] * l->ky[1],
                     ab = l->kx[0] * l->kx[1] + l->ky[0] * l->ky[1];
        const int s = aa <= bb; // the longer one
        const double times = round(ab / fmin(aa, bb));
        if (times == 0)
            break;
        l->kx[s] -= times * l->kx[1 - s];
        l->ky[s] -= times * l->ky[1 - s];
    }
    if (cross(l->kx[0], l->ky[0], l->kx[1], l->ky[1]) < 0) {
        l->kx[1] = -l->kx[1];
        l->ky[1] = -l->ky[1];
    }
}

// Wave vectors by least squares from all peaks on the lattice, which count by their power.
static void polish(struct lattice *l, const struct peak *peak, int n)
{
    double pp = 0, pq = 0, qq = 0, px = 0, py = 0, qx = 0, qy = 0;
    l->peaks = 0;
    for (int k = 0; k < n; k++) {
        double p, q;
        if (!peak[k].p && !peak[k].q)
            continue;
        coordinates(l, peak[k].kx, peak[k].ky, &p, &q);
        p = round(p);
        q = round(q);
        pp += peak[k].power * p * p;
        pq += peak[k].power * p * q;
        qq += peak[k].power * q * q;
        px += peak[k].power * p * peak[k].kx;
        py += peak[k].power * p * peak[k].ky;
        qx += peak[k].power * q * peak[k].kx;
        qy += peak[k].power * q * peak[k].ky;
        l->peaks++;
    }
    const double det = pp * qq - pq * pq;
    l->kx[0] = (qq * px - pq * qx) / det;
    l->ky[0] = (qq * py - pq * qy) / det;
    l->kx[1] = (pp * qx - pq * px) / det;
    l->ky[1] = (pp * qy - pq * py) / det;
}

bool lattice_find(struct lattice *out, const struct disc *d, const float *flat, int w, int h,
                  struct err *e)
{
    struct peak peak[MOST_PEAKS];
    const int n = find_peaks(peak, d, flat, w, h, e);
    if (n < 0)
        return false;
    int second = 1;
    while (second < n &&
           fabs(cross(peak[0].kx, peak[0].ky, peak[second].kx, peak[second].ky)) <
               0.3 * hypot(peak[0].kx, peak[0].ky) * hypot(peak[second].kx, peak[second].ky))
        second++;
    if (second >= n)
        return err_set(e, ERR_DATA, "no lattice: %d peaks of the spectrum, in one direction", n);
    struct lattice l = {.kx = {peak[0].kx, peak[second].kx}, .ky = {peak[0].ky, peak[second].ky}};
    double all = 0, off = 0;
    int denominator = 0;
    for (int k = 0; k < n; k++)
        all += peak[k].power;
    do
        off = astray(&l, peak, n, ++denominator, 0.03 / d->radius_px);
    while (off > ASTRAY * all && denominator < MOST_DENOMINATOR);
    if (off > ASTRAY * all)
        return err_set(e, ERR_DATA, "no lattice: %.0f %% of the peaks' power stands beside it",
                       100 * off / all);
    int a = denominator, b = 0, c = denominator;
    for (int k = 0; k < n; k++)
        join(&a, &b, &c, peak[k].p, peak[k].q);
    const struct lattice first = l;
    l.kx[0] = (a * first.kx[0] + b * first.kx[1]) / denominator;
    l.ky[0] = (a * first.ky[0] + b * first.ky[1]) / denominator;
    l.kx[1] = c * first.kx[1] / denominator;
    l.ky[1] = c * first.ky[1] / denominator;
    reduce(&l);
    polish(&l, peak, n);
    const double det = cross(l.kx[0], l.ky[0], l.kx[1], l.ky[1]);
    l.ax[0] = l.ky[1] / det;
    l.ay[0] = -l.kx[1] / det;
    l.ax[1] = -l.ky[0] / det;
    l.ay[1] = l.kx[0] / det;
    const double side0 = hypot(l.ax[0], l.ay[0]), side1 = hypot(l.ax[1], l.ay[1]);
    if (!(fmin(side0, side1) >= 4 && fmax(side0, side1) < 0.4 * d->radius_px))
        return err_set(e, ERR_DATA,
                       "no lattice: cells of %.1f x %.1f px in a disc of %.0f px, needs 4 px to a "
                       "fifth of it",
                       side0, side1, 2 * d->radius_px);
    *out = l;
    return true;
}

void lattice_nearest(const struct lattice *l, double kx, double ky, double *near_x, double *near_y)
{
    double p, q;
    coordinates(l, kx, ky, &p, &q);
    *near_x = round(p) * l->kx[0] + round(q) * l->kx[1];
    *near_y = round(p) * l->ky[0] + round(q) * l->ky[1];
}
