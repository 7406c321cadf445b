// view_stats.c - one pass over a frame.
#define _GNU_SOURCE
#include "ui/view_stats.h"
#include <math.h>
#include <stddef.h>

// The second difference in x and y over the mean: noise aside, only sharp detail has it.
static double focus(const struct image *im, int step)
{
    double energy = 0, light = 0;
    for (int j = step; j < im->h - step; j++) {
        double row = 0, sum = 0;
        for (int i = step; i < im->w - step; i++) {
            const float *p = im->px + (size_t)j * (size_t)im->w + (size_t)i;
            const size_t down = (size_t)step * (size_t)im->w;
            const double l = 4 * (double)p[0] - (double)p[step] - (double)p[-step] -
                             (double)p[down] - (double)*(p - down);
            row += l * l;
            sum += (double)p[0] * (double)p[0];
        }
        energy += row;
        light += sum;
    }
    return light > 0 ? sqrt(energy / light) : 0;
}

void stats_of(struct stats *s, const struct image *im, int step)
{
    const size_t n = (size_t)im->w * (size_t)im->h;
    long bin[STATS_BINS] = {0}, clipped = 0, most = 1;
    double sum = 0, brightest = 0;
    for (size_t k = 0; k < n; k++) {
        const double x = (double)im->px[k];
        const int at = (int)(x * STATS_BINS);
        bin[at < 0 ? 0 : at < STATS_BINS ? at : STATS_BINS - 1]++;
        clipped += x >= 1;
        sum += x;
        brightest = fmax(brightest, x);
    }
    for (int k = 0; k < STATS_BINS; k++)
        most = bin[k] > most ? bin[k] : most;
    for (int k = 0; k < STATS_BINS; k++) // a few bright pixels matter as much as many dark ones
        s->bin[k] = (float)(log1p((double)bin[k]) / log1p((double)most));
    s->mean = sum / (double)n;
    s->brightest = brightest;
    s->clipped = (double)clipped / (double)n;
    s->focus = focus(im, step);
}
