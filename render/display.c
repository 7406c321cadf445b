// display.c - exposure, gamut and highlights for the screen.
#define _GNU_SOURCE
#include "render/display.h"
#include "core/spectrum.h"
#include <math.h>
#include <stdlib.h>

static double luminance(const double c[3])
{
    return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
}

static void show(double c[3])
{
    const double y = fmax(0, luminance(c));
    const double least = fmin(c[0], fmin(c[1], c[2]));
    const double keep = least < 0 ? y / (y - least) : 1;
    for (int k = 0; k < 3; k++)
        c[k] = y + keep * (c[k] - y);

    const double knee = 0.8, most = fmax(c[0], fmax(c[1], c[2]));
    if (most <= knee)
        return;
    const double over = (most - knee) / (1 - knee);
    const double shown = 1 - (1 - knee) * exp(-over);
    const double fade = 1 - exp(-over / 40); // white some 5 stops above
    for (int k = 0; k < 3; k++)
        c[k] = shown * (c[k] / most * (1 - fade) + fade);
}

void display_map(struct image *im, double exposure_ev)
{
    const double scale = exp2(exposure_ev);
    const size_t n = (size_t)im->w * (size_t)im->h;
    for (size_t k = 0; k < n; k++) {
        float *px = im->px + 3 * k;
        double c[3];
        for (int i = 0; i < 3; i++)
            c[i] = isfinite(px[i]) ? px[i] * scale : 0;
        show(c);
        for (int i = 0; i < 3; i++)
            px[i] = (float)fmax(0, c[i]);
    }
}

void display_dither(struct image *im)
{
    for (int k = 0; k < im->w * im->h; k++) {
        const double x = 0.06711056 * (k % im->w) + 0.00583715 * (k / im->w);
        const double y = 52.9829189 * (x - floor(x)), step = (y - floor(y) - .5) / 255;
        for (int c = 0; c < 3; c++) {
            float *px = &im->px[3 * k + c];
            const double shown = srgb_encode((double)*px);
            if (shown > 0 && shown < 1) // black and white stay
                *px = (float)srgb_decode(fmax(0, fmin(1, shown + step)));
        }
    }
}

static int falling(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x < y) - (x > y);
}

double display_exposure(const struct image *im)
{
    const size_t n = (size_t)im->w * (size_t)im->h;
    float *most = malloc(n * sizeof *most), peak = 0;
    size_t lit = 0;
    for (size_t k = 0; k < n && most; k++) {
        const float *px = im->px + 3 * k;
        const float m = fmaxf(px[0], fmaxf(px[1], px[2]));
        most[k] = isfinite(m) ? m : 0;
        peak = fmaxf(peak, most[k]);
    }
    for (size_t k = 0; k < n && most; k++)
        if (most[k] > peak * 0x1p-20f)
            most[lit++] = most[k];
    double ev = 0;
    if (lit) {
        qsort(most, lit, sizeof *most, falling);
        ev = log2(0.5 / (double)most[lit / 25]);
    }
    free(most);
    return ev;
}
