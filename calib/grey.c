// grey.c - any picture as one channel of light, for finding things in it.
#define _GNU_SOURCE
#include "calib/grey.h"
#include "core/mem.h"
#include "core/sort.h"
#include "core/spectrum.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static void smooth_line(float *v, int n, size_t step)
{
    float before = v[n > 1 ? step : 0];
    for (int i = 0; i < n; i++) {
        const float here = v[(size_t)i * step];
        const float after = i + 1 < n ? v[(size_t)(i + 1) * step] : before;
        v[(size_t)i * step] = 0.25f * before + 0.5f * here + 0.25f * after;
        before = here;
    }
}

float *light_from(const struct image *im, struct err *e)
{
    const size_t n = (size_t)im->w * (size_t)im->h, nc = (size_t)im->nc;
    const size_t colors = nc >= 3 ? 3 : 1;
    const char *bayer = meta_text(&im->meta, "nacre.bayer");
    const struct meta_item *black = meta_find(&im->meta, "nacre.black");
    const double zero = black && black->n ? black->num[0] : 0;
    double encoded = 0;
    meta_num(&im->meta, "nacre.encoded", &encoded);
    float *v = sample_alloc(n, sizeof *v, "picture", e);
    for (size_t k = 0; v && k < n; k++) {
        double sum = 0;
        for (size_t c = 0; c < colors; c++) {
            const double x = (double)im->px[k * nc + c];
            sum += encoded > 0 ? srgb_decode(x) : x - zero;
        }
        v[k] = isfinite(sum) ? (float)(sum / (double)colors) : 0;
    }
    if (v && bayer && strcmp(bayer, "Y")) {
        for (int j = 0; j < im->h; j++)
            smooth_line(v + (size_t)j * (size_t)im->w, im->w, 1);
        for (int i = 0; i < im->w; i++)
            smooth_line(v + i, im->h, (size_t)im->w);
    }
    return v;
}

uint8_t *grey_from(const float *light, size_t n, struct err *e)
{
    enum { PROBES = 20000 };
    float probe[PROBES];
    const size_t count = sorted_probe(light, n, probe, PROBES);
    const double white = fmax(1e-30, (double)probe[(size_t)(0.995 * (double)(count - 1))]);
    uint8_t *grey = sample_alloc(n, 1, "picture", e);
    for (size_t k = 0; grey && k < n; k++)
        grey[k] = (uint8_t)lrint(255 * sqrt(fmin(1, fmax(0, (double)light[k] / white))));
    return grey;
}
