// grating_profile.c - the profile of a blazed grating: its blur, and the profile without it.
#define _GNU_SOURCE // M_PI
#include "calib/grating.h"
#include <math.h>
#include <string.h>

enum { N = GRATING_SAMPLES };

static double sinc(double x)
{
    return fabs(x) < 1e-8 ? 1 : sin(M_PI * x) / (M_PI * x);
}

// What Gaussian and pixel leave of harmonic m.
static double transfer(const struct grating *g, int m, double sigma_px)
{
    const double k2 = g->kx * g->kx + g->ky * g->ky;
    return exp(-2 * M_PI * M_PI * m * m * k2 * sigma_px * sigma_px) * sinc(m * g->kx) *
           sinc(m * g->ky);
}

// Harmonic m of t - 1/2, t the phase behind a jump at 0, running up or down.
static double complex saw(int m, int rises)
{
    return (double)rises * I / (2 * M_PI * m);
}

// Least squares for the contrast on `from`, at the best jump; returns the residual on `to`.
static double try_blaze(const struct grating *g, const double complex *from,
                        const double complex *to, struct blaze *b)
{
    // The jump: golden section would be fooled by ripples of the high harmonics, so start from the
    // fundamental's phase and polish with Newton on the sum of all.
    double complex model[GRATING_HARMONICS + 1];
    double mm = 0;
    for (int m = 1; m <= g->harmonics; m++) {
        model[m] = saw(m, b->rises) * transfer(g, m, b->sigma_px);
        mm += pow(cabs(model[m]), 2);
    }
    double jump = -carg(from[1] / model[1]) / (2 * M_PI);
    for (int round = 0; round < 6; round++) {
        double slope = 0, bend = 0;
        for (int m = 1; m <= g->harmonics; m++) {
            const double complex z = conj(model[m]) * from[m] * cexp(2 * M_PI * I * m * jump);
            slope -= 2 * M_PI * m * cimag(z);
            bend -= pow(2 * M_PI * m, 2) * creal(z);
        }
        if (bend < 0)
            jump -= slope / bend;
    }
    double contrast = 0, residual = 0, all = 0;
    for (int m = 1; m <= g->harmonics; m++) {
        model[m] *= cexp(-2 * M_PI * I * m * jump);
        contrast += creal(conj(model[m]) * from[m]) / mm;
    }
    for (int m = 1; m <= g->harmonics; m++) {
        residual += pow(cabs(to[m] - contrast * model[m]), 2);
        all += pow(cabs(to[m]), 2);
    }
    b->contrast = contrast;
    b->jump = jump - floor(jump);
    return sqrt(residual / all);
}

// Both halves held out in turn.
static double held_out(const struct grating *g, struct blaze *b)
{
    return 0.5 *
           (try_blaze(g, g->half[0], g->half[1], b) + try_blaze(g, g->half[1], g->half[0], b));
}

static struct blaze best_sigma(const struct grating *g, int rises)
{
    const double golden = 0.6180339887498949;
    struct blaze b = {.rises = rises};
    double lo = 0, hi = 0.5 / hypot(g->kx, g->ky); // half a period: nothing would be left
    double x1 = hi - golden * (hi - lo), x2 = lo + golden * (hi - lo), f1, f2;
    b.sigma_px = x1;
    f1 = held_out(g, &b);
    b.sigma_px = x2;
    f2 = held_out(g, &b);
    while (hi - lo > 1e-5) {
        const bool left = f1 < f2;
        if (left) {
            hi = x2;
            x2 = x1;
            f2 = f1;
            x1 = hi - golden * (hi - lo);
        } else {
            lo = x1;
            x1 = x2;
            f1 = f2;
            x2 = lo + golden * (hi - lo);
        }
        b.sigma_px = left ? x1 : x2;
        *(left ? &f1 : &f2) = held_out(g, &b);
    }
    b.sigma_px = 0.5 * (lo + hi);
    b.held_out = held_out(g, &b);
    try_blaze(g, g->f, g->f, &b); // contrast and jump from all the pixels
    return b;
}

bool grating_fit_blaze(const struct grating *g, struct blaze *out, struct err *e)
{
    const struct blaze up = best_sigma(g, 1), down = best_sigma(g, -1);
    const struct blaze b = up.held_out < down.held_out ? up : down;
    if (!(b.contrast > 0) || b.held_out > 0.2)
        return err_set(e, ERR_DATA,
                       "the lines are no blaze: the best one leaves %.0f %% unexplained",
                       100 * b.held_out);
    *out = b;
    return true;
}

// A period's transform and back, by the definition: N is small. wheel[k] = exp(2 pi i k / N).
static void forward(const double complex *wheel, const double *x, double complex *f)
{
    for (int m = 0; m <= N / 2; m++) {
        f[m] = 0;
        for (int k = 0; k < N; k++)
            f[m] += x[k] / N * conj(wheel[m * k % N]);
    }
}
static void backward(const double complex *wheel, const double complex *f, double *x)
{
    for (int k = 0; k < N; k++) {
        double sum = creal(f[0]) + creal(f[N / 2]) * (k % 2 ? -1 : 1);
        for (int m = 1; m < N / 2; m++)
            sum +=
                2 * (creal(f[m]) * creal(wheel[m * k % N]) - cimag(f[m]) * cimag(wheel[m * k % N]));
        x[k] = sum;
    }
}

void grating_profile(const struct grating *g, double out[GRATING_SAMPLES])
{
    for (int k = 0; k < N; k++) {
        out[k] = creal(g->f[0]);
        for (int m = 1; m <= g->harmonics; m++)
            out[k] += 2 * creal(g->f[m] * cexp(2 * M_PI * I * m * k / N));
    }
}

// min over u, c of sum |H_m U_m - F_m|^2 / sigma^2 + lambda sum |du - c|, by ADMM on z = du - c.
static double solve(const struct grating *g, double sigma_px, double lambda, double u[N])
{
    enum { ROUNDS = 400 };
    double z[N] = {0}, dual[N] = {0}, t[N];
    double complex U[N / 2 + 1] = {g->f[0]}, T[N / 2 + 1], wheel[N];
    const double s2 = g->f_sigma * g->f_sigma, rho = 30 * lambda; // steps settle at 1/30 of a jump
    for (int k = 0; k < N; k++)
        wheel[k] = cexp(2 * M_PI * I * k / N);
    for (int round = 0; round < ROUNDS; round++) {
        for (int k = 0; k < N; k++)
            t[k] = z[k] - dual[k];
        forward(wheel, t, T);
        for (int m = 1; m <= N / 2; m++) {
            const double complex d = wheel[m] - 1; // of u[k + 1] - u[k]
            const bool seen = m <= g->harmonics;
            const double h = seen ? transfer(g, m, sigma_px) : 0;
            U[m] = ((seen ? h * g->f[m] / s2 : 0) + rho * N * conj(d) * T[m] / 2) /
                   (h * h / s2 + rho * N * pow(cabs(d), 2) / 2);
        }
        backward(wheel, U, u);
        double c = 0; // of du - c = z - dual, the mean of du being 0
        for (int k = 0; k < N; k++)
            c -= t[k] / N;
        for (int k = 0; k < N; k++) {
            const double v = u[(k + 1) % N] - u[k] - c + dual[k], cut = lambda / rho;
            z[k] = v > cut ? v - cut : v < -cut ? v + cut : 0;
            dual[k] = v - z[k];
        }
    }
    double chi2 = 0;
    for (int m = 1; m <= g->harmonics; m++)
        chi2 += pow(cabs(transfer(g, m, sigma_px) * U[m] - g->f[m]), 2) / s2;
    return chi2;
}

void grating_sharpen(const struct grating *g, double sigma_px, double out[GRATING_SAMPLES])
{
    // The strongest prior that still explains the harmonics to their noise (two parts each).
    double lo = log(1e-3), hi = log(1e9);
    for (int round = 0; round < 14; round++) {
        const double mid = 0.5 * (lo + hi);
        *(solve(g, sigma_px, exp(mid), out) < 2 * g->harmonics ? &lo : &hi) = mid;
    }
    solve(g, sigma_px, exp(lo), out);
}

// Mean of t over t - box / 2 .. t + box / 2, t the phase behind the jump at 0.
static double saw_mean(double t, double box)
{
    const double over = fmax(t + 0.5 * box - 1, 0.5 * box - t); // what lies beyond the jump
    if (!(over > 0))
        return t;
    return t + (t > 0.5 ? -1 : 1) * over / box;
}

void grating_widen(double profile[GRATING_SAMPLES], double box)
{
    double sum[2 * N + 1] = {0}, out[N]; // the integral from sample -1/2 on, over two periods
    for (int k = 0; k < 2 * N; k++)
        sum[k + 1] = sum[k] + profile[k % N];
    for (int k = 0; k < N; k++) {
        const double half = 0.5 * fmax(1, box * N), from = k + 0.5 - half + N / 2,
                     to = from + 2 * half;
        double at[2];
        for (int q = 0; q < 2; q++) {
            const double x = q ? to : from;
            const int i = (int)x;
            at[q] = sum[i] + (x - i) * (sum[i + 1] - sum[i]);
        }
        out[(k + N / 2) % N] = (at[1] - at[0]) / (2 * half);
    }
    memcpy(profile, out, sizeof out);
}

void grating_affine(const double profile[GRATING_SAMPLES], const struct blaze *b, double height,
                    double box, double *gain, double *offset, double *rmse)
{
    double si = 0, sh = 0, ii = 0, ih = 0, hh = 0;
    for (int k = 0; k < N; k++) {
        const double phase = (double)k / N - b->jump,
                     t = saw_mean(phase - floor(phase), fmax(box, 1.0 / N));
        const double h = height * (b->rises > 0 ? t : 1 - t), i = profile[k];
        si += i / N;
        sh += h / N;
        ii += i * i / N;
        ih += i * h / N;
        hh += h * h / N;
    }
    *gain = (ih - si * sh) / (ii - si * si);
    *offset = si - sh / *gain;
    *rmse = sqrt(fmax(0, (hh - sh * sh) - *gain * (ih - si * sh))) / height;
}
