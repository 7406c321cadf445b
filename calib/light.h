// light.h - where the light is: the light record.
//
// Each picture gives one line that passes through the light: from the place on a mirror ball, or on
// a flat sample, that mirrors it to the camera. The point nearest to all lines is the light.
#pragma once
#include "calib/lens.h"

struct light {
    struct record head;               // residual: rms distance of the lines, m
    char method[8];                   // "ball" or "lobe"
    double position_m[3], sigma_m[3]; // camera coordinates
    int pictures;
};

struct line {
    struct vec3 from_m, along; // along is a unit vector
};

// ERR_DATA for fewer than two lines, and where all lines are parallel within a degree.
bool light_from_lines(struct light *out, const struct line *line, int n, struct err *e);

// The light's line by the mirror image in a ball of this radius, in `light` [h][w] (grey.h).
// `guess` x, y, radius in pixels, or NULL: the largest thing that differs from the border.
struct ball {
    struct vec3 center_m;
    double spot_px[2];
    double rms_px; // of the outline
};
bool light_ball(const struct lens *l, double radius_m, const double guess[3], const float *light,
                int w, int h, struct ball *ball, struct line *line, struct err *e);

// The light by the specular lobes of one flat sample that lay where the boards of n views did:
// where h is the normal, the lobe is brightest. light[k] [h][w] is the picture of the sample in the
// plane of view[k]. Lens and poses are adjusted with it, within what the corners allow.
bool light_lobes(struct light *out, const struct lens *l, const int *view,
                 const float *const *light, int n, struct err *e);

bool light_write(const struct light *s, const char *command, const char *path, struct err *e);
bool light_read(struct light *s, const char *path, struct err *e);
