// studio.c - rectangles and discs of light on a dim room, in angles around the viewer.
#define _GNU_SOURCE
#include "render/studio.h"
#include "core/geom.h"
#include <stddef.h>
#include <string.h>

// Edges are soft over 0.7 degrees, so that the map is smooth at any size.
static const struct lamp {
    double azimuth, height, half_w,
        half_h; // degrees; azimuth from -z to the right, height from the horizon
    double rgb[3];
    int panes; // a window is parted by bars; 0: a disc
} lamps[] = {
    {0, 62, 26, 9, {14, 13.5, 13}, 1},         // soft box above
    {-75, 20, 20, 26, {9, 11, 15}, 3},         // window to the left
    {150, 25, 16, 20, {11, 9.5, 8}, 1},        // soft box behind, to the right
    {65, 30, 0.6, 0.6, {4000, 3400, 2500}, 0}, // bulbs
    {80, 24, 0.6, 0.6, {4000, 3400, 2500}, 0},
    {-172, 6, 0.5, 0.5, {5000, 5200, 5800}, 0}, // spots behind the viewer
    {174, 15, 0.5, 0.5, {5000, 5200, 5800}, 0},
    {-152, 22, 0.5, 0.5, {5000, 5200, 5800}, 0},
    {30, 84, 0.6, 0.6, {4000, 3800, 3400}, 0}, // lamp overhead
};

static double soft(double outside_deg)
{
    const double x = fmax(0, fmin(1, .5 - outside_deg / 0.7));
    return x * x * (3 - 2 * x);
}

static double lit(const struct lamp *l, struct vec3 d)
{
    const double deg = 180 / M_PI, height = asin(fmax(-1, fmin(1, d.y))) * deg;
    double turn = atan2(d.x, -d.z) * deg - l->azimuth;
    turn -= 360 * round(turn / 360);
    const double x = turn * cos(height / deg), y = height - l->height;
    if (!l->panes)
        return soft(hypot(x, y) - l->half_w);
    double in = soft(fabs(x) - l->half_w) * soft(fabs(y) - l->half_h);
    for (int k = 1; k < l->panes; k++)
        in *= 1 - soft(fabs(x + l->half_w * (1 - 2.0 * k / l->panes)) - 1);
    return in;
}

bool studio_map(struct image *map, int h, struct err *e)
{
    if (!image_init(map, 2 * h, h, 3, e))
        return false;
#pragma omp parallel for schedule(dynamic, 16)
    for (int j = 0; j < h; j++)
        for (int i = 0; i < 2 * h; i++) {
            const struct vec3 d = latlong_dir(i, j, 2 * h, h);
            const double wall = d.y > 0 ? 0.10 + 0.10 * d.y : 0.06 + 0.06 * fmax(0, 1 + 3 * d.y);
            const double room[3] = {wall * 0.95, wall, wall * 1.08};
            float *px = map->px + ((size_t)j * (size_t)map->w + (size_t)i) * 3;
            for (int c = 0; c < 3; c++) {
                double sum = room[c];
                for (size_t k = 0; k < sizeof lamps / sizeof *lamps; k++)
                    sum += lit(&lamps[k], d) * lamps[k].rgb[c];
                px[c] = (float)sum;
            }
        }
    return true;
}

bool studio_or_file(struct environment *env, const char *name, struct err *e)
{
    struct image map;
    if (strcmp(name, "studio"))
        return environment_read(env, name, e);
    return studio_map(&map, 512, e) && environment_take(env, &map, name, e);
}
