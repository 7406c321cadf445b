// bokeh.h - the out-of-focus highlight with the sample's structure inside it (T17 section 5).
//
// A disc, the image of the aperture, in which dark is deep: intensity falls from 1 at the highest
// place to floor at `relief` under it, or is the reflectance of a sample without heights; a pixel
// takes the mean over its area; shaded towards the rim, blurred per channel (blue sharpest), the
// sample turned counter-clockwise on the sensor.
#pragma once
#include "core/image.h"
#include "sim/sample.h"

struct sim_bokeh {
    int w, h;
    double center_x, center_y, radius_px;
    double m_per_px;
    double focus_per_m; // dioptres at which the highlight is this large; it grows with them
    double turn_rad;    // counter-clockwise
    double sigma_px[3]; // blur of red, green, blue
    double level[3];    // brightness of the channels at full height
    double relief_m;    // the sample's own where that is more
    double floor;       // intensity at its bottom, 0 to 1
    double shade;       // 1 - shade at the rim, with the square of the radius
};

bool bokeh_read(struct sim_bokeh *b, struct ynode *root, struct err *e); // key `bokeh`, optional
bool bokeh_photo(const struct sim_bokeh *b, const struct sample *s, struct image *out,
                 struct err *e); // linear R, G, B
