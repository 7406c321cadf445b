// photo.h - the photographed pattern that a sample's table is summed from, kept for other lights.
#pragma once
#include "process/lut_preview.h"

struct photo {
    struct lut_pattern pattern;
    struct lut_request request; // all but pattern and light
};

// One channel of a picture, by name; NULL: the only one, or "g". ERR_DATA, ERR_FILE.
bool photo_read(struct photo *p, const char *path, const char *channel, double scale,
                const double center_px[2], struct err *e); // center NAN: the brightest lobe
void photo_finish(struct photo *p);                        // accepts NULL and a zeroed struct

// The table under a light, as the request says, or by the levels of a preview.
bool photo_table(const struct photo *p, const struct spectrum *light, struct table *t,
                 struct err *e);
struct lut_preview photo_preview(const struct photo *p, const struct spectrum *light);
