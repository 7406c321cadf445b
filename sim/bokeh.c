// bokeh.c - a picture of the sample inside a disc.
#define _GNU_SOURCE
#include "sim/bokeh.h"
#include "sim/lens.h"
#include <math.h>

bool bokeh_read(struct sim_bokeh *b, struct ynode *root, struct err *e)
{
    struct ynode *y = NULL;
    *b = (struct sim_bokeh){
        .w = 1600,
        .h = 1200,
        .radius_px = 470,
        .m_per_px = 80e-9,
        .focus_per_m = 10,
        .turn_rad = M_PI / 2,
        .sigma_px = {2.8, 2.3, 1.9},
        .level = {0.4, 0.45, 0.5},
        .relief_m = 400e-9,
        .floor = 0.4,
        .shade = 0.12,
    };
    if (!ymap_map(root, "bokeh", Y_OPTIONAL, &y, e))
        return false;
    if (y && (!ymap_int(y, "width", Y_OPTIONAL, 16, 16384, &b->w, e) ||
              !ymap_int(y, "height", Y_OPTIONAL, 16, 16384, &b->h, e) ||
              !ymap_num(y, "radius", Y_OPTIONAL, UNIT_PX, 4, 1e4, &b->radius_px, e) ||
              !ymap_num(y, "pixel", Y_OPTIONAL, UNIT_M, 1e-9, 1e-4, &b->m_per_px, e) ||
              !ymap_num(y, "focus", Y_OPTIONAL, UNIT_NONE, 0.01, 1000, &b->focus_per_m, e) ||
              !ymap_num(y, "turn", Y_OPTIONAL, UNIT_RAD, -7, 7, &b->turn_rad, e) ||
              !ymap_num(y, "blur-red", Y_OPTIONAL, UNIT_PX, 0, 50, &b->sigma_px[0], e) ||
              !ymap_num(y, "blur-green", Y_OPTIONAL, UNIT_PX, 0, 50, &b->sigma_px[1], e) ||
              !ymap_num(y, "blur-blue", Y_OPTIONAL, UNIT_PX, 0, 50, &b->sigma_px[2], e) ||
              !ymap_num(y, "relief", Y_OPTIONAL, UNIT_M, 1e-9, 1e-4, &b->relief_m, e) ||
              !ymap_num(y, "floor", Y_OPTIONAL, UNIT_NONE, 0, 1, &b->floor, e) ||
              !ymap_num(y, "shade", Y_OPTIONAL, UNIT_NONE, 0, 1, &b->shade, e)))
        return false;
    b->center_x = 0.5 * (b->w - 1);
    b->center_y = 0.5 * (b->h - 1);
    return !y || (ymap_num(y, "center-x", Y_OPTIONAL, UNIT_PX, -1e5, 1e5, &b->center_x, e) &&
                  ymap_num(y, "center-y", Y_OPTIONAL, UNIT_PX, -1e5, 1e5, &b->center_y, e));
}

// Light of n x n places within the pixel: 1 at the highest, floor at `relief_m` under it; of a
// sample without relief, what it reflects.
static double pixel_mean(const struct sim_bokeh *b, const struct sample *s, double high_m,
                         double relief_m, double x, double y, int n, double *spread)
{
    double sum = 0, least = INFINITY, most = -INFINITY;
    for (int q = 0; q < n; q++)
        for (int p = 0; p < n; p++) {
            double amplitude;
            const double z = sample_height(s, x + ((p + 0.5) / n - 0.5) * b->m_per_px,
                                           y + ((q + 0.5) / n - 0.5) * b->m_per_px, &amplitude);
            const double part = relief_m > 0 ? 1 - (high_m - z) / relief_m : amplitude * amplitude;
            sum += part;
            least = fmin(least, part);
            most = fmax(most, part);
        }
    *spread = most - least;
    return b->floor + (1 - b->floor) * sum / (n * n);
}

static double intensity(const struct sim_bokeh *b, const struct sample *s, double high_m,
                        double relief_m, double x, double y)
{
    double spread;
    const double light = pixel_mean(b, s, high_m, relief_m, x, y, 3, &spread);
    return spread > 0.1 ? pixel_mean(b, s, high_m, relief_m, x, y, 12, &spread) : light; // an edge
}

bool bokeh_photo(const struct sim_bokeh *b, const struct sample *s, struct image *out,
                 struct err *e)
{
    struct image im;
    const double c = cos(b->turn_rad), i_ = sin(b->turn_rad);
    double low_m, high_m;
    if (!image_init(&im, b->w, b->h, 3, e))
        return false;
    sample_height_range(s, &low_m, &high_m);
    const double relief_m = high_m > low_m ? fmax(b->relief_m, high_m - low_m) : 0;
#pragma omp parallel for schedule(dynamic, 8)
    for (int j = 0; j < b->h; j++)
        for (int i = 0; i < b->w; i++) {
            const double dx = i - b->center_x, dy = j - b->center_y;
            const double r = hypot(dx, dy) / b->radius_px;
            if (r > 1)
                continue;
            // The sample's x to the right and y down; turned counter-clockwise, x points up.
            const double x = (c * dx - i_ * dy) * b->m_per_px, y = (i_ * dx + c * dy) * b->m_per_px;
            const double l = intensity(b, s, high_m, relief_m, x, y) * (1 - b->shade * r * r);
            for (int k = 0; k < 3; k++)
                im.px[((size_t)j * (size_t)b->w + (size_t)i) * 3 + (size_t)k] =
                    (float)(b->level[k] * l);
        }
    bool ok = true;
    for (int k = 0; ok && k < 3; k++)
        ok = lens_blur(&im, k, b->sigma_px[k], e);
    if (ok)
        *out = im;
    else
        image_finish(&im);
    return ok;
}
