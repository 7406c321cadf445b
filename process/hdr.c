// hdr.c - merging linear frames, one row at a time.
//
// Which frames see a pixel is decided from the shorter frames, never from the frame's own noise:
// a frame counts when the shorter ones predict it to stay SIGMAS under saturation. Throwing away
// those samples that happen to be high would bias the rest. Where the prediction is too near to
// saturation to tell, the frame counts by its likelihood: a saturated sample says "at least so
// much" (Tobin 1958), and most of the frame's information is kept. A sample that is far above what
// the shorter frames predict is not light: charge has spilled into it from a saturated neighbour.
#define _GNU_SOURCE
#include "process/hdr.h"
#include "calib/bracket.h"
#include "core/mem.h"
#include "process/hdr_out.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIGMAS = 4, BLOOM_SIGMAS = 7, ROUNDS = 3, DOUBTFUL_ROUNDS = 8 };

const char hdr_methods[] = "poisson|debevec|robertson";

static double variance_of(const struct hdr_noise *noise, double x)
{
    return noise->read + noise->gain * fmax(x, 0);
}

struct estimate {
    double radiance, variance;
    enum hdr_state state;
};

enum use { LEFT_OUT, USED, CENSORED }; // CENSORED: saturated, and that is all we know

// Mean of a standard normal variable beyond z.
static double beyond(double z)
{
    return z > 30 ? z : sqrt(2 / M_PI) * exp(-0.5 * z * z) / erfc(z / M_SQRT2);
}

// Inverse-variance weights at the merged value itself, not at each sample: weights that follow a
// sample's noise would favour the low ones. A few rounds of Newton's method suffice; without
// censored samples each is the weighted mean.
static void poisson(const struct hdr_frames *f, const double *x, const enum use *use, int rounds,
                    double start, struct estimate *out)
{
    double radiance = start;
    for (int round = 0; round < rounds; round++) {
        double num = 0, den = 0, push = 0, stiff = 0;
        for (int j = 0; j < f->n; j++) {
            if (use[j] == LEFT_OUT)
                continue;
            const double t = f->time_s[j], v = variance_of(&f->noise, radiance * t), w = t / v;
            if (use[j] == USED) {
                num += w * x[j];
                den += w * t;
            } else {
                const double z = (f->saturation - radiance * t) / sqrt(v), h = beyond(z);
                push += w * sqrt(v) * h;
                stiff += w * t * h * (h - z);
            }
        }
        radiance = (num + push + stiff * radiance) / (den + stiff);
        out->variance = 1 / (den + stiff);
    }
    out->radiance = radiance;
}

// Fixed weights by the sample's place between black and saturation.
static bool hat(const struct hdr_frames *f, const double *x, const enum use *use, bool log_mean,
                struct estimate *out)
{
    double num = 0, den = 0, var = 0;
    for (int j = 0; j < f->n; j++) {
        const double t = f->time_s[j], s = x[j] / f->saturation;
        if (use[j] != USED || (log_mean && !(s > 0)))
            continue;
        const double certain = exp(-16 * (s - 0.5) * (s - 0.5)); // Robertson 2003, eq. 17
        const double w = log_mean ? fmin(s, 1 - s) : certain * t * t;
        const double v = variance_of(&f->noise, x[j]) / (log_mean ? x[j] * x[j] : t * t);
        num += w * (log_mean ? log(x[j] / t) : x[j] / t);
        den += w;
        var += w * w * v;
    }
    if (!(den > 0))
        return false;
    out->radiance = log_mean ? exp(num / den) : num / den;
    out->variance = var / (den * den) * (log_mean ? out->radiance * out->radiance : 1);
    return true;
}

// What the shorter frames say about each sample of a pixel.
struct judged {
    enum use use[BRACKET_MAX];
    enum use doubtful[BRACKET_MAX]; // too near to saturation to tell; else LEFT_OUT
    double sum_x, sum_t;            // of the used ones
    int used, in_doubt;
    int over, spilled; // surely saturated; brighter than light can be
};

// x: samples of one pixel, frames from the shortest to the longest.
static void judge(const struct hdr_frames *f, const double *x, struct judged *g)
{
    double sum_x = 0, sum_t = 0, sum_read = 0;
    *g = (struct judged){.used = 0};
    for (int j = 0; j < f->n; j++) {
        bool is_clear = x[j] < f->saturation;
        if (g->used) {
            const double ratio = f->time_s[j] / sum_t, predicted = sum_x * ratio;
            const double sigma = sqrt(variance_of(&f->noise, predicted) +
                                      ratio * ratio * (sum_read + f->noise.gain * fmax(sum_x, 0)));
            // were it light, the shorter frames' noise would be that of so much light
            const double most = fmax(x[j], predicted), over = x[j] - 1.02 * predicted;
            const double if_light = variance_of(&f->noise, most) +
                                    ratio * (ratio * sum_read + f->noise.gain * fmax(most, 0));
            const bool is_light = over < 0 || over * over < BLOOM_SIGMAS * BLOOM_SIGMAS * if_light;
            const bool is_below = predicted + SIGMAS * sigma < f->saturation;
            if (is_below) {
                g->spilled += !is_light || !is_clear;
            } else if (predicted - SIGMAS * sigma < f->saturation) {
                g->in_doubt++;
                g->doubtful[j] = !is_clear ? CENSORED : is_light ? USED : LEFT_OUT;
            } else {
                g->over++;
            }
            is_clear = is_clear && is_light && is_below;
        }
        if (!is_clear)
            continue;
        g->use[j] = USED;
        g->used++;
        sum_x += x[j];
        sum_t += f->time_s[j];
        sum_read += f->noise.read;
    }
    g->sum_x = sum_x;
    g->sum_t = sum_t;
}

static void samples_at(const struct hdr_frames *f, size_t at, double x[BRACKET_MAX])
{
    for (int k = 0; k < f->n; k++)
        x[k] = (double)f->px[k][at];
}

// Does charge spill from saturated pixels? Then their neighbours near saturation are not to be
// trusted, and samples in doubt stay out. Every eighth row tells.
static bool spills(const struct hdr_frames *f)
{
    long over = 0, spilled = 0;
#pragma omp parallel for schedule(static) reduction(+ : over, spilled)
    for (int j = 0; j < f->h; j += 8)
        for (int i = 0; i < f->w * f->nc; i++) {
            double x[BRACKET_MAX];
            struct judged g;
            samples_at(f, (size_t)j * (size_t)f->w * (size_t)f->nc + (size_t)i, x);
            judge(f, x, &g);
            over += g.over;
            spilled += g.spilled;
        }
    return spilled > 4 + over / 100; // chance makes some
}

static struct estimate merge_pixel(const struct hdr_frames *f, enum hdr_method method,
                                   const double *x, bool trust_doubtful)
{
    struct estimate out = {.state = HDR_MEASURED};
    struct judged g;
    judge(f, x, &g);
    if (!g.used) {
        out.state = HDR_SATURATED;
        out.radiance = f->saturation / f->time_s[0];
    } else if (method == HDR_POISSON) {
        const bool more = g.in_doubt && trust_doubtful;
        for (int j = 0; more && j < f->n; j++)
            if (g.doubtful[j])
                g.use[j] = g.doubtful[j];
        poisson(f, x, g.use, more ? DOUBTFUL_ROUNDS : ROUNDS, g.sum_x / g.sum_t, &out);
    } else if (!hat(f, x, g.use, method == HDR_DEBEVEC, &out)) {
        out.state = HDR_BLACK;
    }
    return out;
}

// Frames in rising order of time.
static void sort_frames(struct hdr_frames *f, const float **px, double *time_s)
{
    for (int j = 0; j < f->n; j++) {
        int k = j;
        for (; k > 0 && time_s[k - 1] > f->time_s[j]; k--) {
            time_s[k] = time_s[k - 1];
            px[k] = px[k - 1];
        }
        time_s[k] = f->time_s[j];
        px[k] = f->px[j];
    }
    f->px = px;
    f->time_s = time_s;
}

bool hdr_merge(const struct hdr_frames *frames, enum hdr_method method, struct image *out,
               struct hdr_counts *counts, struct err *e)
{
    struct hdr_frames f = *frames;
    if (f.n < 2 || f.n > BRACKET_MAX)
        return err_set(e, ERR_DATA, "a bracket needs 2 to %d frames, not %d", BRACKET_MAX, f.n);
    if (method != HDR_POISSON && !isfinite(f.saturation))
        return err_set(e, ERR_DATA, "%s weights need a saturation level, and the frames have none",
                       method == HDR_DEBEVEC ? "debevec" : "robertson");
    const float *px[BRACKET_MAX];
    double time_s[BRACKET_MAX];
    sort_frames(&f, px, time_s);
    struct hdr_out o;
    if (!hdr_out_init(&o, f.w, f.h, f.nc, e))
        return false;
    const bool trust_doubtful = method == HDR_POISSON && !spills(&f);
#pragma omp parallel for schedule(static)
    for (int j = 0; j < f.h; j++) {
        const size_t row = (size_t)j * (size_t)f.w * (size_t)f.nc;
        for (int i = 0; i < f.w; i++)
            for (int c = 0; c < f.nc; c++) {
                double x[BRACKET_MAX];
                samples_at(&f, row + (size_t)(i * f.nc + c), x);
                const struct estimate s = merge_pixel(&f, method, x, trust_doubtful);
                hdr_out_set(&o, i, j, c, (float)s.radiance, (float)s.variance, s.state);
            }
    }
    return hdr_out_take(&o, out, counts, e);
}
