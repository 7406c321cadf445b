// hdr.c - merging linear frames, one row at a time.
//
// Which frames see a pixel is decided from the shorter frames, never from the frame's own noise:
// a frame counts when the shorter ones predict it to stay SIGMAS under saturation. Throwing away
// those samples that happen to be high would bias the rest. A sample that is far above what the
// shorter frames predict is not light: charge has spilled into it from a saturated neighbour.
#include "process/hdr.h"
#include "calib/bracket.h"
#include "core/mem.h"
#include "process/hdr_out.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIGMAS = 4, BLOOM_SIGMAS = 7, ROUNDS = 3 };

const char hdr_methods[] = "poisson|debevec|robertson";

static double variance_of(const struct hdr_noise *noise, double x)
{
    return noise->read + noise->gain * fmax(x, 0);
}

struct estimate {
    double radiance, variance;
    enum hdr_state state;
};

// Inverse-variance weights at the merged value itself, not at each sample: weights that follow a
// sample's noise would favour the low ones. A few fixed-point rounds suffice.
static void poisson(const struct hdr_frames *f, const double *x, const bool *use, double start,
                    struct estimate *out)
{
    double radiance = start;
    for (int round = 0; round < ROUNDS; round++) {
        double num = 0, den = 0;
        for (int j = 0; j < f->n; j++)
            if (use[j]) {
                const double w = f->time_s[j] / variance_of(&f->noise, radiance * f->time_s[j]);
                num += w * x[j];
                den += w * f->time_s[j];
            }
        radiance = num / den;
        out->variance = 1 / den;
    }
    out->radiance = radiance;
}

// Fixed weights by the sample's place between black and saturation.
static bool hat(const struct hdr_frames *f, const double *x, const bool *use, bool log_mean,
                struct estimate *out)
{
    double num = 0, den = 0, var = 0;
    for (int j = 0; j < f->n; j++) {
        const double t = f->time_s[j], s = x[j] / f->saturation;
        if (!use[j] || (log_mean && !(s > 0)))
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

// x: samples of one pixel, frames from the shortest to the longest.
static struct estimate merge_pixel(const struct hdr_frames *f, enum hdr_method method,
                                   const double *x)
{
    struct estimate out = {.state = HDR_MEASURED};
    bool use[BRACKET_MAX];
    double sum_x = 0, sum_t = 0, sum_read = 0;
    int used = 0;
    for (int j = 0; j < f->n; j++) {
        use[j] = x[j] < f->saturation;
        if (use[j] && used) {
            const double ratio = f->time_s[j] / sum_t, predicted = sum_x * ratio;
            const double variance = variance_of(&f->noise, predicted) +
                                    ratio * ratio * (sum_read + f->noise.gain * fmax(sum_x, 0));
            const double sigma = sqrt(variance);
            use[j] = predicted + SIGMAS * sigma < f->saturation &&
                     x[j] < 1.02 * predicted + BLOOM_SIGMAS * sigma;
        }
        if (!use[j])
            continue;
        used++;
        sum_x += x[j];
        sum_t += f->time_s[j];
        sum_read += f->noise.read;
    }
    if (!used) {
        out.state = HDR_SATURATED;
        out.radiance = f->saturation / f->time_s[0];
    } else if (method == HDR_POISSON) {
        poisson(f, x, use, sum_x / sum_t, &out);
    } else if (!hat(f, x, use, method == HDR_DEBEVEC, &out)) {
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
#pragma omp parallel for schedule(static)
    for (int j = 0; j < f.h; j++) {
        const size_t row = (size_t)j * (size_t)f.w * (size_t)f.nc;
        for (int i = 0; i < f.w; i++)
            for (int c = 0; c < f.nc; c++) {
                double x[BRACKET_MAX];
                for (int k = 0; k < f.n; k++)
                    x[k] = (double)f.px[k][row + (size_t)(i * f.nc + c)];
                const struct estimate s = merge_pixel(&f, method, x);
                hdr_out_set(&o, i, j, c, (float)s.radiance, (float)s.variance, s.state);
            }
    }
    return hdr_out_take(&o, out, counts, e);
}
