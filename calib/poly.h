// poly.h - polynomials of degree 4 in x and y: smooth light over a disc or a frame.
#pragma once

enum { POLY_TERMS = 15 };

// x^a y^b for all a + b <= 4; |x| and |y| about 1.
static inline void poly_terms(double x, double y, double m[POLY_TERMS])
{
    const double px[5] = {1, x, x * x, x * x * x, x * x * x * x};
    const double py[5] = {1, y, y * y, y * y * y, y * y * y * y};
    int k = 0;
    for (int a = 0; a <= 4; a++)
        for (int b = 0; a + b <= 4; b++)
            m[k++] = px[a] * py[b];
}

static inline double poly_at(const double term[POLY_TERMS], double x, double y)
{
    double m[POLY_TERMS], sum = 0;
    poly_terms(x, y, m);
    for (int k = 0; k < POLY_TERMS; k++)
        sum += term[k] * m[k];
    return sum;
}
