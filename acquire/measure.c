// measure.c - sums over pixels, by bands of rows.
#include "acquire/measure.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BANDS = 16, BLOCK = 8, LEAST_PIXELS = 64, LEAST_BAND_PIXELS = 32 };
static const double WELL_FROM = 0.02, WELL_TO = 0.9; // of full scale
static const double SPILL_FROM = 0.95;
static const double BLACK_SIGMA = 1.5; // counts: drift of the black level

struct sums {
    double s, l, ss, sl, ll; // of the short and the long frame
    size_t n;
};

// Where the longer exposure saturates charge spills over: such blocks and those around them are
// left out. One hot pixel spills nothing. [h][w] of BLOCK x BLOCK pixels.
struct blocks {
    int w, h;
    bool *skip;
};

static struct blocks find_spill(const struct measure_frame *l)
{
    struct blocks b = {(l->w + BLOCK - 1) / BLOCK, (l->h + BLOCK - 1) / BLOCK, NULL};
    int *full = xcalloc((size_t)b.w * (size_t)b.h, sizeof *full);
    b.skip = xcalloc((size_t)b.w * (size_t)b.h, sizeof *b.skip);
    const int top = (int)(l->black + SPILL_FROM * (l->white - l->black));
    for (int j = 0; j < l->h; j++)
        for (int i = 0; i < l->w; i++)
            if (l->raw[(size_t)j * (size_t)l->w + (size_t)i] >= top)
                full[(size_t)(j / BLOCK) * (size_t)b.w + (size_t)(i / BLOCK)]++;
    for (int j = 0; j < b.h; j++)
        for (int i = 0; i < b.w; i++)
            for (int n = 0; n < 9; n++) {
                const int x = i + n % 3 - 1, y = j + n / 3 - 1;
                if (x >= 0 && y >= 0 && x < b.w && y < b.h)
                    b.skip[j * b.w + i] |= full[y * b.w + x] > 1;
            }
    free(full);
    return b;
}

static void add_row(struct sums *t, const uint16_t *s, const uint16_t *l, int w, const bool *skip,
                    double s_black, double l_black, double from, double to)
{
    for (int i = 0; i < w; i++) {
        const double x = s[i] - s_black, y = l[i] - l_black;
        if (skip[i / BLOCK])
            continue;
        if (x + y < from || y > to)
            continue;
        t->s += x;
        t->l += y;
        t->ss += x * x;
        t->sl += x * y;
        t->ll += y * y;
        t->n++;
    }
}

static void sum_up(const struct measure_frame *s, const struct measure_frame *l,
                   const struct blocks *spill, struct sums band[BANDS], struct sums *all)
{
    const double full = l->white - l->black;
    memset(band, 0, BANDS * sizeof *band);
    for (int j = 0; j < l->h; j++) {
        const size_t row = (size_t)j * (size_t)l->w;
        add_row(&band[(long)j * BANDS / l->h], s->raw + row, l->raw + row, l->w,
                spill->skip + (size_t)(j / BLOCK) * (size_t)spill->w, s->black, l->black,
                WELL_FROM * full, WELL_TO * full);
    }
    *all = (struct sums){0};
    for (int k = 0; k < BANDS; k++) {
        all->s += band[k].s;
        all->l += band[k].l;
        all->ss += band[k].ss;
        all->sl += band[k].sl;
        all->ll += band[k].ll;
        all->n += band[k].n;
    }
}

// Relative variance of s / l, from the scatter about that ratio and from the black level.
static double variance(const struct sums *t, double ratio)
{
    const double scatter = t->ss - 2 * ratio * t->sl + ratio * ratio * t->ll;
    const double n = (double)t->n, black = BLACK_SIGMA * n * (1 + ratio);
    return (fmax(scatter, 0) + black * black) / (t->s * t->s);
}

bool measure_ratio(const struct measure_frame *a, const struct measure_frame *b,
                   struct measure_ratio *out)
{
    if (a->w != b->w || a->h != b->h)
        return false;
    const bool a_short = a->exposure_ns <= b->exposure_ns;
    const struct measure_frame *s = a_short ? a : b, *l = a_short ? b : a;
    struct blocks spill = find_spill(l);
    struct sums band[BANDS], all;
    sum_up(s, l, &spill, band, &all);
    if (all.n < LEAST_PIXELS) { // saturated spots all over: better with what spills than not at all
        memset(spill.skip, 0, (size_t)spill.w * (size_t)spill.h);
        sum_up(s, l, &spill, band, &all);
    }
    free(spill.skip);
    if (all.n < LEAST_PIXELS)
        return false;
    // A short frame without any signal still says so: at least one count in all.
    if (all.s < 1)
        all.s = 1;
    const double ratio = all.s / all.l;
    const double scatter = all.ss - 2 * ratio * all.sl + ratio * ratio * all.ll;
    struct measure_ratio m = {
        .ratio = a_short ? ratio : 1 / ratio,
        .sigma = sqrt(variance(&all, ratio)),
        .worst = 1,
        .residual = sqrt(fmax(scatter, 0) / fmax(all.ss, 1)),
        .pixels = all.n,
    };
    double worst = 0;
    for (int k = 0; k < BANDS; k++) {
        const struct sums *t = &band[k];
        if (t->n < LEAST_BAND_PIXELS)
            continue;
        const double expect = ratio * t->l, off = t->s - expect;
        const double sigma =
            sqrt(variance(&(struct sums){expect, t->l, t->ss, t->sl, t->ll, t->n}, ratio));
        const double weight = fabs(off / expect) - 4 * sigma;
        if (weight > worst || !m.worst_last) {
            worst = weight;
            m.worst = t->s / expect;
            m.worst_sigma = sigma;
            m.worst_first = (int)(((long)k * a->h + BANDS - 1) / BANDS);
            m.worst_last = (int)(((long)(k + 1) * a->h + BANDS - 1) / BANDS) - 1;
        }
    }
    if (!a_short)
        m.worst = 1 / fmax(m.worst, 1e-6);
    *out = m;
    return true;
}

void measure_level(const struct measure_frame *f, struct measure_level *out)
{
    const size_t n = (size_t)f->w * (size_t)f->h;
    size_t *count = xcalloc(65536, sizeof *count), above = 0;
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        count[f->raw[k]]++;
    for (int v = 0; v < 65536; v++)
        sum += (double)count[v] * v;
    for (int v = f->white; v < 65536; v++)
        above += count[v];
    out->saturated = (double)above / (double)n;
    out->mean = sum / (double)n - f->black;
    int v = 65535;
    for (size_t seen = 0; v > 0; v--)
        if ((seen += count[v]) * 10000 > n)
            break;
    out->bright = v - f->black;
    free(count);
}

bool measure_same(const struct measure_frame *a, const struct measure_frame *b)
{
    const size_t n = (size_t)a->w * (size_t)a->h;
    if (a->w != b->w || a->h != b->h || memcmp(a->raw, b->raw, n * sizeof *a->raw) != 0)
        return false;
    for (size_t k = 1; k < n; k++) // a cap on the lens, or light that saturates all, has no noise
        if (a->raw[k] != a->raw[0])
            return true;
    return false;
}
