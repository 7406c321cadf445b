// exposure_noise.c - read noise and gain of linear frames, from the bracket alone.
//
// Two frames a (time ta) and b (tb) of the same light differ by d = b - rho a, rho = tb/ta, whose
// variance is gain x_b (1 + rho) + read (1 + rho^2). Medians of |d| by level give points, a
// weighted line through them the two numbers: edges that moved are outliers, not noise.
#include "calib/bracket.h"
#include "core/mem.h"
#include "core/sort.h"
#include "process/exposure.h"
#include <math.h>
#include <stdlib.h>

enum { BINS = 24, PER_BIN = 4096, PER_BIN_MIN = 50 };

struct bin {
    int n;
    float d[PER_BIN]; // |difference|
    double level;     // sum
};

// One bin of one pair: p gain + q read should be y, known to about y / sqrt(n).
struct point {
    double p, q, y, n;
};

static void add_pair(const struct hdr_frames *f, int a, int b, double top, struct bin *bin,
                     struct point *point, int *points)
{
    const size_t n = (size_t)f->w * (size_t)f->h * (size_t)f->nc;
    const double rho = f->time_s[b] / f->time_s[a], share = rho / (1 + rho);
    const size_t step = n / (BINS * PER_BIN * 4) + 1;
    for (int k = 0; k < BINS; k++)
        bin[k].n = 0, bin[k].level = 0;
    for (size_t k = 0; k < n; k += step) {
        const double xa = (double)f->px[a][k], xb = (double)f->px[b][k], x = share * (xa + xb);
        if (x < 0 || x > 0.9 * top || xb >= f->saturation)
            continue;
        struct bin *to = &bin[(int)(sqrt(x / top) * BINS)]; // evenly filled by noise, not by level
        if (to->n == PER_BIN)
            continue;
        to->d[to->n++] = (float)fabs(xb - rho * xa);
        to->level += x;
    }
    for (int k = 0; k < BINS; k++) {
        if (bin[k].n < PER_BIN_MIN)
            continue;
        sort_floats(bin[k].d, (size_t)bin[k].n);
        const double sigma = (double)bin[k].d[bin[k].n / 2] / 0.67449, y = sigma * sigma;
        point[(*points)++] =
            (struct point){bin[k].level / bin[k].n * (1 + rho), 1 + rho * rho, y, bin[k].n};
    }
}

// Weighted least squares, both >= 0. The weights come from the line of the round before: a point's
// own y would favour the points that happen to lie low.
static struct hdr_noise fit_line(const struct point *point, int n, double floor)
{
    struct hdr_noise fit = {.read = 1, .gain = 0};
    for (int round = 0; round < 6; round++) {
        double pp = 0, pq = 0, qq = 0, py = 0, qy = 0;
        for (int k = 0; k < n; k++) {
            const double model = point[k].p * fit.gain + point[k].q * fit.read;
            const double w = point[k].n / (model * model);
            pp += w * point[k].p * point[k].p;
            pq += w * point[k].p * point[k].q;
            qq += w * point[k].q * point[k].q;
            py += w * point[k].p * point[k].y;
            qy += w * point[k].q * point[k].y;
        }
        const double det = pp * qq - pq * pq;
        if (!(det > 1e-12 * pp * qq))
            return (struct hdr_noise){.read = qq > 0 ? fmax(qy / qq, floor) : floor};
        fit.gain = (py * qq - qy * pq) / det;
        fit.read = (qy * pp - py * pq) / det;
        if (fit.gain < 0)
            fit = (struct hdr_noise){.read = qy / qq};
        else if (fit.read < 0)
            fit = (struct hdr_noise){.gain = py / pp};
        fit.read = fmax(fit.read, floor);
    }
    return fit;
}

struct hdr_noise exposure_noise(const struct hdr_frames *f)
{
    double top = 0;
    const size_t n = (size_t)f->w * (size_t)f->h * (size_t)f->nc;
    for (int j = 0; j < f->n; j++)
        for (size_t k = 0; k < n; k++)
            top = fmax(top, (double)f->px[j][k]);
    top = fmin(top, f->saturation);

    struct bin *bin = xcalloc(BINS, sizeof *bin);
    struct point *point = xcalloc((size_t)f->n * BINS, sizeof *point);
    int points = 0;
    for (int j = 0; j < f->n; j++) { // each frame against the next shorter one, or its like
        int below = -1;
        for (int k = 0; k < f->n; k++)
            if ((f->time_s[k] < f->time_s[j] || (k < j && f->time_s[k] == f->time_s[j])) &&
                (below < 0 || f->time_s[k] > f->time_s[below]))
                below = k;
        if (below >= 0)
            add_pair(f, below, j, top, bin, point, &points);
    }
    const double floor = fmax(1e-14 * top * top, 1e-30); // (1e-7 of the top)^2
    const struct hdr_noise noise = fit_line(point, points, floor);
    free(point);
    free(bin);
    return noise;
}
