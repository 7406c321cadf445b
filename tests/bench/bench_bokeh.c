// bench_bokeh.c - heights from simulated bokeh photographs against the simulator's, and from the
// reference photograph against its pitches.
#define _GNU_SOURCE
#include "core/imgfile.h"
#include "core/mem.h"
#include "process/bokeh.h"
#include "sim/bokeh.h"
#include "tests/bench/bench.h"
#include "tests/noise.h"
#include <math.h>
#include <stdlib.h>

struct job {
    struct image photo;
    struct bokeh_record record;
    struct bokeh_options opt;
    struct hfield out;
    struct bokeh_result result;
};

static const char blazed[] = "sample: {kind: blazed, lines: 600/mm, blaze: 13deg}\n";
static const char phone[] = "sample: {kind: lcd, pitch: [6.2um, 7.8um], opening: [0.7, 0.75], "
                            "depth: 384.78nm, turn: 9.4deg}\n";
static const double HEIGHT_M = 384.78e-9; // of both

static bool photograph(struct image *im, const char *sample, double blur_px, struct err *e)
{
    struct yaml *y;
    struct sample s = {0};
    struct sim_bokeh b;
    char *text = xasprintf(
        "%sbokeh: {pixel: 77nm, turn: 0deg, relief: 384.78nm, blur-blue: %gpx}\n", sample, blur_px);
    struct ynode *map = NULL;
    bool ok = yaml_open_text(&y, "bench", text, e);
    if (ok) {
        ok = ymap_map(yaml_root(y), "sample", Y_NEEDED, &map, e) && sample_read(&s, map, "", e) &&
             bokeh_read(&b, yaml_root(y), e);
        ok = yaml_close(y, ok, e) && ok && bokeh_photo(&b, &s, im, e);
    }
    sample_finish(&s);
    free(text);
    return ok;
}

static bool run_bokeh(void *ctx, struct err *e)
{
    struct job *b = ctx;
    hfield_finish(&b->out);
    return bokeh_height(&b->photo, &b->record, &b->opt, &b->out, &b->result, e);
}

// RMSE over the nodes, means taken off, relative to the height. The sharp photograph tells the
// truth: light = floor + (1 - floor) height, shaded.
static double miss(const struct job *b, const struct image *sharp)
{
    const struct hfield *hf = &b->out;
    double sum = 0, square = 0;
    for (int y = 0; y < hf->ny; y++)
        for (int x = 0; x < hf->nx; x++) {
            const int i = (int)lround(b->result.disc.cx_px) + x - hf->nx / 2,
                      j = (int)lround(b->result.disc.cy_px) + y - hf->ny / 2;
            const double r2 = (pow(i - 799.5, 2) + pow(j - 599.5, 2)) / (470.0 * 470.0);
            const double light =
                (double)sharp->px[((size_t)j * (size_t)sharp->w + (size_t)i) * 3 + 2] /
                (0.5 * (1 - 0.12 * r2));
            const double d = (double)hf->z[(size_t)y * (size_t)hf->nx + (size_t)x] -
                             HEIGHT_M * (light - 0.4) / 0.6;
            sum += d;
            square += d * d;
        }
    const double n = (double)hf->nx * hf->ny;
    return sqrt(square / n - sum * sum / n / n) / HEIGHT_M;
}

static bool simulated(struct bench_report *r, struct err *e)
{
    static const struct {
        const char *name, *sample;
        int lines;
        bool lattice;
    } cases[] = {{"blazed, folded", blazed, BOKEH_1D_IF_LINES, true},
                 {"blazed, as a picture", blazed, BOKEH_2D, false},
                 {"phone, folded", phone, BOKEH_1D_IF_LINES, true},
                 {"phone, as a picture", phone, BOKEH_1D_IF_LINES, false}};
    bool ok = true;
    for (int c = 0; ok && c < 4; c++) {
        struct image sharp = {0};
        struct job b = {.opt = {.lines = cases[c].lines,
                                .lattice = cases[c].lattice,
                                .level = true,
                                .f_number = NAN}};
        b.record = (struct bokeh_record){.channel = "B",
                                         .m_per_px = 77e-9,
                                         .sigma_px = 1.9,
                                         .iterations = 60,
                                         .gain_m = HEIGHT_M * 0.7 / 0.6,
                                         .offset = 1 - 0.3 / 0.7,
                                         .level = 0.35 * 0.94,
                                         .exposure_s = NAN};
        struct bench_time t;
        ok = photograph(&b.photo, cases[c].sample, 1.9, e) &&
             photograph(&sharp, cases[c].sample, 0, e);
        uint64_t seed = 1;
        for (int k = 0; ok && k < b.photo.w * b.photo.h * 3; k++) { // 40,000 electrons are white
            const double v = (double)b.photo.px[k];
            b.photo.px[k] =
                (float)fmax(0, v + 0.005 * sqrt(0.5 * fmax(1e-4, v)) * noise_gauss(&seed));
        }
        ok = ok && bench_measure(run_bokeh, &b, &t, e);
        if (ok)
            bench_row(r, cases[c].name, "simulated, shot noise 0.5 %", t, miss(&b, &sharp),
                      "RMSE of the height");
        hfield_finish(&b.out);
        image_finish(&b.photo);
        image_finish(&sharp);
    }
    return ok;
}

static bool reference(struct bench_report *r, struct err *e)
{
    const char *path = bench_shared("reference/bokeh/sample.png");
    struct job b = {.opt = {.lattice = true, .level = true, .f_number = NAN}};
    struct bench_time t;
    if (!path) {
        bench_note(r, "no reference photograph: not compared");
        return true;
    }
    b.record = (struct bokeh_record){.channel = "B",
                                     .turn_rad = M_PI / 2,
                                     .m_per_px = 0.07692855304153799e-6,
                                     .sigma_px = 1.874,
                                     .iterations = 30,
                                     .gain_m = 1e-6,
                                     .offset = 1,
                                     .exposure_s = NAN};
    const bool ok = image_read(&b.photo, path, e) && bench_measure(run_bokeh, &b, &t, e);
    if (ok)
        bench_row(r, "bokeh", "reference photograph", t,
                  fabs(b.result.period[0].period_m / 6.2062764749619515e-6 - 1),
                  "first pitch, relative");
    hfield_finish(&b.out);
    image_finish(&b.photo);
    return ok;
}

static bool run(struct bench_report *r, struct err *e)
{
    return simulated(r, e) && reference(r, e);
}

const struct bench bench_bokeh = {"bokeh", "heights from out-of-focus highlights against the truth",
                                  run};
