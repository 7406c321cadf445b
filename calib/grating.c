// grating.c - finding the lines of a grating and their mean profile.
#define _GNU_SOURCE // M_PI
#include "calib/grating.h"
#include "calib/normal.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BINS = 1024, TILE = 16 };
static const double EDGE = 0.93; // share of the radius that is used: the rim is blurred

// Mean direction of the gradient in the disc, an angle without sign (structure tensor).
static double gradient_angle(const struct disc *d, const float *flat, int w, int h)
{
    double xx = 0, xy = 0, yy = 0;
    for (int j = 1; j < h - 1; j++)
        for (int i = 1; i < w - 1; i++) {
            if (hypot(i - d->cx_px, j - d->cy_px) > 0.9 * d->radius_px)
                continue;
            const float *p = flat + (size_t)j * (size_t)w + (size_t)i;
            const double gx = (double)p[1] - (double)p[-1], gy = (double)p[w] - (double)p[-w];
            xx += gx * gx;
            xy += gx * gy;
            yy += gy * gy;
        }
    return 0.5 * atan2(2 * xy, xx - yy);
}

// The strongest frequency of the picture summed along the lines, in cycles per px; lowest that is
// looked for: 2 lines in the disc.
static double coarse_frequency(const struct disc *d, const float *flat, int w, int h, double angle)
{
    const int half = (int)d->radius_px, n = 2 * half + 1;
    const double ux = cos(angle), uy = sin(angle);
    double *sum = xcalloc((size_t)n, sizeof *sum), *count = xcalloc((size_t)n, sizeof *count);
    for (int j = 0; j < h; j++)
        for (int i = 0; i < w; i++) {
            const double x = i - d->cx_px, y = j - d->cy_px,
                         r = hypot(x, y) / (EDGE * d->radius_px);
            const int at = (int)lround(x * ux + y * uy) + half;
            if (r >= 1 || at < 0 || at >= n)
                continue;
            sum[at] += (double)flat[(size_t)j * (size_t)w + (size_t)i] - 1;
            count[at]++;
        }
    double best = 0, found = 0;
    for (int m = 0; m < 4 * half; m++) {
        const double k = 1 / d->radius_px + m / (8.0 * d->radius_px);
        double complex f = 0;
        if (k > 0.45)
            break;
        for (int s = 0; s < n; s++) {
            const double t = (s - half) / (EDGE * d->radius_px);
            if (count[s] > 0 && fabs(t) < 1)
                f += (1 - t * t) * (1 - t * t) * sum[s] / count[s] *
                     cexp(-2 * M_PI * I * k * (s - half));
        }
        if (cabs(f) > best) {
            best = cabs(f);
            found = k;
        }
    }
    free(sum);
    free(count);
    return found;
}

// Windowed transform at k of the pixels of one quadrant (-1: all), with its first and second
// derivatives in k.
struct peak {
    double complex f, fx, fy, fxx, fxy, fyy;
};

static struct peak transform(const struct disc *d, const float *flat, int w, int h, double kx,
                             double ky, int quadrant)
{
    struct peak p = {0};
    const double radius = EDGE * d->radius_px;
    for (int j = 0; j < h; j++) {
        const double y = j - d->cy_px;
        if (fabs(y) >= radius)
            continue;
        const double complex row = cexp(-2 * M_PI * I * ky * y), step = cexp(-2 * M_PI * I * kx);
        double complex turn = row * cexp(2 * M_PI * I * kx * d->cx_px);
        for (int i = 0; i < w; i++, turn *= step) {
            const double x = i - d->cx_px, r2 = (x * x + y * y) / (radius * radius);
            if (r2 >= 1 || (quadrant >= 0 && quadrant != (x > 0) + 2 * (y > 0)))
                continue;
            const double v =
                (1 - r2) * (1 - r2) * ((double)flat[(size_t)j * (size_t)w + (size_t)i] - 1);
            const double complex f = v * turn;
            p.f += f;
            p.fx += x * f;
            p.fy += y * f;
            p.fxx += x * x * f;
            p.fxy += x * y * f;
            p.fyy += y * y * f;
        }
    }
    p.fx *= -2 * M_PI * I;
    p.fy *= -2 * M_PI * I;
    p.fxx *= -4 * M_PI * M_PI;
    p.fxy *= -4 * M_PI * M_PI;
    p.fyy *= -4 * M_PI * M_PI;
    return p;
}

// Newton's steps to the maximum of |F(k)|^2, from within its main lobe.
static void refine(const struct disc *d, const float *flat, int w, int h, int quadrant, double *kx,
                   double *ky)
{
    const double lobe = 0.5 / d->radius_px;
    for (int round = 0; round < 8; round++) {
        const struct peak p = transform(d, flat, w, h, *kx, *ky, quadrant);
        const double gx = 2 * creal(conj(p.f) * p.fx), gy = 2 * creal(conj(p.f) * p.fy);
        const double xx = 2 * creal(conj(p.f) * p.fxx + conj(p.fx) * p.fx),
                     xy = 2 * creal(conj(p.f) * p.fxy + conj(p.fx) * p.fy),
                     yy = 2 * creal(conj(p.f) * p.fyy + conj(p.fy) * p.fy);
        const double det = xx * yy - xy * xy;
        double sx, sy;
        if (det > 0 && xx < 0) { // a maximum
            sx = -(yy * gx - xy * gy) / det;
            sy = -(xx * gy - xy * gx) / det;
        } else { // not yet near it: uphill
            const double norm = hypot(gx, gy) + 1e-300;
            sx = 0.5 * lobe * gx / norm;
            sy = 0.5 * lobe * gy / norm;
        }
        const double size = hypot(sx, sy), cut = size > lobe ? lobe / size : 1;
        *kx += cut * sx;
        *ky += cut * sy;
        if (size < 1e-10)
            break;
    }
}

void grating_climb(const struct disc *d, const float *flat, int w, int h, double *kx, double *ky)
{
    refine(d, flat, w, h, -1, kx, ky);
}

// Sums of the pixels by phase, for both halves of the checkerboard.
struct fold {
    double n[2][BINS], sum[2][BINS], phase[2][BINS], square;
};

static void fold_pixels(struct fold *f, const struct grating *g, const struct disc *d,
                        const float *flat, int w, int h)
{
    for (int j = 0; j < h; j++)
        for (int i = 0; i < w; i++) {
            const double x = i - d->cx_px, y = j - d->cy_px;
            if (hypot(x, y) > EDGE * d->radius_px)
                continue;
            const double turns = g->kx * x + g->ky * y, phase = turns - floor(turns);
            const int half = (i / TILE + j / TILE) % 2, b = (int)(phase * BINS) % BINS;
            const double v = (double)flat[(size_t)j * (size_t)w + (size_t)i];
            f->n[half][b]++;
            f->sum[half][b] += v;
            f->phase[half][b] += phase;
            f->square += v * v;
        }
}

// Harmonics by least squares (which: 0, 1 a half, 2 both): the phases need not be evenly filled.
static bool fit_harmonics(const struct fold *f, int which, int harmonics, double complex *out,
                          double *explained, double *count, struct err *e)
{
    const int n = 2 * harmonics + 1;
    struct normal s;
    int at[2 * GRATING_HARMONICS + 1];
    double x[2 * GRATING_HARMONICS + 1], c[2 * GRATING_HARMONICS + 1], b[2 * GRATING_HARMONICS + 1];
    normal_init(&s, n);
    *count = 0;
    for (int k = 0; k < n; k++)
        at[k] = k;
    for (int h = which == 1; h < (which == 0 ? 1 : 2); h++)
        for (int k = 0; k < BINS; k++) {
            if (f->n[h][k] == 0)
                continue;
            const double phase = 2 * M_PI * f->phase[h][k] / f->n[h][k];
            x[0] = 1;
            for (int m = 1; m <= harmonics; m++) {
                x[2 * m - 1] = 2 * cos(m * phase); // F e^(i m phase) + its conjugate
                x[2 * m] = -2 * sin(m * phase);
            }
            normal_add(&s, n, at, x, f->sum[h][k] / f->n[h][k], f->n[h][k]);
            *count += f->n[h][k];
        }
    memcpy(b, s.b, (size_t)n * sizeof *b);
    const bool ok = normal_solve(&s, c, NULL, e);
    normal_finish(&s);
    if (!ok)
        return false;
    *explained = 0;
    for (int k = 0; k < n; k++)
        *explained += c[k] * b[k];
    out[0] = c[0];
    for (int m = 1; m <= harmonics; m++)
        out[m] = c[2 * m - 1] + I * c[2 * m];
    return true;
}

bool grating_measure(struct grating *g, const struct disc *d, const float *flat, int w, int h,
                     struct err *e)
{
    struct fold *f = xcalloc(1, sizeof *f);
    double explained = 0, count = 1, part, half_count;
    fold_pixels(f, g, d, flat, w, h);
    const int resolved = (int)(0.45 / fmax(fabs(g->kx), fabs(g->ky)));
    g->harmonics = resolved < GRATING_HARMONICS ? resolved : GRATING_HARMONICS;
    const bool ok = fit_harmonics(f, 0, g->harmonics, g->half[0], &part, &half_count, e) &&
                    fit_harmonics(f, 1, g->harmonics, g->half[1], &part, &half_count, e) &&
                    fit_harmonics(f, 2, g->harmonics, g->f, &explained, &count, e);
    if (ok) {
        g->noise = sqrt(fmax(0, f->square - explained) / count);
        // neighbouring pixels share what is left over (flat field, dust): the halves tell
        double apart = 0;
        for (int m = 1; m <= g->harmonics; m++)
            apart += pow(cabs(g->half[0][m] - g->half[1][m]), 2);
        g->f_sigma = fmax(sqrt(apart / g->harmonics / 8), g->noise / sqrt(2 * count));
    }
    free(f);
    return ok;
}

bool grating_find(struct grating *out, const struct disc *d, const float *flat, int w, int h,
                  struct err *e)
{
    struct grating g = {0};
    const double angle = gradient_angle(d, flat, w, h);
    const double k = coarse_frequency(d, flat, w, h, angle);
    g.kx = k * cos(angle);
    g.ky = k * sin(angle);
    refine(d, flat, w, h, -1, &g.kx, &g.ky);
    g.lines = hypot(g.kx, g.ky) * 2 * d->radius_px;
    double sum = 0, squares = 0;
    for (int q = 0; q < 4; q++) {
        double kx = g.kx, ky = g.ky;
        refine(d, flat, w, h, q, &kx, &ky);
        const double off = hypot(kx, ky) - hypot(g.kx, g.ky);
        sum += off / 4;
        squares += off * off / 4;
    }
    g.k_sigma = sqrt(fmax(0, squares - sum * sum) / 3);
    if (!grating_measure(&g, d, flat, w, h, e))
        return err_in(e, "the lines' profile");
    const double contrast = 2 * cabs(g.f[1]);
    if (contrast < 0.01 || contrast < 10 * g.f_sigma)
        return err_set(e, ERR_DATA,
                       "no lines in the disc, or finer ones than the optics show: the strongest "
                       "pattern (%.1f lines) has a contrast of %.2g, its noise is %.1g",
                       g.lines, contrast, 2 * g.f_sigma);
    if (g.lines < 5)
        return err_set(
            e, ERR_DATA,
            "only %.1f lines in the disc of %.0f px (finer ones are lost in the optics): 5 or "
            "more are needed for a scale",
            g.lines, 2 * d->radius_px);
    if (g.harmonics < 2 || cabs(g.f[2]) < 5 * g.f_sigma)
        return err_set(
            e, ERR_DATA,
            "lines of %.1f px are at the limit of the optics: their second harmonic is %.1g "
            "of the first, so that blur and profile cannot be told apart",
            1 / hypot(g.kx, g.ky), g.harmonics < 2 ? 0 : cabs(g.f[2]) / cabs(g.f[1]));
    if (g.k_sigma > 0.02 * hypot(g.kx, g.ky))
        return err_set(e, ERR_DATA,
                       "the lines are not straight and even: the scale differs by %.1f %% "
                       "over the disc",
                       200 * g.k_sigma / hypot(g.kx, g.ky));
    *out = g;
    return true;
}
