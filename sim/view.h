// view.h - where camera, light and sample are, and what each pixel therefore looks at.
//
// A Fourier view: light along the normal through a beam splitter, a lens whose picture is linear in
// the direction cosines of wo, u = (i - cx) * h_per_pixel, v likewise down the rows. Or a camera:
// pinhole with Brown's distortion (x right, y down, z forward, as OpenCV has it), a small round
// light that faces the sample, a sample that is a plane, a disc or bent to a cylinder; every half
// vector is computed from the positions, without small angles.
#pragma once
#include "core/geom.h"
#include "sim/sample.h"

struct sim_view {
    bool fourier;
    int w, h;
    double center_x, center_y; // of the axis, px
    double h_per_pixel;        // Fourier view only, and all that it needs

    struct vec3 camera_m, light_m;
    struct frame camera; // t right, b down, n forward
    double focal_px;
    double distortion[5]; // k1 k2 p1 p2 k3
    bool natural;         // cos^4 fall-off of the lens
    double vignetting[2]; // 1 + a r^2 + b r^4 on top of it, r = 1 in the corners
    double light_diameter_m;
    double light_beam; // radiant intensity falls as cos^beam about the axis to the sample

    struct vec3 sample_m; // origin of the sample and its frame there
    struct frame sample;
    double size_m[2]; // of a plane or cylinder, along t and b; radius of a disc: half of the first

    double defocus_px;      // sigma of the blur
    double glare, glare_px; // share of the light that the lens scatters, and how far
};

// What a pixel sees for one point of the light: half vector in the local (t, b, n).
struct sight {
    double u, v, w;
    double factor; // F^2 G / w^2 * irradiance / irradiance at the origin; 0: nothing is seen
    double lm;     // turns L / E into the Lm of a table; NAN when factor is 0
    double share;  // of the light that this point stands for
};

enum { SIGHTS = 7 };
// Points of the light (1 when it has no size) as seen from the pixel (i, j), the middle first.
int view_sights(const struct sim_view *v, const struct sample *s, double i, double j,
                struct sight out[SIGHTS]);
// A camera's ray through a pixel, a unit vector, and the pixel of a place before the camera.
struct vec3 view_ray(const struct sim_view *v, double i, double j);
void view_project(const struct sim_view *v, struct vec3 at_m, double px[2]);

double view_vignetting(const struct sim_view *v, double i,
                       double j); // what is left, 1 in the middle

// h.n where the picture shows (u, v): exact for the Fourier view, for a camera with the angle
// between light and camera as it is at the sample's origin.
double view_w(const struct sim_view *v, double u, double v_);

// The same field of view across another number of pixels; 0: keep.
void view_resize(struct sim_view *v, int w, int h);

bool view_read(struct sim_view *v, struct ynode *root, const struct sample *s, struct err *e);
