// bench_sim.c - frames per second of the simulated camera, and what its noise-free picture costs.
#include "sim/sensor.h"
#include "sim/sim.h"
#include "tests/bench/bench.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

struct job {
    struct lab lab;
    struct band band;
    struct sensor sensor;
    double *row_s; // [h]
    uint16_t *raw; // [h][w]
    uint64_t frame;
    double exposure_s;
};

static bool make_pattern(void *ctx, struct err *e)
{
    struct job *j = ctx;
    struct image im;
    if (!photo_pattern(&j->lab.scene, &j->band, &im, e))
        return false;
    image_finish(&im);
    return true;
}

static bool make_frame(void *ctx, struct err *e)
{
    struct job *j = ctx;
    const struct image *l;
    if (!lab_photo(&j->lab, 0, 0, &l, e)) // kept after the first time
        return false;
    for (int k = 0; k < j->sensor.h; k++)
        j->row_s[k] = j->exposure_s;
    const struct sensor_layer layer = {l->px, j->row_s};
    sensor_expose(&j->sensor, &layer, 1, j->exposure_s, 1, j->frame++, j->raw);
    return true;
}

// Largest difference of the tabulated far field from the direct sum, against the brightest.
static double pattern_error(const struct job *j, struct err *e)
{
    struct farfield f;
    const double lambda_m = j->band.lambda_m[j->band.n / 2];
    const struct farfield_range range = {0.4, j->band.lambda_m[0], j->band.lambda_m[j->band.n - 1],
                                         1.9, 2};
    double worst = 0;
    if (!farfield_init(&f, &j->lab.scene.sample, &range, e))
        return NAN;
    const double top = farfield_ref(&j->lab.scene.sample, 0, 0, 2, lambda_m);
    for (int k = 0; k < 200; k++) {
        const double u = 0.25 * sin(1.1 * k), v = 0.25 * cos(2.3 * k);
        worst = fmax(worst, fabs(farfield_at(&f, u, v, 1.95, lambda_m) -
                                 farfield_ref(&j->lab.scene.sample, u, v, 1.95, lambda_m)));
    }
    farfield_finish(&f);
    return worst / top;
}

// Mean of the unsaturated counts against what the radiance predicts, relative.
static double frame_error(const struct job *j)
{
    const struct sim_sensor *s = &j->lab.scene.sensor;
    const float *l = j->lab.shot[0][0].px;
    double seen = 0, expected = 0;
    for (int k = 0; k < j->sensor.w * j->sensor.h; k++) {
        const double counts = s->responsivity * j->exposure_s * (double)l[k];
        if (counts < 20 || counts > 3000)
            continue;
        seen += j->raw[k] - s->black - sensor_drift(&j->sensor, j->frame - 1);
        expected += counts;
    }
    return fabs(seen / expected - 1);
}

static bool run(struct bench_report *r, struct err *e)
{
    struct job j = {.exposure_s = 100e-6};
    struct bench_time t;
    const size_t n = 1000 * 1000;
    bool ok = lab_open(&j.lab, NULL, NULL, e) && lab_band(&j.lab, 0, 0, &j.band, e);
    if (ok && bench_quick(r))
        view_resize(&j.lab.scene.view, 500, 500);
    const int w = j.lab.scene.view.w, h = j.lab.scene.view.h;
    j.row_s = calloc((size_t)h + 1, sizeof *j.row_s);
    j.raw = calloc(n, sizeof *j.raw);
    char size[40];
    snprintf(size, sizeof size, "%d x %d, %d bit, all noise", w, h, j.lab.scene.sensor.bits);
    ok = ok && sensor_init(&j.sensor, &j.lab.scene.sensor, w, h, 1, e);
    if (ok && (ok = bench_measure(make_pattern, &j, &t, e)))
        bench_row(r, "noise-free picture, once per bracket", "LCD, 10 nm band", t,
                  pattern_error(&j, e), "far field against direct sums, of its peak");
    static const struct {
        const char *name;
        double exposure_s;
    } cases[] = {{"frame, nothing saturated", 100e-6}, {"frame, half of it lit, blooming", 0.5}};
    for (int k = 0; ok && k < 2; k++) {
        j.exposure_s = cases[k].exposure_s;
        if ((ok = bench_measure(make_frame, &j, &t, e))) {
            bench_row(r, cases[k].name, size, t, k ? 0 : frame_error(&j),
                      k ? "not measured: saturated" : "mean of the counts against the radiance");
            bench_figure(r, cases[k].name, 1 / t.wall_s, "frames/s");
        }
    }
    sensor_finish(&j.sensor);
    band_finish(&j.band);
    lab_finish(&j.lab);
    free(j.row_s);
    free(j.raw);
    return ok;
}

extern const struct bench bench_sim;
const struct bench bench_sim = {
    .name = "sim",
    .summary = "frames per second of the simulated camera",
    .run = run,
};
