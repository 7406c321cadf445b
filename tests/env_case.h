// env_case.h - small environments and tables for the tests of prefiltering, with an independent
// judge.
#pragma once
#include "tests/test.h"

#include "core/mem.h"
#include "process/environment.h"
#include "process/table_cubic.h"

// Radiance of a smooth sky with three lights of Gaussian profile, each in its own colour.
static inline void case_sky(struct vec3 d, double rgb[3])
{
    static const double light[3][4] = {{.3, .5, .81, 40}, {-.6, .2, .77, 25}, {.1, -.85, -.5, 30}};
    for (int c = 0; c < 3; c++) {
        const double *l = light[c];
        const struct vec3 at = v3_unit(v3(l[0], l[1], l[2]));
        rgb[c] = .2 + .1 * d.y + .05 * c * d.x;
        for (int k = 0; k < 3; k++)
            rgb[c] += (k == c ? 1 : .1) * l[3] * exp((v3_dot(at, d) - 1) / (.05 * .05));
    }
}

// The sky turned by `turn` (columns are the images of the axes), as a map of h rows.
static inline struct environment case_environment(int h, const struct frame *turn)
{
    struct image im;
    struct err e = {0};
    struct environment env;
    assert_true(image_init(&im, 2 * h, h, 3, &e));
    for (int j = 0; j < h; j++)
        for (int i = 0; i < 2 * h; i++) {
            double rgb[3];
            case_sky(frame_local(turn, latlong_dir(i, j, 2 * h, h)), rgb);
            for (int c = 0; c < 3; c++)
                im.px[(j * 2 * h + i) * 3 + c] = (float)rgb[c];
        }
    assert_true(environment_take(&env, &im, "sky", &e));
    return env;
}

// A table with a mirror lobe and four others, shifted with the channel.
static inline double case_pattern(double u, double v, int c)
{
    static const double lobe[5][3] = {
        {0, 0, 3}, {.12, .05, 1}, {-.12, -.05, 1}, {.04, -.2, .5}, {-.04, .2, .5}};
    double sum = .01;
    for (int k = 0; k < 5; k++) {
        const double x = u - lobe[k][0] * (1 + .2 * c), y = v - lobe[k][1] * (1 + .2 * c);
        sum += lobe[k][2] * exp(-.5 * (x * x + y * y) / (.02 * .02));
    }
    return sum;
}

static inline struct table case_table(int n, double range, int power)
{
    struct table t;
    struct err e = {0};
    assert_true(table_init(&t, n, range, power, 1, &e));
    t.is_rgb = true;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++)
            for (int c = 0; c < 3; c++)
                t.tab[(j * n + i) * 3 + c] =
                    (float)case_pattern(table_node(&t, i), table_node(&t, j), c);
    return t;
}

// The judge: the sky and pattern themselves, no map and no table, midpoints over the hemisphere in
// the sample's polar coordinates. rgb[0] with constant Fresnel, rgb[1] with Schlick's.
static inline void case_truth(const struct frame *f, const struct frame *turn, double range,
                              double r0, const double o[2], double rgb[2][3])
{
    enum { RINGS = 400, SPOKES = 1000 };
    const double on = sqrt(1 - o[0] * o[0] - o[1] * o[1]);
    memset(rgb, 0, 6 * sizeof **rgb);
    for (int a = 0; a < RINGS; a++) {
        const double th = M_PI / 2 * (a + .5) / RINGS, i_n = cos(th), rho = sin(th);
        for (int s = 0; s < SPOKES; s++) {
            const double phi = 2 * M_PI * (s + .5) / SPOKES;
            const double it = rho * cos(phi), ib = rho * sin(phi);
            if (fabs(it + o[0]) > range || fabs(ib + o[1]) > range)
                continue;
            const double x = it * o[0] + ib * o[1] + i_n * on, z = (1 + x) * (1 + x);
            const double fresnel = 1 + (1 - r0) / r0 * pow(1 - sqrt((1 + x) / 2), 5);
            double sky[3];
            case_sky(frame_local(turn, frame_world(f, v3(it, ib, i_n))), sky);
            for (int c = 0; c < 3; c++) {
                const double light = rho * z * case_pattern(it + o[0], ib + o[1], c) * sky[c];
                rgb[0][c] += light;
                rgb[1][c] += light * fresnel;
            }
        }
    }
    for (int k = 0; k < 6; k++)
        rgb[k / 3][k % 3] *= 4 * M_PI * M_PI / on * M_PI * M_PI / RINGS / SPOKES;
}

static const struct frame case_axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

static inline struct frame case_frame(double tx, double ty, double tz, double nx, double ny,
                                      double nz)
{
    struct frame f;
    assert_true(frame_from(v3(tx, ty, tz), v3(nx, ny, nz), &f));
    return f;
}
