// exposure.c - exposure times, drift and noise from the frames of a bracket themselves.
#include "process/exposure.h"
#include "calib/bracket.h"
#include "core/mem.h"
#include "core/sort.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SHARED_MIN = 100 };

double exposure_snap(double nominal_s)
{
    double best = nominal_s, off = log(1.09);
    if (!(nominal_s > 0) || nominal_s > 32)
        return nominal_s;
    for (int steps = 3; steps >= 2; steps--) { // thirds first: more cameras keep to them
        const double stop = exp2(round(log2(nominal_s) * steps) / steps);
        const double d = fabs(log(nominal_s / stop));
        if (d < off - 0.02) { // halves must be clearly nearer
            best = stop;
            off = d;
        }
    }
    return best;
}

bool exposure_same(const double *time_s, int n, int *a, int *b)
{
    for (*a = 0; *a < n; ++*a)
        for (*b = *a + 1; *b < n; ++*b)
            if (fabs(log(time_s[*a] / time_s[*b])) < 0.01)
                return true;
    return false;
}

// Frames by rising time.
static void order(const double *time_s, int n, int *at)
{
    for (int j = 0; j < n; j++) {
        int k = j;
        for (; k > 0 && time_s[at[k - 1]] > time_s[j]; k--)
            at[k] = at[k - 1];
        at[k] = j;
    }
}

// ratio[k]: log of the measured over the nominal ratio of the frames at[k] and at[k - 1].
static void chain(const double *ratio, const int *at, int n, double *log_scale)
{
    double sum = 0, mean = 0;
    for (int k = 0; k < n; k++) {
        sum += k ? ratio[k] : 0;
        log_scale[at[k]] = sum;
        mean += sum / n;
    }
    for (int k = 0; k < n; k++)
        log_scale[k] -= mean;
}

// Sums over the shared samples of one row, b of the longer frame and s = a + b of both. A sample is
// chosen by s: given s, the split of photons between the frames is binomial, so the choice has no
// bias. Samples that disagree by more than noise and `slack` (blooming, something that moved) are
// left out.
struct split {
    double n, b, s, b_over_s, one_over_s;
};

enum { SIGMAS = 6 };

static struct split split_row(const struct hdr_frames *f, int short_at, int long_at, int row,
                              double top, double ratio, double slack)
{
    const size_t m = (size_t)f->w * (size_t)f->nc, from = (size_t)row * m;
    const float *a = f->px[short_at] + from, *b = f->px[long_at] + from;
    const double share = ratio / (1 + ratio);
    struct split sum = {0};
    for (size_t k = 0; k < m; k++) {
        const double xa = (double)a[k], xb = (double)b[k], s = xa + xb, expected = share * s;
        const double variance =
            (1 + ratio) * f->noise.gain * expected + (1 + ratio * ratio) * f->noise.read;
        const double off = fabs(xb - ratio * xa) - slack * expected;
        if (expected > 0.1 * top && expected < 0.85 * top && xb < f->saturation &&
            (off <= 0 || off * off <= SIGMAS * SIGMAS * variance)) {
            sum.n++;
            sum.b += xb;
            sum.s += s;
            sum.b_over_s += xb / s;
            sum.one_over_s += 1 / s;
        }
    }
    return sum;
}

// b = share * s + offset by least squares, weights 1 / s as photons have it. The offset is what the
// black levels are wrong by: known to be 0 within a quarter of the read noise.
static double share_of(const struct split *all, const struct hdr_frames *f, double ratio,
                       double *sigma)
{
    const double share = ratio / (1 + ratio), mean = all->s / all->n;
    const double per_s =
        share * (1 - share) * f->noise.gain + f->noise.read / mean; // variance of b
    const double prior = per_s / (f->noise.read / 16);
    const double corner = all->one_over_s + prior;
    const double det = all->s * corner - all->n * all->n;
    *sigma = sqrt(per_s * corner / det);
    return (all->b * corner - all->n * all->b_over_s) / det;
}

// The measured ratio of two frames' exposures, log of it over the nominal one; false: too little.
static bool measure_ratio(const struct hdr_frames *f, int short_at, int long_at, double top,
                          struct split *row, double *log_ratio)
{
    static const double slack[] = {0.3, 0.03, 0}; // the light may have drifted by so much at first
    const double nominal = f->time_s[long_at] / f->time_s[short_at];
    double ratio = nominal, sigma = 0;
    for (int round = 0; round < 3; round++) {
        struct split all = {0};
#pragma omp parallel for schedule(static)
        for (int j = 0; j < f->h; j++)
            row[j] = split_row(f, short_at, long_at, j, top, ratio, slack[round]);
        for (int j = 0; j < f->h; j++) {
            all.n += row[j].n;
            all.b += row[j].b;
            all.s += row[j].s;
            all.b_over_s += row[j].b_over_s;
            all.one_over_s += row[j].one_over_s;
        }
        if (all.n < SHARED_MIN)
            return false;
        const double share = share_of(&all, f, ratio, &sigma);
        if (!(share > 0.01 && share < 0.999))
            return false;
        ratio = share / (1 - share);
        sigma /= share * (1 - share); // of ln ratio
    }
    // What is no more than its own error is dropped, the rest hardly touched (James & Stein).
    const double z = log(ratio / nominal) / sigma;
    *log_ratio = log(ratio / nominal) * fmax(0, 1 - 1 / fmax(z * z, 1e-12));
    return true;
}

static double largest(const struct hdr_frames *f)
{
    const size_t n = (size_t)f->w * (size_t)f->h * (size_t)f->nc;
    float top = 0;
    for (int j = 0; j < f->n; j++)
        for (size_t k = 0; k < n; k++)
            top = f->px[j][k] > top ? f->px[j][k] : top;
    return (double)top;
}

void exposure_drift(const struct hdr_frames *f, double *log_scale, int *unlinked)
{
    int at[BRACKET_MAX];
    double ratio[BRACKET_MAX] = {0};
    const double top = isfinite(f->saturation) ? f->saturation : largest(f);
    struct split *row = xcalloc((size_t)f->h, sizeof *row);
    order(f->time_s, f->n, at);
    *unlinked = 0;
    for (int k = 1; k < f->n; k++)
        if (!measure_ratio(f, at[k - 1], at[k], top, row, &ratio[k]))
            ++*unlinked;
    chain(ratio, at, f->n, log_scale);
    free(row);
}

void exposure_drift_codes(const struct bracket *b, const struct response *r, double *log_scale,
                          int *unlinked)
{
    int at[BRACKET_MAX];
    double ratio[BRACKET_MAX] = {0};
    struct bracket_pixels px;
    struct err ignored;
    *unlinked = b->n - 1;
    memset(log_scale, 0, (size_t)b->n * sizeof *log_scale);
    if (!bracket_pick(&px, b, r, &ignored))
        return;
    double *d = xcalloc((size_t)px.count * (size_t)px.nc, sizeof *d);
    order(b->time_s, b->n, at);
    for (int k = 1; k < b->n; k++) {
        int n = 0;
        for (int i = 0; i < px.count; i++)
            for (int c = 0; c < px.nc; c++) {
                const int za = bracket_codes(&px, i, c)[at[k - 1]];
                const int zb = bracket_codes(&px, i, c)[at[k]];
                // middle codes only: there noise moves ln X little and alike in both directions
                if (za >= 24 && zb <= 230)
                    d[n++] = r->log_x[c][zb] - r->log_x[c][za];
            }
        if (n < SHARED_MIN)
            continue;
        sort_doubles(d, (size_t)n);
        ratio[k] = d[n / 2] - log(b->time_s[at[k]] / b->time_s[at[k - 1]]);
        --*unlinked;
    }
    chain(ratio, at, b->n, log_scale);
    free(d);
    bracket_pixels_finish(&px);
}
