// lut_pattern.c - a photograph's channel as a pattern: holes filled from around and remembered.
#define _GNU_SOURCE
#include "process/lut_pattern.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

void lut_pattern_finish(struct lut_pattern *p)
{
    if (!p)
        return;
    free(p->px);
    free(p->seen);
    free(p->variance);
    *p = (struct lut_pattern){0};
}

// The pixels around pixel k that exist: their number, 3 to 8.
static int neighbours(int k, int w, int h, int out[8])
{
    const int i = k % w, j = k / w;
    int n = 0;
    for (int y = j > 0 ? j - 1 : 0; y <= j + 1 && y < h; y++)
        for (int x = i > 0 ? i - 1 : 0; x <= i + 1 && x < w; x++)
            if (x != i || y != j)
                out[n++] = y * w + x;
    return n;
}

// Unseen pixels connected to the border through unseen ones: outside the picture, not a hole in it.
// `stack` has room for all unseen pixels.
static void mark_outside(const struct lut_pattern *p, uint8_t *outside, int *stack)
{
    int n = 0, near[8];
    for (int k = 0; k < p->w * p->h; k++) {
        const int i = k % p->w, j = k / p->w;
        if (!p->seen[k] && (i == 0 || j == 0 || i == p->w - 1 || j == p->h - 1))
            outside[stack[n++] = k] = 1;
    }
    while (n) {
        const int k = stack[--n];
        for (int m = neighbours(k, p->w, p->h, near); m-- > 0;)
            if (!p->seen[near[m]] && !outside[near[m]])
                outside[stack[n++] = near[m]] = 1;
    }
}

// Holes close layer by layer from their rim, each pixel taking the mean of what it touches; what is
// outside fades to 0 at once. The guess only keeps the spline calm: `seen` stays 0 there.
static bool fill_holes(struct lut_pattern *p, struct err *e)
{
    const int count = p->w * p->h;
    uint8_t *known = sample_alloc((size_t)count, 1, "mask", e);
    uint8_t *outside = sample_alloc((size_t)count, 1, "mask", e);
    int *rim = sample_alloc((size_t)p->unseen, sizeof *rim, "mask", e);
    const bool ok = known && outside && rim;
    int n = 0, near[8];
    if (ok) {
        mark_outside(p, outside, rim);
        memcpy(known, p->seen, (size_t)count);
        for (int k = 0; k < count; k++) // 2: waiting in the rim
            for (int m = known[k] ? 0 : neighbours(k, p->w, p->h, near); m-- > 0 && !known[k];)
                if (known[near[m]] == 1)
                    known[rim[n++] = k] = 2;
    }
    for (int first = 0, layer = 0; first < n; layer++) {
        const int last = n;
        for (int q = first; q < last; q++) {
            double sum = 0, weight = 0;
            for (int m = neighbours(rim[q], p->w, p->h, near); m-- > 0;)
                if (known[near[m]] == 1) {
                    sum += p->px[near[m]];
                    weight++;
                }
            const double fade = !outside[rim[q]] ? 1 : layer == 0 ? 0.5 : 0;
            p->px[rim[q]] = (float)(fade * sum / weight);
        }
        for (int q = first; q < last; q++)
            known[rim[q]] = 1;
        for (int q = first; q < last; q++)
            for (int m = neighbours(rim[q], p->w, p->h, near); m-- > 0;)
                if (!known[near[m]])
                    known[rim[n++] = near[m]] = 2;
        first = last;
    }
    free(known);
    free(outside);
    free(rim);
    return ok;
}

static bool take_variance(struct lut_pattern *p, const struct image *im, int channel, double scale,
                          struct err *e)
{
    const char *names = meta_text(&im->meta, "channels");
    if (!names)
        return true;
    for (int c = 0; c < channel && names; c++)
        if ((names = strchr(names, ',')))
            names++;
    if (!names)
        return true;
    char *name = xasprintf("var.%.*s", (int)strcspn(names, ","), names);
    const int from = image_channel_index(im, name);
    free(name);
    if (from < 0)
        return true;
    const size_t count = (size_t)p->w * (size_t)p->h;
    if (!(p->variance = sample_alloc(count, sizeof *p->variance, "variance", e)))
        return false;
    for (size_t k = 0; k < count; k++) {
        const double v = im->px[k * (size_t)im->nc + (size_t)from] * scale * scale;
        p->variance[k] = v >= 0 && isfinite((float)v) ? (float)v : 0;
    }
    return true;
}

// A merged bracket (process/hdr.h) marks by mask 0 and a variance of the value's square what every
// frame saturated: the value is a lower bound, kept, but not a measurement.
static bool mark_saturated(struct lut_pattern *p, const struct image *im, struct err *e)
{
    const int mask = image_channel_index(im, "mask");
    const size_t count = (size_t)p->w * (size_t)p->h;
    for (size_t k = 0; p->variance && mask >= 0 && k < count; k++) {
        const double value = p->px[k];
        if (im->px[k * (size_t)im->nc + (size_t)mask] > 0 || !(value > 0) ||
            p->variance[k] < 0.98 * value * value)
            continue;
        if (!p->seen) {
            if (!(p->seen = sample_alloc(count, 1, "mask", e)))
                return false;
            memset(p->seen, 1, count);
        }
        p->unseen += p->seen[k];
        p->seen[k] = 0;
    }
    return true;
}

bool lut_pattern_init(struct lut_pattern *p, const struct image *im, int channel, double scale,
                      struct err *e)
{
    if (channel < 0 || channel >= im->nc)
        return err_set(e, ERR_DATA, "the pattern has %d channel%s: no channel number %d", im->nc,
                       im->nc == 1 ? "" : "s", channel + 1);
    if (im->w < 4 || im->h < 4)
        return err_set(e, ERR_DATA, "a pattern of %d x %d pixels is too small: needs 4 x 4", im->w,
                       im->h);
    const size_t count = (size_t)im->w * (size_t)im->h;
    if (count > INT32_MAX)
        return err_set(e, ERR_DATA, "a pattern of %d x %d pixels is too large", im->w, im->h);
    struct lut_pattern got = {.w = im->w, .h = im->h};
    if (!(got.px = sample_alloc(count, sizeof *got.px, "pattern", e)))
        return false;
    for (size_t k = 0; k < count; k++) {
        got.px[k] = (float)(im->px[k * (size_t)im->nc + (size_t)channel] * scale);
        got.unseen += !isfinite(got.px[k]);
    }
    bool ok = got.unseen < (long)count || err_set(e, ERR_DATA, "the pattern has no finite pixel");
    if (ok && got.unseen) {
        ok = (got.seen = sample_alloc(count, 1, "mask", e)) != NULL;
        for (size_t k = 0; ok && k < count; k++)
            got.seen[k] = isfinite(got.px[k]);
        ok = ok && fill_holes(&got, e);
    }
    if (ok && take_variance(&got, im, channel, scale, e) && mark_saturated(&got, im, e))
        *p = got;
    else
        lut_pattern_finish(&got), ok = false;
    return ok;
}
