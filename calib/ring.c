// ring.c - the first-order ring of a known grating.
//
// The picture is cut into sectors, so that a ring, a pair of spots and a crossed grating are one
// case; in each the radial profile's peak has a centroid, and where they disagree the uncertainty
// says so.
#define _GNU_SOURCE
#include "calib/passband.h"
#include "core/mem.h"
#include "core/sort.h"
#include <math.h>
#include <stdlib.h>

enum { SECTORS = 36, BINS = 600 };
static const double below = 0.72, above = 1.38;

// Radial profiles of the sectors between two radii.
struct rings {
    double from, step;
    int bins;
    double sum[SECTORS][BINS];
    int n[SECTORS][BINS];
};

struct peak {
    double lo, hi, floor;  // its radii; floor is the light beside it
    double energy, moment; // of its pixels above the floor, and times their radius
};

// The median change of h from pixel to pixel along rows.
static double pixel_step(const float *u, const float *v, size_t n)
{
    enum { PROBES = 2001 };
    double step[PROBES];
    size_t m = 0;
    for (size_t k = 0; k + 1 < n && m < PROBES; k += n / PROBES + 1) {
        const double far = hypot((double)(u[k + 1] - u[k]), (double)(v[k + 1] - v[k]));
        if (isfinite(far))
            step[m++] = far;
    }
    sort_doubles(step, m);
    return m ? step[m / 2] : 0;
}

static int sector_of(double u, double v)
{
    return (int)floor((atan2(v, u) + M_PI) / (2 * M_PI) * SECTORS + 0.5) % SECTORS;
}

// Mean of the pixels of a bin; where it has none, of its nearest neighbours. NAN: none within 7.
static double level(const struct rings *r, int sector, int k)
{
    double sum = 0;
    int n = 0;
    for (int reach = 0; !n && reach < 8; reach++)
        for (int q = k - reach; q <= k + reach; q++)
            if (q >= 0 && q < r->bins) {
                sum += r->sum[sector][q];
                n += r->n[sector][q];
            }
    return n ? sum / n : NAN;
}

// The highest peak of a sector's profile whose flanks are seen; hi 0: none.
static struct peak find_peak(const struct rings *r, int sector)
{
    double v[BINS], sorted[BINS];
    size_t m = 0;
    int top = -1;
    const struct peak none = {0};
    for (int k = 0; k < r->bins; k++) {
        v[k] = level(r, sector, k);
        if (isnan(v[k]))
            continue;
        sorted[m++] = v[k];
        if (top < 0 || v[k] > v[top])
            top = k;
    }
    if (m < (size_t)r->bins / 2)
        return none;
    sort_doubles(sorted, m);
    const double floor = sorted[m / 4], spread = sorted[m / 2] - sorted[m / 10];
    const double height = v[top] - floor;
    if (!(height > 6 * spread) || !(height > 0))
        return none;
    int lo = top, hi = top;
    while (lo > 0 && v[lo - 1] > floor + 0.25 * height)
        lo--;
    while (hi < r->bins - 1 && v[hi + 1] > floor + 0.25 * height)
        hi++;
    const int flank = (hi - lo) / 2 + 1;
    if (lo < flank || hi > r->bins - 1 - flank)
        return none;
    return (struct peak){r->from + (lo - flank) * r->step, r->from + (hi + 1 + flank) * r->step,
                         floor, 0, 0};
}

static void gather(struct rings *r, const float *px, const float *u, const float *v, size_t n,
                   double *reach)
{
    for (size_t k = 0; k < n; k++) {
        const double far = hypot((double)u[k], (double)v[k]);
        if (!isfinite(far) || !isfinite((double)px[k]))
            continue;
        *reach = fmax(*reach, far);
        const double bin = floor((far - r->from) / r->step);
        if (bin >= 0 && bin < r->bins) {
            const int s = sector_of((double)u[k], (double)v[k]);
            r->sum[s][(int)bin] += (double)px[k];
            r->n[s][(int)bin]++;
        }
    }
}

static void weigh(struct peak peak[SECTORS], const float *px, const float *u, const float *v,
                  size_t n)
{
    for (size_t k = 0; k < n; k++) {
        const double far = hypot((double)u[k], (double)v[k]);
        if (!isfinite(far) || !isfinite((double)px[k]))
            continue;
        struct peak *p = &peak[sector_of((double)u[k], (double)v[k])];
        if (far >= p->lo && far < p->hi) {
            p->energy += (double)px[k] - p->floor;
            p->moment += far * ((double)px[k] - p->floor);
        }
    }
}

bool ring_find(struct ring *out, const float *px, const float *u, const float *v, int w, int h,
               double lines_per_m, double expected_m, struct err *e)
{
    const size_t n = (size_t)w * (size_t)h;
    const double from = below * expected_m * lines_per_m, to = above * expected_m * lines_per_m;
    const double pixels = (to - from) / fmax(1e-12, pixel_step(u, v, n));
    struct rings *r = sample_alloc(1, sizeof *r, "profiles", e);
    struct peak peak[SECTORS];
    double reach = 0, strongest = 0, sum = 0, moment = 0, square = 0, share2 = 0;
    if (!r)
        return false;
    r->from = from;
    r->bins = (int)fmin(BINS, fmax(20, pixels));
    r->step = (to - from) / r->bins;
    gather(r, px, u, v, n, &reach);
    for (int s = 0; s < SECTORS; s++)
        peak[s] = find_peak(r, s);
    free(r);
    weigh(peak, px, u, v, n);
    for (int s = 0; s < SECTORS; s++)
        strongest = fmax(strongest, peak[s].energy);
    *out = (struct ring){0};
    for (int s = 0; s < SECTORS; s++) {
        const struct peak *p = &peak[s];
        if (!(p->energy > 0.1 * strongest))
            continue;
        const double at = p->moment / p->energy / lines_per_m;
        out->sectors++;
        sum += p->energy;
        share2 += p->energy * p->energy;
        moment += p->energy * at;
        square += p->energy * at * at;
    }
    if (!out->sectors)
        return err_set(
            e, ERR_DATA,
            "no first-order ring of %.4g lines/mm stands out between |h| = %.3f and %.3f "
            "(the picture shows |h| up to %.3f)",
            lines_per_m * 1e-3, from, to, reach);
    out->lambda_m = moment / sum;
    const double spread2 = fmax(0, square / sum - out->lambda_m * out->lambda_m);
    // lines and the scale of h are known to 0.1 %
    out->sigma_m = hypot(sqrt(spread2 * share2) / sum, 1e-3 * out->lambda_m);
    return true;
}
