// lamp.c - Gaussian spots on a ring.
#define _GNU_SOURCE
#include "ui/lamp.h"
#include "core/imgfile.h"
#include <math.h>

bool lamp_write(const char *path, struct err *e)
{
    enum { SIDE = 65, LEDS = 8 };
    static const double colour[3][3] = {{1, 0.62, 0.3}, {0.7, 0.85, 1}, {1, 0.9, 0.75}};
    const double radius = 24, sigma = 1.6;
    struct image im;
    if (!image_init(&im, SIDE, SIDE, 3, e))
        return false;
    for (int k = 0; k < SIDE * SIDE; k++)
        for (int led = 0; led <= LEDS; led++) {
            const double angle = 2 * M_PI * led / LEDS, r = led < LEDS ? radius : 0;
            const double x = k % SIDE - SIDE / 2 - r * cos(angle);
            const double y = k / SIDE - SIDE / 2 - r * sin(angle);
            const double spot = exp(-(x * x + y * y) / (2 * sigma * sigma));
            for (int c = 0; c < 3; c++)
                im.px[3 * k + c] += (float)(spot * colour[led < LEDS ? led % 2 : 2][c]);
        }
    const bool ok = image_write(&im, path, e);
    image_finish(&im);
    return ok;
}
