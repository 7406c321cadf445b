// periods.c - peaks of the spectrum, climbed to their tops.
#define _GNU_SOURCE
#include "process/periods.h"
#include "core/mem.h"
#include "core/sort.h"
#include "process/fft.h"
#include <complex.h>
#include <math.h>
#include <stdlib.h>

struct field {
    int nx, ny;
    float *z;      // [ny][nx] less its mean, under a Hann window
    double weight; // sum of the window
};

static double hann(int i, int n)
{
    const double s = sin(M_PI * (i + 0.5) / n);
    return s * s;
}

static bool field_init(struct field *f, const struct hfield *hf, struct err *e)
{
    const size_t n = (size_t)hf->nx * (size_t)hf->ny;
    *f = (struct field){
        .nx = hf->nx, .ny = hf->ny, .z = sample_alloc(n, sizeof(float), "spectrum", e)};
    if (!f->z)
        return false;
    double sum = 0;
    long count = 0;
    for (size_t k = 0; k < n; k++)
        if (!isnan(hf->z[k])) {
            sum += (double)hf->z[k];
            count++;
        }
    const double mean = count ? sum / (double)count : 0;
    for (int j = 0; j < hf->ny; j++)
        for (int i = 0; i < hf->nx; i++) {
            const size_t k = (size_t)j * (size_t)hf->nx + (size_t)i;
            const double w = hann(i, hf->nx) * hann(j, hf->ny);
            f->weight += w;
            f->z[k] = isnan(hf->z[k]) ? 0 : (float)(w * ((double)hf->z[k] - mean));
        }
    return true;
}

// |sum z exp(-i 2 pi (p x + q y))|^2 at any frequency, in cycles per node; rows in order.
static double power_at(const struct field *f, double p, double q)
{
    double complex *part = xcalloc((size_t)f->ny, sizeof *part);
    const double complex step = cexp(-2 * M_PI * I * p);
#pragma omp parallel for schedule(static)
    for (int j = 0; j < f->ny; j++) {
        const float *z = f->z + (size_t)j * (size_t)f->nx;
        double complex turn = cexp(-2 * M_PI * I * (q * j)), sum = 0;
        for (int i = 0; i < f->nx; i++, turn *= step)
            sum += (double)z[i] * turn;
        part[j] = sum;
    }
    double complex all = 0;
    for (int j = 0; j < f->ny; j++)
        all += part[j];
    free(part);
    return creal(all) * creal(all) + cimag(all) * cimag(all);
}

// Climbs by a shrinking cross of steps; the peak under a Hann window is round and 2 bins wide.
static double climb(const struct field *f, double *p, double *q)
{
    double best = power_at(f, *p, *q), sp = 0.5 / f->nx, sq = 0.5 / f->ny;
    for (int round = 0; round < 60 && sp > 1e-6 / f->nx; round++) {
        bool moved = false;
        const double try[4][2] = {{sp, 0}, {-sp, 0}, {0, sq}, {0, -sq}};
        for (int k = 0; k < 4; k++) {
            const double here = power_at(f, *p + try[k][0], *q + try[k][1]);
            if (here > best) {
                best = here;
                *p += try[k][0];
                *q += try[k][1];
                moved = true;
                break;
            }
        }
        if (!moved) {
            sp /= 2;
            sq /= 2;
        }
    }
    return best;
}

struct spectrum2 {
    int nx, ny, half; // half = nx/2 + 1 columns
    float *power;     // [ny][half]
    float median;
};

static bool spectrum2_init(struct spectrum2 *s, const struct field *f, struct err *e)
{
    *s = (struct spectrum2){.nx = f->nx, .ny = f->ny, .half = f->nx / 2 + 1};
    const size_t n = (size_t)s->half * (size_t)s->ny;
    struct fft *plan = fft_new(FFT_R2C, FFT_FLOAT, f->ny, f->nx, 1, false, e);
    float *c = sample_alloc(2 * n, sizeof *c, "spectrum", e),
          *sorted = sample_alloc(n, sizeof *sorted, "spectrum", e);
    s->power = sample_alloc(n, sizeof *s->power, "spectrum", e);
    const bool ok = plan && c && sorted && s->power;
    if (ok) {
        fft_run(plan, f->z, c);
        for (size_t k = 0; k < n; k++)
            sorted[k] = s->power[k] = c[2 * k] * c[2 * k] + c[2 * k + 1] * c[2 * k + 1];
        sort_floats(sorted, n);
        s->median = sorted[n / 2];
    } else {
        free(s->power);
    }
    fft_free(plan);
    free(c);
    free(sorted);
    return ok;
}

static float power_of(const struct spectrum2 *s, int i, int row)
{
    const int sign = i < 0 || i >= s->half ? -1 : 1; // a real field: P(-k) = P(k)
    i = ((sign * i) % s->nx + s->nx) % s->nx;
    row = ((sign * row) % s->ny + s->ny) % s->ny;
    return s->power[(size_t)row * (size_t)s->half + (size_t)i];
}

// No slope of a stronger one, as a scan's bow makes them.
static bool is_peak(const struct spectrum2 *s, int i, int row)
{
    const float here = power_of(s, i, row);
    for (int q = -1; q <= 1; q++)
        for (int p = -1; p <= 1; p++)
            if (power_of(s, i + p, row + q) > here)
                return false;
    return true;
}

// The strongest peak more than 2.5 bins from zero, and not within 20 degrees of `other` (NULL:
// any).
static bool strongest(const struct spectrum2 *s, const struct hfield *hf,
                      const struct period *other, float least, double *p, double *q)
{
    float best = fmaxf(36 * s->median, least);
    bool found = false;
    for (int j = 0; j < s->ny; j++)
        for (int i = 0; i < s->half; i++) {
            const int row = j <= s->ny / 2 ? j : j - s->ny;
            const float power = s->power[(size_t)j * (size_t)s->half + (size_t)i];
            if (power <= best || hypot(i, row) < 2.5 || !is_peak(s, i, row))
                continue;
            const double fx = i / (s->nx * hf->dx_m), fy = row / (s->ny * hf->dy_m);
            if (other && fabs(remainder(atan2(fy, fx) - other->direction_rad, M_PI)) < M_PI / 9)
                continue;
            best = power;
            *p = (double)i / s->nx;
            *q = (double)row / s->ny;
            found = true;
        }
    return found;
}

static struct period measure(const struct field *f, const struct hfield *hf, double p, double q)
{
    const double power = climb(f, &p, &q), fx = p / hf->dx_m, fy = q / hf->dy_m;
    double direction = atan2(fy, fx);
    if (direction > M_PI / 2)
        direction -= M_PI;
    if (direction <= -M_PI / 2)
        direction += M_PI;
    return (struct period){1 / hypot(fx, fy), direction, 2 * sqrt(power) / f->weight};
}

int hfield_periods(const struct hfield *hf, struct period out[2], struct err *e)
{
    struct field f;
    struct spectrum2 s;
    if (!field_init(&f, hf, e))
        return -1;
    if (!spectrum2_init(&s, &f, e)) {
        free(f.z);
        return -1;
    }
    double p = 0, q = 0;
    int n = 0;
    float least = 0;
    while (n < 2 && strongest(&s, hf, n ? &out[0] : NULL, least, &p, &q)) {
        out[n] = measure(&f, hf, p, q);
        const double part = 0.02 * out[n++].amplitude_m * f.weight / 2;
        least = (float)(part * part);
    }
    if (n == 2 && fabs(out[1].direction_rad) < fabs(out[0].direction_rad)) {
        const struct period swap = out[0];
        out[0] = out[1];
        out[1] = swap;
    }
    free(s.power);
    free(f.z);
    return n;
}
