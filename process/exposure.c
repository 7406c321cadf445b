// exposure.c - exposure times, drift and noise from the frames of a bracket themselves.
#include "process/exposure.h"
#include "calib/bracket.h"
#include "core/mem.h"
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

// Sums of both frames over the shared samples of one row. A sample is chosen by the sum of the two:
// given the sum, the split of photons between them is binomial, so the choice has no bias.
struct split {
    double a, b;
    long n;
};

static struct split split_row(const struct hdr_frames *f, int short_at, int long_at, int row,
                              double top)
{
    const size_t m = (size_t)f->w * (size_t)f->nc, from = (size_t)row * m;
    const float *a = f->px[short_at] + from, *b = f->px[long_at] + from;
    const double share = f->time_s[long_at] / (f->time_s[long_at] + f->time_s[short_at]);
    struct split s = {0};
    for (size_t k = 0; k < m; k++) {
        const double both = (double)a[k] + (double)b[k], expected = share * both;
        if (expected > 0.1 * top && expected < 0.85 * top && (double)b[k] < f->saturation) {
            s.a += (double)a[k];
            s.b += (double)b[k];
            s.n++;
        }
    }
    return s;
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
    for (int k = 1; k < f->n; k++) {
#pragma omp parallel for schedule(static)
        for (int j = 0; j < f->h; j++)
            row[j] = split_row(f, at[k - 1], at[k], j, top);
        struct split all = {0};
        for (int j = 0; j < f->h; j++) {
            all.a += row[j].a;
            all.b += row[j].b;
            all.n += row[j].n;
        }
        if (all.n >= SHARED_MIN && all.a > 0)
            ratio[k] = log(all.b / all.a * f->time_s[at[k - 1]] / f->time_s[at[k]]);
        else
            ++*unlinked;
    }
    chain(ratio, at, f->n, log_scale);
    free(row);
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
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
        qsort(d, (size_t)n, sizeof *d, ascending);
        ratio[k] = d[n / 2] - log(b->time_s[at[k]] / b->time_s[at[k - 1]]);
        --*unlinked;
    }
    chain(ratio, at, b->n, log_scale);
    free(d);
    bracket_pixels_finish(&px);
}
