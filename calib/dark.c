// dark.c - a line through the dark frames of every pixel.
#include "calib/dark.h"
#include "core/imgfile.h"
#include "core/mem.h"
#include "core/sort.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double HOT_SIGMAS = 12; // so far out that light cannot be told on top of it

bool dark_begin(struct dark_sums *s, int w, int h, struct err *e)
{
    const size_t n = (size_t)w * (size_t)h;
    *s = (struct dark_sums){.w = w, .h = h};
    if ((s->x = sample_alloc(n, sizeof(float), "dark", e)) &&
        (s->xt = sample_alloc(n, sizeof(float), "dark", e)) &&
        (s->xx = sample_alloc(n, sizeof(float), "dark", e)))
        return true;
    dark_drop(s);
    return false;
}

void dark_drop(struct dark_sums *s)
{
    free(s->x);
    free(s->xt);
    free(s->xx);
    *s = (struct dark_sums){0};
}

void dark_add(struct dark_sums *s, const float *counts, double time_s)
{
    const size_t n = (size_t)s->w * (size_t)s->h;
    if (!s->frames) {
        double sum = 0;
        for (size_t k = 0; k < n; k++)
            sum += (double)counts[k];
        s->reference = (float)round(sum / (double)n);
        s->first_time_s = time_s;
        s->exposures = 1;
    } else if (fabs(time_s - s->first_time_s) > 0.01 * s->first_time_s) {
        s->exposures = 2; // or more: enough for a line
    }
    s->frames++;
    s->t += time_s;
    s->tt += time_s * time_s;
    s->ttt += time_s * time_s * time_s;
    for (size_t k = 0; k < n; k++) {
        const float x = counts[k] - s->reference;
        s->x[k] += x;
        s->xt[k] += x * (float)time_s;
        s->xx[k] += x * x;
    }
}

// Median of some 100 000 of the samples.
static double median_of(const float *v, size_t n)
{
    const size_t step = n / 100000 + 1, m = (n + step - 1) / step;
    float *some = xcalloc(m, sizeof *some);
    for (size_t k = 0; k < m; k++)
        some[k] = v[k * step];
    sort_floats(some, m);
    const double median = (double)some[m / 2];
    free(some);
    return median;
}

// Least squares per pixel into d->black (at t = 0) and d->rate; mean squared residual of a frame,
// without those far above the median: hot ones.
static double fit(const struct dark_sums *s, struct dark *d, float *residual)
{
    const size_t n = (size_t)s->w * (size_t)s->h;
    const bool line = s->exposures > 1 && s->frames > 2;
    const double f = s->frames, det = f * s->tt - s->t * s->t, freedom = f - (line ? 2 : 1);
    for (size_t k = 0; k < n; k++) {
        const double x = (double)s->x[k], xt = (double)s->xt[k];
        const double rate = line ? (f * xt - s->t * x) / det : 0;
        const double black = (x - rate * s->t) / f;
        const double squares = fmax(0, (double)s->xx[k] - black * x - rate * xt);
        d->black[k] = (float)(black + (double)s->reference);
        d->rate[k] = (float)rate;
        residual[k] = (float)(squares / freedom);
    }
    const double limit = 60 * median_of(residual, n) + 1e-12;
    double sum = 0;
    long count = 0;
    for (size_t k = 0; k < n; k++)
        if ((double)residual[k] <= limit) {
            sum += (double)residual[k];
            count++;
        }
    return sum / (double)count;
}

// The time whose dark current makes the noise of the mean residual: every frame's, by what the line
// leaves of that frame, 1 - 1 / f - (t - mean)^2 / sum of (t - mean)^2.
static double noise_time_s(const struct dark_sums *s)
{
    const double f = s->frames, mean = s->t / f, spread = s->tt - s->t * mean;
    if (s->exposures < 2 || s->frames < 3)
        return mean;
    const double pull = (s->ttt - 2 * mean * s->tt + mean * mean * s->t) / spread;
    return (s->t - mean - pull) / (f - 2);
}

// Rates back to the median as far as they are noise; black is refitted with the rate that stays.
static void shrink(const struct dark_sums *s, struct dark *d)
{
    const size_t n = (size_t)s->w * (size_t)s->h;
    const double f = s->frames, spread = s->tt - s->t * s->t / f; // of t about its mean
    const double sigma = d->exposures > 1 ? d->read_noise / sqrt(spread) : INFINITY;
    const double black_median = median_of(d->black, n);
    const double black_sigma = fmax(d->read_noise, 1.4826 * 1); // offsets differ by a count or so
    d->rate_median = median_of(d->rate, n);
    double sum = 0;
    for (size_t k = 0; k < n; k++) {
        const double off = (double)d->rate[k] - d->rate_median, z = off / sigma;
        const double rate = d->rate_median + off * fmax(0, 1 - 1 / fmax(z * z, 1e-12));
        const double black = (double)s->reference + ((double)s->x[k] - rate * s->t) / f;
        d->hot[k] = fabs(z) > HOT_SIGMAS && off * s->t / f > 4 * d->read_noise;
        d->hot[k] |= fabs(black - black_median) > 4 * HOT_SIGMAS * black_sigma;
        d->n_hot += d->hot[k];
        d->rate[k] = (float)rate;
        d->black[k] = (float)black;
        sum += black;
    }
    d->black_mean = sum / (double)n;
}

bool dark_end(struct dark_sums *s, struct dark *out, struct err *e)
{
    const size_t n = (size_t)s->w * (size_t)s->h;
    struct dark d = {.w = s->w, .h = s->h, .frames = s->frames, .exposures = s->exposures};
    float *residual = NULL;
    bool ok =
        s->frames >= 2 ||
        err_set(e, ERR_DATA, "%d dark frame%s: two or more are needed to tell noise from level",
                s->frames, s->frames == 1 ? "" : "s");
    ok = ok && (residual = sample_alloc(n, sizeof(float), "dark", e)) &&
         (d.black = sample_alloc(n, sizeof(float), "dark", e)) &&
         (d.rate = sample_alloc(n, sizeof(float), "dark", e)) &&
         (d.hot = sample_alloc(n, 1, "dark", e));
    if (ok) {
        d.read_noise = sqrt(fit(s, &d, residual));
        if (s->frames == 2) // two frames of two exposures: a constant, no line
            d.exposures = 1;
        shrink(s, &d);
        d.level = d.exposures > 1 ? fmax(0, d.rate_median * noise_time_s(s)) : 0;
        record_init(&d.head, "dark", "this sensor, gain and temperature", d.read_noise,
                    "read noise, counts rms");
        d.head.w = d.w;
        d.head.h = d.h;
    }
    free(residual);
    dark_drop(s);
    if (ok)
        *out = d;
    else
        dark_finish(&d);
    return ok;
}

void dark_finish(struct dark *d)
{
    free(d->black);
    free(d->rate);
    free(d->hot);
    *d = (struct dark){0};
}

double dark_at(const struct dark *d, size_t k, double time_s)
{
    return (double)d->black[k] + (double)d->rate[k] * time_s;
}

double dark_variance(const struct dark *d)
{
    return d->read_noise * d->read_noise / d->frames;
}

bool dark_write(const struct dark *d, const char *command, const char *path, struct err *e)
{
    struct image im = {0};
    if (strcmp(path_ext(path), ".exr"))
        return err_set(e, ERR_DATA, "%s: a dark record is an .exr", path);
    if (!image_init(&im, d->w, d->h, 3, e))
        return false;
    const size_t n = (size_t)d->w * (size_t)d->h;
    for (size_t k = 0; k < n; k++) {
        im.px[3 * k] = d->black[k];
        im.px[3 * k + 1] = d->rate[k];
        im.px[3 * k + 2] = (float)d->hot[k];
    }
    meta_set_text(&im.meta, "channels", "black,rate,hot");
    meta_set_text(&im.meta, "nacre.version", NACRE_VERSION);
    meta_set_text(&im.meta, "nacre.command", command);
    record_to_meta(&d->head, &im.meta);
    meta_set_nums(
        &im.meta, "nacre.dark",
        (double[]){d->black_mean, d->rate_median, d->read_noise, d->frames, d->exposures, d->level},
        6);
    const bool ok = image_write(&im, path, e);
    image_finish(&im);
    return ok;
}

bool dark_read(struct dark *out, const char *path, struct err *e)
{
    struct image im = {0};
    struct dark d = {0};
    if (!image_read(&im, path, e))
        return false;
    const struct meta_item *m = meta_find(&im.meta, "nacre.dark");
    bool ok = record_from_meta(&d.head, &im.meta, path, "dark", e) &&
              ((im.nc == 3 && m && m->n >= 5) ||
               err_set(e, ERR_DATA, "%s: a dark record without its numbers", path)) &&
              image_check_finite(&im, path, e);
    const int black = image_channel_index(&im, "black"), rate = image_channel_index(&im, "rate"),
              hot = image_channel_index(&im, "hot");
    ok = ok && ((black >= 0 && rate >= 0 && hot >= 0) ||
                err_set(e, ERR_DATA, "%s: lacks the channels black, rate and hot", path));
    const size_t n = (size_t)im.w * (size_t)im.h;
    ok = ok && (d.black = sample_alloc(n, sizeof(float), "dark", e)) &&
         (d.rate = sample_alloc(n, sizeof(float), "dark", e)) &&
         (d.hot = sample_alloc(n, 1, "dark", e));
    if (ok) {
        d.w = im.w;
        d.h = im.h;
        d.black_mean = m->num[0];
        d.rate_median = m->num[1];
        d.read_noise = m->num[2];
        d.frames = (int)fmax(1, m->num[3]);
        d.exposures = (int)m->num[4];
        d.level = m->n > 5 ? m->num[5] : 0;
        for (size_t k = 0; k < n; k++) {
            d.black[k] = im.px[3 * k + (size_t)black];
            d.rate[k] = im.px[3 * k + (size_t)rate];
            d.hot[k] = im.px[3 * k + (size_t)hot] > 0.5f;
            d.n_hot += d.hot[k];
        }
        *out = d;
    } else {
        dark_finish(&d);
    }
    image_finish(&im);
    return ok;
}
