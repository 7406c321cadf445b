// bench_calib.c - calibrations against the simulator: what a rig is found to be, and how long that
// takes. The board, the ball and the grating are photographed through the simulator's own lens.
#define _GNU_SOURCE
#include "calib/corner.h"
#include "calib/geometry.h"
#include "calib/grey.h"
#include "calib/light.h"
#include "calib/noise.h"
#include "calib/passband.h"
#include "core/mem.h"
#include "core/spectrum.h"
#include "sim/photo.h"
#include "tests/bench/bench.h"
#include "tests/noise.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { VIEWS = 6, BALLS = 4, W = 640, H = 480 };

static const char bench_format[] =
    "sample: {kind: flat}\n"
    "view:\n  kind: camera\n  width: 640\n  height: 480\n  camera: [0m, 0m, 0.5m]\n"
    "  target: [0m, 0m, 0m]\n  sample: [%gm, %gm, %gm]\n  normal: [%g, %g, 1]\n"
    "  light: [0.3m, 0.25m, 1.1m]\n  focal: 2mm\n  pixel: 5um\n  center-x: 322px\n"
    "  center-y: 237px\n  distortion: [-0.12, 0.03, 0.0007, -0.0004, 0]\n  defocus: 0.6px\n"
    "board: {squares: [10, 7], square: 40mm}\n"
    "ball: {at: [%gm, %gm, %gm], radius: 40mm}\n";

static const double pose[VIEWS][5] = {{0, 0, 0, 0, 0},          {-.15, -.1, .05, .4, .1},
                                      {.15, -.1, 0, -.1, .4},   {-.12, .07, .02, .3, -.4},
                                      {.15, .1, .05, -.4, -.2}, {0, .02, .07, .5, .3}};
static const double ball_at[BALLS][3] = {
    {0, 0, .05}, {-.1, .07, .02}, {.1, .07, .02}, {.09, -.07, 0}};

static bool scene_open(struct sim_scene *s, const double p[5], const double b[3], struct err *e)
{
    char text[1000];
    snprintf(text, sizeof text, bench_format, p[0], p[1], p[2], p[3], p[4], b[0], b[1], b[2]);
    return sim_scene_open_text(s, "bench", text, NULL, e);
}

struct setup {
    float *board[VIEWS], *ball[BALLS]; // [H][W]
    struct lens lens;
    struct image truth, geometry;
    struct light light;
};

static bool photograph(struct setup *r, struct err *e)
{
    for (int k = 0; k < VIEWS + BALLS; k++) {
        struct sim_scene s = {0};
        struct image im = {0};
        const bool is_board = k < VIEWS;
        bool ok = scene_open(&s, pose[is_board ? k : 0], ball_at[is_board ? 0 : k - VIEWS], e) &&
                  (is_board ? board_photo(&s.board, &s.view, &im, e)
                            : ball_photo(&s.ball, &s.view, &im, e));
        float *light = ok ? light_from(&im, e) : NULL;
        ok = light != NULL;
        *(is_board ? &r->board[k] : &r->ball[k - VIEWS]) = light;
        if (ok && k == 0)
            ok = photo_geometry(&s, &r->truth, e);
        image_finish(&im);
        sim_scene_finish(&s);
        if (!ok)
            return false;
    }
    return true;
}

static bool run_lens(void *ctx, struct err *e)
{
    struct setup *r = ctx;
    const struct board b = {.cols = 9, .rows = 6, .square_m = 0.04};
    char *names[VIEWS] = {"0", "1", "2", "3", "4", "5"};
    struct corners seen[VIEWS] = {0};
    bool ok = true;
    for (int k = 0; ok && k < VIEWS; k++) {
        uint8_t *grey = grey_from(r->board[k], W * H, e);
        ok = grey && cv_board_find(&b, grey, W, H, &seen[k], e);
        if (ok)
            corners_refine(&b, &seen[k], r->board[k], W, H);
        free(grey);
    }
    lens_finish(&r->lens);
    ok = ok && lens_fit(&r->lens, &b, seen, names, VIEWS, W, H, e);
    for (int k = 0; k < VIEWS; k++) {
        free(seen[k].id);
        free(seen[k].px);
    }
    return ok;
}

static bool run_geometry(void *ctx, struct err *e)
{
    struct setup *r = ctx;
    // the simulator's axes: x right, y up, z towards the camera at 0.5 m
    const struct geometry_options o = {
        .light_m = {0.3, -0.25, -0.6}, .size_m = {1, 1}, .beam = 1, .r0 = 0.04};
    image_finish(&r->geometry);
    return geometry_of(&r->lens, &o, &r->geometry, e);
}

static bool run_light(void *ctx, struct err *e)
{
    struct setup *r = ctx;
    struct line line[BALLS];
    struct ball ball;
    for (int k = 0; k < BALLS; k++)
        if (!light_ball(&r->lens, 0.04, NULL, r->ball[k], W, H, &ball, &line[k], e))
            return false;
    return light_from_lines(&r->light, line, BALLS, e);
}

// What a camera of 20,000 electrons and 8 bits makes of the boards, under light that is uneven by
// half.
static void spoil_boards(struct setup *r)
{
    uint64_t seed = 4;
    for (int k = 0; k < VIEWS; k++)
        for (int j = 0; j < H; j++)
            for (int i = 0; i < W; i++) {
                float *px = &r->board[k][j * W + i];
                const double x = (double)*px * (1 + 0.5 * ((double)i / W - 0.5));
                const double noisy = x + sqrt(fmax(0, x) / 20000 + 4e-6) * noise_gauss(&seed);
                const double code = floor(255 * srgb_encode(fmin(1, fmax(0, noisy))) + 0.5);
                *px = (float)srgb_decode(code / 255);
            }
}

// The largest difference of h within 40 degrees of the axis.
static double worst_h(const struct setup *r)
{
    double worst = 0;
    for (int j = 0; j < H; j++)
        for (int i = 0; i < W; i++) {
            const float *a = r->geometry.px + 7 * (j * W + i), *b = r->truth.px + 4 * (j * W + i);
            const struct vec3 ray = lens_ray(&r->lens, i, j);
            for (int c = 0; c < 3 && ray.z > cos(40 * M_PI / 180) && !isnan(a[0] + b[0]); c++)
                worst = fmax(worst, fabs((double)(a[c] - b[c])));
        }
    return worst;
}

static bool positions(struct bench_report *r, struct err *e)
{
    struct setup rig = {0};
    struct bench_time t;
    bool ok = photograph(&rig, e) && bench_measure(run_lens, &rig, &t, e);
    if (ok)
        bench_row(r, "lens", "6 chessboards, 640 x 480", t,
                  fabs(0.5 * (rig.lens.camera.focal_px[0] + rig.lens.camera.focal_px[1]) / 400 - 1),
                  "focal length, relative");
    if (ok && (ok = bench_measure(run_geometry, &rig, &t, e)))
        bench_row(r, "geometry", "to 40 deg off axis", t, worst_h(&rig), "half vector, largest");
    if (ok && (ok = bench_measure(run_light, &rig, &t, e))) {
        const struct vec3 truth = v3(0.3, -0.25, -0.6);
        const double *p = rig.light.position_m;
        bench_row(r, "light", "4 balls of 40 mm, at 1.15 m", t,
                  v3_norm(v3_sub(v3(p[0], p[1], p[2]), truth)), "position, m");
    }
    if (ok) {
        spoil_boards(&rig);
        ok = bench_measure(run_lens, &rig, &t, e) && run_geometry(&rig, e);
    }
    if (ok)
        bench_row(r, "lens", "8 bit, noise, uneven light", t, worst_h(&rig),
                  "half vector, largest");
    for (int k = 0; k < VIEWS; k++)
        free(rig.board[k]);
    for (int k = 0; k < BALLS; k++)
        free(rig.ball[k]);
    lens_finish(&rig.lens);
    image_finish(&rig.truth);
    image_finish(&rig.geometry);
    return ok;
}

struct curves {
    struct spectrum curve[2];
    struct passband band;
};

static bool run_band(void *ctx, struct err *e)
{
    struct curves *c = ctx;
    passband_finish(&c->band);
    return passband_product(&c->band, c->curve, 2, 1e-9, e);
}

static void gaussian(struct spectrum *s, double centre_nm, double width_nm, double step_nm)
{
    const int n = 1 + (int)(400 / step_nm);
    *s = (struct spectrum){n, xcalloc((size_t)n, sizeof(double)),
                           xcalloc((size_t)n, sizeof(double))};
    for (int k = 0; k < n; k++) {
        const double nm = 380 + k * step_nm, x = (nm - centre_nm) / width_nm;
        s->lambda_m[k] = nm * 1e-9;
        s->value[k] = exp(-4 * log(2) * x * x);
    }
}

static bool wavelength(struct bench_report *r, struct err *e)
{
    struct curves c = {0};
    struct bench_time t;
    gaussian(&c.curve[0], 530, 20, 1);
    gaussian(&c.curve[1], 560, 90, 5);
    const double truth = (530 / 400. + 560 / 8100.) / (1 / 400. + 1 / 8100.);
    const bool ok = bench_measure(run_band, &c, &t, e);
    if (ok)
        bench_row(r, "spectral", "filter 20 nm x LED 90 nm", t, fabs(c.band.lambda_m * 1e9 - truth),
                  "effective wavelength, nm");
    passband_finish(&c.band);
    spectrum_finish(&c.curve[0]);
    spectrum_finish(&c.curve[1]);
    return ok;
}

// Pairs of frames of a ramp: 2.5 electrons a count, read noise 1.2 counts, 0.5 % PRNU.
struct transfer {
    float *a[8], *b[8];
    int w, h;
    struct noise noise;
};

static bool run_noise(void *ctx, struct err *e)
{
    struct transfer *t = ctx;
    double model[2] = {0};
    for (int round = 0; round < 3; round++) {
        struct noise_sums s = {.black = 256, .white = 4000, .model = {model[0], model[1]}};
        for (int k = 0; k < 8; k++)
            noise_add(&s, t->a[k], t->b[k], NULL, t->w, t->h);
        if (!noise_end(&s, &t->noise, e))
            return false;
        model[0] = t->noise.read * t->noise.read + 1e-12;
        model[1] = t->noise.gain;
    }
    return true;
}

static bool noise(struct bench_report *r, struct err *e)
{
    struct transfer t = {.w = 640, .h = 480};
    struct bench_time time;
    const size_t n = (size_t)t.w * (size_t)t.h;
    const double gain = 0.4, read = 1.2, prnu = 0.005;
    float *site = sample_alloc(n, sizeof *site, "sensor", e);
    bool ok = site;
    uint64_t seed = 9;
    for (size_t k = 0; ok && k < n; k++)
        site[k] = (float)(1 + prnu * noise_gauss(&seed));
    for (int k = 0; ok && k < 8; k++)
        for (int q = 0; ok && q < 2; q++) {
            float *px = sample_alloc(n, sizeof *px, "frame", e);
            ok = px;
            *(q ? &t.b[k] : &t.a[k]) = px;
            for (size_t i = 0; ok && i < n; i++) {
                const double x =
                    (double)site[i] * 8 * exp2(k) * (0.6 + 0.8 * (double)(i % 640) / 640);
                const double noisy = 256 + x + sqrt(gain * x + read * read) * noise_gauss(&seed);
                px[i] = (float)fmin(4095, floor(noisy + 0.5));
            }
        }
    ok = ok && bench_measure(run_noise, &t, &time, e);
    if (ok) {
        bench_row(r, "noise", "8 pairs 640 x 480", time, fabs(t.noise.gain / gain - 1),
                  "gain, relative");
        bench_figure(r, "noise: read noise", fabs(t.noise.read / sqrt(read * read + 1 / 12.) - 1),
                     "relative error");
        bench_figure(r, "noise: PRNU", fabs(t.noise.prnu / prnu - 1), "relative error");
    }
    for (int k = 0; k < 8; k++) {
        free(t.a[k]);
        free(t.b[k]);
    }
    free(site);
    return ok;
}

static bool run(struct bench_report *r, struct err *e)
{
    return positions(r, e) && wavelength(r, e) && noise(r, e);
}

const struct bench bench_calib = {"calib", "calibrations against the simulator's truth", run};
