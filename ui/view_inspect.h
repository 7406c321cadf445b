// view_inspect.h - what is under the mouse: where light goes there, by which order, of what pitch.
//
// An order (m, n) of a grating with pitch d sends wavelength l to u = m l / d, v = n l / d
// (docs/optics.md), so a place and a wavelength imply a pitch, and a place and a pitch imply the
// orders and wavelengths that meet there.
#pragma once
#include "core/table.h"
#include "render/scene.h"

enum { SPOT_ORDERS = 4, SPOT_HIGHEST = 12 };

struct spot {
    double u, v, w;          // half vector in the surface frame; w NAN: not known
    double reach;            // |(u, v)|
    double angle_rad;        // to which the order leaves when light comes along the normal; NAN
    double azimuth_rad;      // of (u, v)
    double in_rad, out_rad;  // light and viewer from the normal; NAN: not known
    double lambda_m, purity; // dominant wavelength of the colour and how saturated it is; NAN
    double pitch_m;          // that sends lambda here in first order; NAN
    double rgb[3], sigma[3]; // value and its standard deviation (NAN: not known)
    const char *object;      // whose surface it is; NULL: a table or a picture

    // Orders of the pitch that was asked for, up to SPOT_HIGHEST, whose wavelength, visible, comes
    // here.
    struct {
        int m, n;
        double lambda_m;
    } order[SPOT_ORDERS];
    int n_orders;
};

// Fills what follows from u, v, rgb and `white` (the light's colour in linear sRGB). Where the
// colour tells no wavelength `lambda_m` is taken (NAN: none).
void spot_conclude(struct spot *s, const double white[3], double lambda_m, double pitch_m);

// A place of a table in linear sRGB: value and sigma, bilinear. False outside its range.
bool spot_of_table(struct spot *s, const struct table *t, double u, double v);

// A pixel of the rendered scene, by its strongest light; rgb is what was rendered. False: nothing
// is hit, or it is dark.
bool spot_of_scene(struct spot *s, const struct scene *scene, double x, double y, int w, int h);

// The wavelength whose colour, mixed with `white`, has this chromaticity; NAN for purple and grey.
double dominant_wavelength(const double rgb[3], const double white[3], double *purity);
