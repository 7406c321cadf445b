// colormap.c - linear between nine points of the perceptually even scale known as inferno.
#include "core/colormap.h"
#include <math.h>

void colormap(double x, unsigned char rgb[3])
{
    static const unsigned char point[9][3] = {{0, 0, 4},      {31, 12, 72},   {85, 15, 109},
                                              {136, 34, 106}, {186, 54, 85},  {227, 89, 51},
                                              {249, 140, 10}, {249, 201, 50}, {252, 255, 164}};
    if (isnan(x)) {
        rgb[0] = rgb[1] = rgb[2] = 128;
        return;
    }
    const double at = fmax(0, fmin(1, x)) * 8;
    const int k = at < 7 ? (int)at : 7;
    for (int c = 0; c < 3; c++)
        rgb[c] = (unsigned char)lround(point[k][c] + (at - k) * (point[k + 1][c] - point[k][c]));
}
