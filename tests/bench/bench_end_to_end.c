// bench_end_to_end.c - from a simulated sample to its rendered picture, against the picture that
// the simulator makes of the sample's own relief, and the share of each stage.
//
// A stage is replaced by truth and the rest stays as it is: what the error then is without. The
// error is the relative L2 difference of linear radiance where the table covers the picture.
#define _GNU_SOURCE
#include "core/imgfile.h"
#include "core/mem.h"
#include "core/spectrum.h"
#include "core/table.h"
#include "process/table_spline.h"
#include "tests/bench/bench.h"
#include "tests/bench/end_to_end.h"
#include <ftw.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NODES = 1001 };

static const struct e2e_sample samples[] = {
    {"phone", "{kind: lcd, pitch: 25um, r0: 0.04}", 0.2, 0.04, "--size 200mm,200mm",
     "plane, size: [200mm, 200mm]", 0.3, 10},
    {"cd", "{kind: cd, pitch: 1.6um, pit: 0.5um, r0: 0.9, hub: 22mm}", 0.116, 0.9,
     "--size 116mm,116mm --tangents radial --hub 22mm", "disc, radius: 58mm, inner: 22mm", 0.45, 1},
    {"grating", "{kind: blazed, lines: 600/mm, blaze: 13deg, r0: 0.9}", 0.2, 0.9,
     "--size 200mm,200mm", "plane, size: [200mm, 200mm]", 0.45, 1},
    {"holographic", "{kind: holographic, pitch: 1.2um, depth: 150nm, r0: 0.8}", 0.2, 0.8,
     "--size 200mm,200mm", "plane, size: [200mm, 200mm]", 0.5, 1},
};

struct job {
    struct bench_report *report;
    const char *folder;
    const struct e2e_sample *s;
    struct image truth, eye; // the true picture; u, v, w, weight of its pixels
    float *cover;            // [h][w] 1 where the table as measured covers a pixel
    struct bench_time took;
};

static bool read(const struct job *j, const char *suffix, struct image *im, struct err *e)
{
    char *path = xasprintf("%s/%s%s.exr", j->folder, j->s->name, suffix);
    const bool ok = image_read(im, path, e);
    free(path);
    return ok;
}

static bool read_table(const struct job *j, struct table *t, struct err *e)
{
    char *path = xasprintf("%s/%s-table.exr", j->folder, j->s->name);
    const bool ok = table_read(t, path, NULL, e);
    free(path);
    return ok;
}

static bool make_table(struct job *j, const char *pictures, const char *geometry, double scale,
                       struct err *e)
{
    char files[1000] = "", bands[200] = "";
    for (int k = 0; k < E2E_FILTERS; k++) {
        snprintf(files + strlen(files), sizeof files - strlen(files), " %s%s-f%d.exr", j->s->name,
                 pictures, e2e_filter_nm[k]);
        snprintf(bands + strlen(bands), sizeof bands - strlen(bands), "%sf%d.yaml", k ? "," : "",
                 e2e_filter_nm[k]);
    }
    return e2e_do(j->folder, &j->took.wall_s, e,
                  "lut%s --band %s --deband --geometry %s-%s.exr --scale %.17g --illuminant E "
                  "--f0 %.17g --size %d --range %g -o %s-table.exr",
                  files, bands, j->s->name, geometry, scale, sqrt(j->s->r0), NODES, j->s->range,
                  j->s->name);
}

static bool render(struct job *j, struct image *out, struct err *e)
{
    return e2e_do(j->folder, &j->took.wall_s, e,
                  "render %s-scene.yaml --backend cpu --samples 1 -o %s-render.exr", j->s->name, j->s->name) &&
           read(j, "-render", out, e);
}

// The table that was measured, read as exactly as it can be: what a perfect renderer makes of it.
static bool render_truly(const struct job *j, struct image *out, struct err *e)
{
    struct table t = {0};
    struct table_spline s = {0};
    bool ok = read_table(j, &t, e) && table_spline_init(&s, &t, e) &&
              image_init(out, j->truth.w, j->truth.h, 3, e);
    for (int k = 0; ok && k < out->w * out->h; k++) {
        const float *at = j->eye.px + 4 * (size_t)k;
        double xyz[3], rgb[3];
        if (isnan(at[3]))
            continue;
        table_spline_at(&s, (double)at[0], (double)at[1], (double)at[2], 0, xyz);
        xyz_to_rgb(xyz, rgb); // f E = 4 pi^2 F^2 G E S_d, and weight = F0^2 / (F^2 G E)
        for (int c = 0; c < 3; c++)
            out->px[3 * k + c] =
                (float)(4 * M_PI * M_PI * j->s->r0 / (double)at[3] * (t.is_rgb ? xyz[c] : rgb[c]));
    }
    table_spline_finish(&s);
    table_finish(&t);
    return ok;
}

// 1 where all nodes around a pixel's (u, v) are covered.
static bool find_cover(struct job *j, struct err *e)
{
    struct table t = {0};
    if (!read_table(j, &t, e))
        return false;
    j->cover = xcalloc((size_t)j->truth.w * (size_t)j->truth.h, sizeof *j->cover);
    for (int k = 0; k < j->truth.w * j->truth.h; k++) {
        const float *at = j->eye.px + 4 * (size_t)k;
        const double x = table_index(&t, (double)at[0]), y = table_index(&t, (double)at[1]);
        if (!(x >= 0 && y >= 0))
            continue;
        const int i = (int)fmin(x, t.n - 2), l = (int)fmin(y, t.n - 2);
        const float *c = t.cover + (size_t)l * (size_t)t.n + (size_t)i;
        j->cover[k] = fminf(fminf(c[0], c[1]), fminf(c[t.n], c[t.n + 1]));
    }
    table_finish(&t);
    return true;
}

// Over the covered pixels with |h| >= from.
static double error_of(const struct job *j, const struct image *got, double from)
{
    double diff = 0, norm = 0;
    for (int k = 0; k < got->w * got->h; k++) {
        const float *at = j->eye.px + 4 * (size_t)k;
        if (!(j->cover[k] > 0) || !(hypot((double)at[0], (double)at[1]) >= from))
            continue;
        for (int c = 0; c < 3; c++) {
            const double want = (double)j->truth.px[3 * k + c];
            const double d = (double)got->px[(size_t)k * (size_t)got->nc + (size_t)c] - want;
            diff += d * d;
            norm += want * want;
        }
    }
    return sqrt(diff / norm);
}

static double covered_light(const struct job *j)
{
    double all = 0, covered = 0;
    for (int k = 0; k < j->truth.w * j->truth.h; k++)
        for (int c = 0; c < 3; c++) {
            const double v = fmax(0, (double)j->truth.px[3 * k + c]);
            all += v;
            covered += j->cover[k] > 0 ? v : 0;
        }
    return covered / all;
}

static void row(struct job *j, const char *what, const struct image *got)
{
    bench_row(j->report, j->s->name, what, j->took, error_of(j, got, 0),
              "relative L2 of linear radiance where the table covers the picture");
}

static bool judge(struct job *j, const char *what, struct err *e)
{
    struct image got = {0};
    const bool ok = render(j, &got, e);
    if (ok)
        row(j, what, &got);
    image_finish(&got);
    return ok;
}

// All stages as they are, then each one replaced.
static bool stages(struct job *j, struct err *e)
{
    struct image got = {0};
    char text[80];
    const double irradiance = 0.05 * j->s->irradiance; // through a filter
    bool ok = make_table(j, "", "geometry", 1, e) && find_cover(j, e) && render(j, &got, e);
    if (ok) {
        row(j, "all stages measured", &got);
        snprintf(text, sizeof text, "%s: error outside the mirror's lobe", j->s->name);
        bench_figure(j->report, text, 100 * error_of(j, &got, 0.017), "%");
        snprintf(text, sizeof text, "%s: light of the picture that the table covers", j->s->name);
        bench_figure(j->report, text, 100 * covered_light(j), "%");
    }
    image_finish(&got);
    j->took = (struct bench_time){.runs = 1};
    if (ok && (ok = render_truly(j, &got, e)))
        row(j, "... with a perfect renderer", &got);
    image_finish(&got);
    ok = ok && make_table(j, "", "geometry-true", 1, e) && judge(j, "... true calibration", e);
    j->took.wall_s = 0;
    if (ok && !bench_quick(j->report))
        ok = e2e_ideal(j->folder, j->s, e) &&
             make_table(j, "-ideal", "geometry", 1 / irradiance, e) &&
             judge(j, "... true radiance for capture and hdr", e);
    j->took.wall_s = 0;
    ok = ok &&
         e2e_do(j->folder, &j->took.wall_s, e,
                "simulate %s-eye.yaml --what picture --table-of %s.yaml -o %s-perfect.exr",
                j->s->name, j->s->name, j->s->name) &&
         read(j, "-perfect", &got, e);
    if (ok)
        row(j, "... a true table, perfectly rendered", &got);
    image_finish(&got);
    return ok;
}

static bool measure(struct job *j, struct err *e)
{
    const char *name = j->s->name;
    double ignored = 0;
    bench_task(j->report, name);
    j->took = (struct bench_time){.runs = 1};
    bool ok = e2e_eye(j->folder, j->s, e) && e2e_capture(j->folder, j->s, &j->took.wall_s, e) &&
              e2e_merge(j->folder, j->s, &j->took.wall_s, e) &&
              e2e_do(j->folder, &j->took.wall_s, e,
                     "calib geometry lens.yaml --light light.yaml --fresnel schlick --r0 %g %s -o "
                     "%s-geometry.exr",
                     j->s->r0, j->s->geometry, name) &&
              e2e_do(j->folder, &ignored, e,
                     "simulate %s.yaml --what geometry -o %s-geometry-true.exr", name, name) &&
              e2e_do(j->folder, &ignored, e, "simulate %s-eye.yaml --what picture -o %s-truth.exr",
                     name, name) &&
              e2e_do(j->folder, &ignored, e, "simulate %s-eye.yaml --what geometry -o %s-eye.exr",
                     name, name) &&
              read(j, "-truth", &j->truth, e) && read(j, "-eye", &j->eye, e) && stages(j, e);
    free(j->cover);
    image_finish(&j->truth);
    image_finish(&j->eye);
    return ok;
}

static int remove_one(const char *path, const struct stat *st, int type, struct FTW *ftw)
{
    (void)st;
    (void)type;
    (void)ftw;
    return remove(path);
}

static bool run(struct bench_report *r, struct err *e)
{
    char folder[] = "nacre-end-to-end-XXXXXX";
    double wall_s = 0;
    if (!mkdtemp(folder))
        return err_errno(e, "%s", folder);
    bool ok = e2e_calibrate(folder, &wall_s, e);
    bench_figure(r, "calibration shots and records of the rig, once", wall_s, "s");
    const int n = bench_quick(r) ? 1 : (int)(sizeof samples / sizeof *samples);
    for (int k = 0; ok && k < n; k++) {
        struct job j = {.report = r, .folder = folder, .s = &samples[k]};
        ok = measure(&j, e) || err_in(e, "%s", samples[k].name);
    }
    nftw(folder, remove_one, 16, FTW_DEPTH | FTW_PHYS);
    return ok;
}

extern const struct bench bench_end_to_end;
const struct bench bench_end_to_end = {
    .name = "end-to-end",
    .summary = "from a simulated sample to its rendered picture, and the share of each stage",
    .run = run,
};
