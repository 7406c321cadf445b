// lut_exponent.c - the wavelength exponent of a sample, from photographs of it through two filters.
//
// At the same h / l both see the same orders: Lb(h) = (la / lb)^e La(h la / lb). The light of the
// diffracted orders, summed, gives the ratio: sums do not mind a centre that is off by a fraction
// of a pixel. Order 0 stays out, because a mirror has its own exponent (2) whatever the orders do.
#define _GNU_SOURCE
#include "core/mem.h"
#include "process/lp_source.h"
#include "process/lut.h"
#include <math.h>
#include <stdlib.h>

enum { SECTORS = 24 }; // parts of the circle, for the uncertainty

// The radius, px, at which the lobe around the centre has fallen to nothing beside the orders: four
// times its half width (2^-16 for a Gaussian).
static double lobe_radius(const struct lut_pattern *p)
{
    const int cx = (int)lround(p->cx), cy = (int)lround(p->cy);
    const int most = p->w > p->h ? p->w : p->h;
    double level = 0;
    for (int r = 0; r < most; r++) { // mean over the square of half side r
        double sum = 0;
        long n = 0;
        for (int j = cy - r; j <= cy + r; j++)
            for (int i = cx - r; i <= cx + r; i += (j == cy - r || j == cy + r || !r) ? 1 : 2 * r)
                if (i >= 0 && j >= 0 && i < p->w && j < p->h) {
                    sum += p->px[(size_t)j * (size_t)p->w + (size_t)i];
                    n++;
                }
        const double mean = n ? sum / (double)n : 0;
        level = fmax(level, mean);
        if (mean < 0.5 * level)
            return 4 * fmax(r, 1);
    }
    return most;
}

struct sums {
    double a[SECTORS], b[SECTORS];
};

// Light of b, and of a at the same h / l, where both see something and a sees more than `floor`.
static void add_up(const struct lut_pattern *a, const struct lp_source *source, double scale,
                   const struct lut_pattern *b, double inner, double floor, struct sums *s)
{
    for (int j = 0; j < b->h; j++)
        for (int i = 0; i < b->w; i++) {
            const double x = i - b->cx, y = j - b->cy;
            const double ax = x * scale, ay = y * scale; // px of a from its centre
            const double px = a->cx + ax, py = a->cy + ay;
            if (hypot(x, y) < inner || px < 0 || py < 0 || px > a->w - 1 || py > a->h - 1)
                continue;
            const size_t at = (size_t)j * (size_t)b->w + (size_t)i;
            const size_t from = (size_t)lround(py) * (size_t)a->w + (size_t)lround(px);
            if ((a->seen && !a->seen[from]) || (b->seen && !b->seen[at]) || a->px[from] < floor)
                continue;
            const int q = (int)((atan2(y, x) + M_PI) / (2 * M_PI) * SECTORS) % SECTORS;
            s->a[q] += lp_source_at(source, ax, ay);
            s->b[q] += b->px[at];
        }
}

// 3 % of the brightest pixel outside order 0.
static double signal_floor(const struct lut_pattern *p, double inner)
{
    float top = 0;
    for (int j = 0; j < p->h; j++)
        for (int i = 0; i < p->w; i++)
            if (hypot(i - p->cx, j - p->cy) >= inner)
                top = fmaxf(top, p->px[(size_t)j * (size_t)p->w + (size_t)i]);
    return 0.03 * (double)top;
}

bool lut_exponent(const struct lut_pattern *a, double lambda_a_m, const struct lut_pattern *b,
                  double lambda_b_m, double *exponent, double *sigma, struct err *e)
{
    const double ln_ratio = log(lambda_a_m / lambda_b_m);
    if (!(fabs(ln_ratio) >= 0.03))
        return err_set(e, ERR_DATA,
                       "%g and %g nm are too close for an exponent: need 3 %% between them",
                       lambda_a_m * 1e9, lambda_b_m * 1e9);
    struct lp_source source;
    const struct lp_picture picture = {a->px, a->w, a->h, a->cx, a->cy, NULL};
    if (!lp_source_init(&source, &picture, e))
        return false;
    // h la / lb in pixels of a, per pixel of b
    const double scale = exp(ln_ratio) * b->h_per_px / a->h_per_px;
    const double inner = fmax(lobe_radius(b), lobe_radius(a) / scale);
    struct sums s = {0};
    add_up(a, &source, scale, b, inner, signal_floor(a, inner * scale), &s);
    lp_source_finish(&source);

    double sum_a = 0, sum_b = 0;
    for (int q = 0; q < SECTORS; q++) {
        sum_a += s.a[q];
        sum_b += s.b[q];
    }
    if (!(sum_a > 0 && sum_b > 0))
        return err_set(e, ERR_DATA,
                       "no diffracted orders that both patterns show: the exponent "
                       "cannot be told, give 2 or 4");
    const double whole = log(sum_b / sum_a) / ln_ratio;
    double spread = 0; // jackknife: leave out one sector after the other
    for (int q = 0; q < SECTORS; q++) {
        const double without = log((sum_b - s.b[q]) / (sum_a - s.a[q])) / ln_ratio;
        spread += isfinite(without) ? (without - whole) * (without - whole) : INFINITY;
    }
    *sigma = sqrt(spread * (SECTORS - 1) / SECTORS);
    *exponent = whole;
    if (!(*sigma < 1))
        return err_set(e, ERR_DATA,
                       "the patterns do not tell the exponent: %.2f +- %.2f, give 2 "
                       "or 4",
                       whole, *sigma);
    return true;
}
