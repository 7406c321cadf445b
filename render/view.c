// view.c - false colour, differences, halves.
#define _GNU_SOURCE
#include "render/view.h"
#include "core/colormap.h"
#include "core/spectrum.h"
#include <math.h>
#include <string.h>

static double luminance(const float *px)
{
    return 0.2126 * (double)px[0] + 0.7152 * (double)px[1] + 0.0722 * (double)px[2];
}

static size_t pixels(const struct image *im)
{
    return (size_t)im->w * (size_t)im->h;
}

double view_peak(const struct image *im)
{
    double peak = 0;
    for (size_t k = 0; k < pixels(im); k++)
        peak = fmax(peak, luminance(im->px + 3 * k));
    return peak;
}

static void paint(float *px, double at)
{
    unsigned char rgb[3];
    colormap(at, rgb);
    for (int c = 0; c < 3; c++)
        px[c] = (float)srgb_decode(rgb[c] / 255.0);
}

static void draw_scale(struct image *im, double decades)
{
    const int high = im->h / 50 + 3;
    for (int j = im->h - high; j < im->h; j++)
        for (int i = 0; i < im->w; i++) {
            const double x = (i + .5) / im->w, decade = x * decades;
            float *px = im->px + ((size_t)j * (size_t)im->w + (size_t)i) * 3;
            const bool tick = decade - floor(decade) < decades / im->w * 1.5 && i > 1;
            paint(px, x);
            for (int c = 0; c < 3 && (tick || j == im->h - high); c++)
                px[c] = 1;
        }
}

static void paint_log(float *px, double value, double peak, double decades)
{
    const bool dark = !(value > 0 && peak > 0);
    paint(px, dark ? 0 : fmax(0, 1 + log10(value / peak) / decades));
}

void view_false_color(struct image *im, double peak, double decades)
{
    for (size_t k = 0; k < pixels(im); k++)
        paint_log(im->px + 3 * k, luminance(im->px + 3 * k), peak, decades);
    draw_scale(im, decades);
}

void view_difference(struct image *a, const struct image *b, double decades)
{
    const double peak = view_peak(b);
    for (size_t k = 0; k < pixels(a); k++) {
        double worst = 0;
        for (size_t c = 3 * k; c < 3 * k + 3; c++)
            worst = fmax(worst, fabs((double)a->px[c] - (double)b->px[c]));
        paint_log(a->px + 3 * k, worst, peak, decades);
    }
    draw_scale(a, decades);
}

void view_split(struct image *a, const struct image *b)
{
    const int middle = a->w / 2;
    for (int j = 0; j < a->h; j++) {
        const size_t at = ((size_t)j * (size_t)a->w + (size_t)middle) * 3;
        memcpy(a->px + at, b->px + at, (size_t)(a->w - middle) * 3 * sizeof *a->px);
        for (size_t c = at; c < at + 3; c++)
            a->px[c] = 1;
    }
}
