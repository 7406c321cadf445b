// measure.c - sums over pixels, by bands of rows.
#include "acquire/measure.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BANDS = 16, BLOCK = 8, LEVELS = 6, DIMMER = 2 };
enum { LEAST_PIXELS = 64, LEAST_BAND_PIXELS = 32, LEAST_SPOTS = 8 };
static const double WELL_FROM = 0.02, WELL_TO = 0.9; // of full scale
static const double ENOUGH_PIXELS = 2e6;
static const double SIGMAS_CLEAR = 6;
static const double SPILL_FROM = 0.95;
static const double BLACK_SIGMA = 1.5;      // counts: drift of the black level
static const double BLACK_SEEN_SIGMA = 0.3; // where pixels without light show it: its pattern

struct sums {
    double s, l, ss, sl, ll; // of the short and the long frame
    size_t n;
};

static void add(struct sums *to, const struct sums *t)
{
    to->s += t->s;
    to->l += t->l;
    to->ss += t->ss;
    to->sl += t->sl;
    to->ll += t->ll;
    to->n += t->n;
}

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
    for (int j = 0; j < l->h; j++) {
        const uint16_t *row = l->raw + (size_t)j * (size_t)l->w;
        for (int i = 0; i < b.w; i++) {
            const int end = i + 1 < b.w ? (i + 1) * BLOCK : l->w;
            int n = 0;
            for (int k = i * BLOCK; k < end; k++)
                n += row[k] >= top;
            full[(size_t)(j / BLOCK) * (size_t)b.w + (size_t)i] += n;
        }
    }
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

static double share(const struct blocks *b)
{
    int skipped = 0;
    for (int k = 0; k < b->w * b->h; k++)
        skipped += b->skip[k];
    return (double)skipped / (b->w * b->h);
}

// Sums by band of rows and by brightness: level 0 holds pixels whose sum is over WELL_FROM, every
// further one those of half as much, the last all that are darker.
struct table {
    struct sums at[BANDS][LEVELS];
};

struct counts { // sums of counts, black and all: whole numbers
    uint64_t s, l, ss, sl, ll, n;
};

static void add_row(struct counts level[LEVELS], const uint16_t *s, const uint16_t *l, int w,
                    const bool *skip, const uint8_t *level_of, int to)
{
    for (int i = 0; i < w; i++) {
        const uint32_t x = s[i], y = l[i];
        if (skip[i / BLOCK] || (int)y > to)
            continue;
        struct counts *t = &level[level_of[x + y]];
        t->s += x;
        t->l += y;
        t->ss += (uint64_t)x * x;
        t->sl += (uint64_t)x * y;
        t->ll += (uint64_t)y * y;
        t->n++;
    }
}

static struct sums without_black(const struct counts *c, double s, double l)
{
    const double n = (double)c->n, cs = (double)c->s, cl = (double)c->l;
    return (struct sums){.s = cs - n * s,
                         .l = cl - n * l,
                         .ss = (double)c->ss - 2 * s * cs + n * s * s,
                         .sl = (double)c->sl - s * cl - l * cs + n * s * l,
                         .ll = (double)c->ll - 2 * l * cl + n * l * l,
                         .n = c->n};
}

static void sum_up(const struct measure_frame *s, const struct measure_frame *l,
                   const struct blocks *spill, struct table *t)
{
    const double full = l->white - l->black;
    uint8_t *level_of = xcalloc(2 * 65536, 1);
    struct counts(*c)[LEVELS] = xcalloc(BANDS, sizeof *c);
    for (int v = 0; v < 2 * 65536; v++)
        for (double least = WELL_FROM * full;
             level_of[v] < LEVELS - 1 && v - s->black - l->black < least; least /= 2)
            level_of[v]++;
    // A large picture says enough in some of its rows: pairs of them, for Bayer's sake.
    const double pixels = (double)l->w * l->h;
    const int every = (int)fmax(1, fmin(pixels / ENOUGH_PIXELS, l->h / (16.0 * BANDS)));
    for (int j = 0; j < l->h; j++) {
        const size_t row = (size_t)j * (size_t)l->w;
        if (j / 2 % every == 0)
            add_row(c[(long)j * BANDS / l->h], s->raw + row, l->raw + row, l->w,
                    spill->skip + (size_t)(j / BLOCK) * (size_t)spill->w, level_of,
                    (int)(l->black + WELL_TO * full));
    }
    for (int b = 0; b < BANDS; b++)
        for (int k = 0; k < LEVELS; k++)
            t->at[b][k] = without_black(&c[b][k], s->black, l->black);
    free(c);
    free(level_of);
}

// What is left of pixels' sums when the black level is where `dark` ones are in the mean.
static struct sums above(const struct sums *t, const struct sums *dark)
{
    if (!dark->n)
        return *t;
    const double n = (double)t->n, s = dark->s / (double)dark->n, l = dark->l / (double)dark->n;
    return (struct sums){.s = t->s - n * s,
                         .l = t->l - n * l,
                         .ss = t->ss - 2 * s * t->s + n * s * s,
                         .sl = t->sl - s * t->l - l * t->s + n * s * l,
                         .ll = t->ll - 2 * l * t->l + n * l * l,
                         .n = t->n};
}

// Variance of the sum s, from the scatter about a ratio and from the black level.
static double variance(const struct sums *t, const struct sums *dark, double ratio)
{
    const double scatter = t->ss - 2 * ratio * t->sl + ratio * ratio * t->ll;
    const double n = (double)t->n;
    const double black = (dark->n ? BLACK_SEEN_SIGMA : BLACK_SIGMA) * n * (1 + ratio);
    return fmax(scatter, 0) + black * black;
}

// Standard deviation of the sum of two pixels without light: that of their difference.
static double noise(const struct sums *dark)
{
    const double n = (double)dark->n, mean = (dark->s - dark->l) / n;
    return sqrt(fmax(0, (dark->ss - 2 * dark->sl + dark->ll) / n - mean * mean));
}

// A frame without any signal still says so: at least one count in all.
static struct sums at_least_one(struct sums t)
{
    t.s = fmax(t.s, 1);
    t.l = fmax(t.l, 1);
    return t;
}

// The pixels of levels up to `level` as the bright ones, and those at least DIMMER levels below
// them as the dark ones, if there are enough of them.
static void split(const struct table *t, int level, struct sums *bright, struct sums *dark)
{
    *bright = *dark = (struct sums){0};
    for (int b = 0; b < BANDS; b++)
        for (int k = 0; k < LEVELS; k++)
            if (k <= level)
                add(bright, &t->at[b][k]);
            else if (k >= level + DIMMER)
                add(dark, &t->at[b][k]);
    if (dark->n < LEAST_PIXELS)
        *dark = (struct sums){0};
}

// The level from which on the ratio is known best; -1: none has enough pixels. Where noise alone
// would reach a level, it would be taken for light of a ratio of 1.
static int best_level(const struct table *t, double from)
{
    int best = -1;
    double least = INFINITY;
    for (int k = 0; k < LEVELS - DIMMER; k++, from /= 2) {
        struct sums bright, dark;
        split(t, k, &bright, &dark);
        if (bright.n < LEAST_PIXELS || (k && (!dark.n || from < SIGMAS_CLEAR * noise(&dark))))
            continue;
        const struct sums all = at_least_one(above(&bright, &dark));
        const double v = variance(&all, &dark, all.s / all.l) / (all.s * all.s);
        if (best < 0 || v < least) {
            best = k;
            least = v;
        }
    }
    return best;
}

// The bands of rows, 16 or 8, 4, 2 wide ones, that differ most from what all say.
static void find_worst(const struct table *t, int level, const struct sums *dark, double ratio,
                       int h, struct measure_ratio *m)
{
    double worst = 0;
    for (int wide = 1; wide < BANDS; wide *= 2)
        for (int b = 0; b < BANDS; b += wide) {
            struct sums sum = {0};
            for (int k = 0; k < wide; k++)
                for (int q = 0; q <= level; q++)
                    add(&sum, &t->at[b + k][q]);
            if (sum.n < LEAST_BAND_PIXELS)
                continue;
            sum = at_least_one(above(&sum, dark));
            const double spots =
                sum.l * sum.l / fmax(sum.ll, 1); // as if so many were equally bright
            if (spots < LEAST_SPOTS)
                continue;
            const double expect = fmax(ratio * sum.l, 1);
            const double sigma = sqrt(variance(&sum, dark, sum.s / sum.l)) / expect;
            const double weight = fabs(sum.s / expect - 1) - 4 * sigma;
            if (weight > worst || !m->worst_last) {
                worst = weight;
                m->worst = sum.s / expect;
                m->worst_sigma = sigma;
                m->worst_first = (int)(((long)b * h + BANDS - 1) / BANDS);
                m->worst_last = (int)(((long)(b + wide) * h + BANDS - 1) / BANDS) - 1;
            }
        }
}

bool measure_ratio(const struct measure_frame *a, const struct measure_frame *b,
                   struct measure_ratio *out)
{
    if (a->w != b->w || a->h != b->h)
        return false;
    const bool a_short = a->exposure_ns <= b->exposure_ns;
    const struct measure_frame *s = a_short ? a : b, *l = a_short ? b : a;
    struct blocks spill = find_spill(l);
    const double spilt = share(&spill);
    struct table *t = xcalloc(1, sizeof *t);
    const double from = WELL_FROM * (l->white - l->black);
    struct sums bright, dark;
    sum_up(s, l, &spill, t);
    int level = best_level(t, from);
    if (level < 0) { // saturated spots all over: better with what spills than not at all
        memset(spill.skip, 0, (size_t)spill.w * (size_t)spill.h);
        sum_up(s, l, &spill, t);
        level = best_level(t, from);
    }
    free(spill.skip);
    if (level < 0) {
        free(t);
        return false;
    }
    split(t, level, &bright, &dark);
    const struct sums all = at_least_one(above(&bright, &dark));
    const double ratio = all.s / all.l;
    const double scatter = all.ss - 2 * ratio * all.sl + ratio * ratio * all.ll;
    struct measure_ratio m = {
        .ratio = a_short ? ratio : 1 / ratio,
        .sigma = sqrt(variance(&all, &dark, ratio)) / all.s,
        .worst = 1,
        .residual = sqrt(fmax(scatter, 0) / fmax(all.ss, 1)),
        .spill = spilt,
        .pixels = all.n,
    };
    find_worst(t, level, &dark, ratio, a->h, &m);
    free(t);
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

// Whether a row has noise: under a cap, or where all is saturated, rows are the same for ever.
static bool is_noisy(const uint16_t *row, int w)
{
    int changes = 0;
    for (int i = 1; i < w; i++)
        changes += row[i] != row[i - 1];
    return 2 * changes >= w;
}

bool measure_same_rows(const struct measure_frame *a, const struct measure_frame *b, int *first,
                       int *last)
{
    int other = 0;
    *first = *last = -1;
    if (a->w != b->w || a->h != b->h)
        return false;
    for (int j = 0; j < a->h; j++) {
        const size_t at = (size_t)j * (size_t)a->w;
        if (memcmp(a->raw + at, b->raw + at, (size_t)a->w * sizeof *a->raw) != 0) {
            other++;
        } else if (is_noisy(a->raw + at, a->w)) {
            *first = *first < 0 ? j : *first;
            *last = j;
        }
    }
    return !other && *first >= 0;
}
