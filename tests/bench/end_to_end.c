// end_to_end.c - the files and commands of a simulated laboratory.
#define _GNU_SOURCE
#include "tests/bench/end_to_end.h"
#include "core/geom.h"
#include "core/mem.h"
#include "core/outfile.h"
#include "ui/child.h"
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const int e2e_filter_nm[E2E_FILTERS] = {440, 490, 540, 600, 660};

// The camera 25 cm above the sample, an LED's tip beside it: a field of +-40 degrees of h.
static const char optics[] =
    "kind: camera, width: 1000, height: 1000, camera: [0m, 0m, 0.25m], target: [0m, 0m, 0m], "
    "light: [15mm, 0m, 0.25m], light-diameter: 0m, light-beam: 0, focal: 6mm, pixel: 5um, "
    "distortion: [-0.08, 0.01, 0, 0, 0]";
static const char flaws[] =
    ", vignetting: [-0.1, 0], defocus: 0.3px, glare: 0.001, glare-radius: 60px";
static const char no_flaws[] = ", natural-vignetting: false";

bool e2e_do(const char *folder, double *wall_s, struct err *e, const char *fmt, ...)
{
    char *words = NULL;
    struct child c = {0};
    va_list ap;
    va_start(ap, fmt);
    if (vasprintf(&words, fmt, ap) < 0)
        abort();
    va_end(ap);
    char *quiet = xasprintf("%s --json --quiet", words);
    bool ok = child_run_in(folder, quiet, &c, e);
    if (ok && c.status)
        ok = err_set(e, ERR_DATA, "nacre %.180s: exit %d", words, c.status);
    *wall_s += c.wall_s;
    child_finish(&c);
    free(quiet);
    free(words);
    return ok;
}

static bool put(const char *folder, const char *name, const char *suffix, struct err *e,
                const char *fmt, ...) __attribute__((format(printf, 5, 6)));
static bool put(const char *folder, const char *name, const char *suffix, struct err *e,
                const char *fmt, ...)
{
    char *text = NULL, *path = xasprintf("%s/%s%s.yaml", folder, name, suffix);
    va_list ap;
    va_start(ap, fmt);
    const int size = vasprintf(&text, fmt, ap);
    va_end(ap);
    const bool ok = size >= 0 && outfile_write(path, text, (size_t)size, e);
    free(text);
    free(path);
    return ok;
}

static bool put_rig(const char *folder, const char *name, double irradiance, struct err *e)
{
    char filters[1000] = "";
    for (int k = 0; k < E2E_FILTERS; k++)
        snprintf(filters + strlen(filters), sizeof filters - strlen(filters),
                 "    - {name: f%d, position: %d, centre: %dnm, width: 10nm, throughput: 0.05}\n",
                 e2e_filter_nm[k], k, e2e_filter_nm[k]);
    return put(folder, name, "-rig", e,
               "name: end to end\nsample: %s\n"
               "camera: {uri: 'sim:scene=%s.yaml,rig=@rig,world=@run,grace=0', gain: 1, bits: 12, "
               "black: 256, responsivity: 4e5}\n"
               "lights:\n  trigger: 'sim:lines=1,world=@run'\n"
               "  list: [{name: led, line: 0, irradiance: %g, centre: 560nm, width: 180nm, "
               "max_on: 60s, max_duty: 1, lead: 500us, lag: 500us}]\n"
               "filters:\n  trigger: 'sim:positions=6,world=@run'\n  list:\n%s"
               "    - {name: open, position: %d}\n",
               name, name, irradiance, filters, E2E_FILTERS);
}

// A scene, its rig, a session of it, and the picture that comes of it.
static bool shoot(const char *folder, const char *name, const char *plan, double irradiance,
                  struct err *e, double *wall_s)
{
    return put_rig(folder, name, irradiance, e) &&
           e2e_do(folder, wall_s, e, "capture --rig %s-rig.yaml --plan %s.yaml -o %s.s", name, plan,
                  name);
}

static bool shoot_target(const char *folder, const char *name, const char *flat, struct err *e,
                         double *wall_s)
{
    return shoot(folder, name, "still", 10, e, wall_s) &&
           e2e_do(folder, wall_s, e, "hdr %s.s %s -o %s.exr", name, flat, name);
}

static bool shoot_boards(const char *folder, double *wall_s, struct err *e)
{
    static const double pose[][5] = {{0, 0, 0, 0, 0},           {-.01, -.01, .02, .4, .1},
                                     {.01, -.01, 0, -.1, .4},   {-.01, .01, .03, .3, -.4},
                                     {.01, .01, .02, -.4, -.2}, {0, 0, .04, .5, .3}};
    bool ok = true;
    for (int k = 0; ok && k < 6; k++) {
        const double *p = pose[k];
        char name[20];
        snprintf(name, sizeof name, "board%d", k);
        ok = put(folder, name, "", e,
                 "target: board\nboard: {squares: [10, 7], square: 16mm}\nsample: {kind: flat}\n"
                 "view: {%s%s, sample: [%gm, %gm, %gm], normal: [%g, %g, 1]}\n",
                 optics, flaws, p[0], p[1], p[2], p[3], p[4]) &&
             shoot_target(folder, name, "--flat flat.yaml", e, wall_s);
    }
    return ok;
}

static bool shoot_balls(const char *folder, double *wall_s, struct err *e)
{
    static const double at[][3] = {
        {-.05, -.04, .02}, {.05, .04, .05}, {.04, -.05, .01}, {-.04, .05, .06}};
    bool ok = true;
    for (int k = 0; ok && k < 4; k++) {
        char name[20];
        snprintf(name, sizeof name, "ball%d", k);
        ok = put(folder, name, "", e,
                 "target: ball\nball: {at: [%gm, %gm, %gm], radius: 24mm}\nsample: {kind: flat}\n"
                 "view: {%s%s}\n",
                 at[k][0], at[k][1], at[k][2], optics, flaws) &&
             shoot_target(folder, name, "--flat flat.yaml", e, wall_s);
    }
    return ok;
}

bool e2e_calibrate(const char *folder, double *wall_s, struct err *e)
{
    bool ok = put(folder, "still", "", e,
                  "name: still\nlights: [led]\nfilters: [open]\n"
                  "exposures: {meter: 1ms, step: 2.5, span: 5}\ndarks: 1\n") &&
              put(folder, "even", "", e, "target: even\nsample: {kind: flat}\nview: {%s%s}\n",
                  optics, flaws) &&
              shoot_target(folder, "even", "", e, wall_s) &&
              e2e_do(folder, wall_s, e, "calib flat even.exr -o flat.yaml") &&
              shoot_boards(folder, wall_s, e) && shoot_balls(folder, wall_s, e) &&
              e2e_do(folder, wall_s, e,
                     "calib lens board0.exr board1.exr board2.exr board3.exr board4.exr board5.exr "
                     "--board 9x6 --square 16mm --plane board0.exr -o lens.yaml") &&
              e2e_do(folder, wall_s, e,
                     "calib light ball0.exr ball1.exr ball2.exr ball3.exr --lens lens.yaml "
                     "--radius 24mm -o light.yaml");
    for (int k = 0; ok && k < E2E_FILTERS; k++)
        ok = e2e_do(folder, wall_s, e,
                    "calib spectral even-rig.yaml --light led --filter f%d -o f%d.yaml",
                    e2e_filter_nm[k], e2e_filter_nm[k]);
    return ok;
}

static bool put_sample(const char *folder, const struct e2e_sample *s, const char *suffix,
                       const char *lens, struct err *e)
{
    return put(folder, s->name, suffix, e,
               "sample: %s\nsensor: {blooming: 0}\nview: {%s%s, size: [%gm, %gm]}\n", s->sample,
               optics, lens, s->size_m, s->size_m);
}

bool e2e_capture(const char *folder, const struct e2e_sample *s, double *wall_s, struct err *e)
{
    char filters[100] = "";
    for (int k = 0; k < E2E_FILTERS; k++)
        snprintf(filters + strlen(filters), sizeof filters - strlen(filters), "%sf%d",
                 k ? ", " : "", e2e_filter_nm[k]);
    return put(folder, "bands", "", e,
               "name: bands\nlights: [led]\nfilters: [%s]\n"
               "exposures: {first: 10us, last: 163.84ms, step: 2}\ndarks: 1\n",
               filters) &&
           put_sample(folder, s, "", flaws, e) &&
           shoot(folder, s->name, "bands", s->irradiance, e, wall_s);
}

bool e2e_merge(const char *folder, const struct e2e_sample *s, double *wall_s, struct err *e)
{
    bool ok = true;
    for (int k = 0; ok && k < E2E_FILTERS; k++)
        ok = e2e_do(folder, wall_s, e, "hdr %s.s --filter f%d --flat flat.yaml -o %s-f%d.exr",
                    s->name, e2e_filter_nm[k], s->name, e2e_filter_nm[k]);
    return ok;
}

bool e2e_ideal(const char *folder, const struct e2e_sample *s, struct err *e)
{
    char *name = xasprintf("%s-ideal", s->name);
    double wall_s = 0;
    bool ok =
        put_sample(folder, s, "-ideal", no_flaws, e) && put_rig(folder, name, s->irradiance, e);
    for (int k = 0; ok && k < E2E_FILTERS; k++)
        ok = e2e_do(folder, &wall_s, e,
                    "simulate %s-rig.yaml --what pattern --filter f%d -o %s-f%d.exr", name,
                    e2e_filter_nm[k], name, e2e_filter_nm[k]);
    free(name);
    return ok;
}

bool e2e_eye(const char *folder, const struct e2e_sample *s, struct err *e)
{
    const struct vec3 light = v3(-4e-3, 4e-3, 0.24);
    const double r = v3_norm(light), fov_rad = 45 * M_PI / 180;
    // of irradiance 1 on the sample at the origin, as the simulator's picture is
    return put(folder, s->name, "-scene", e,
               "camera: {eye: [12mm, -18mm, 0.22m], target: [0, 0, 0], fov: 45deg}\n"
               "size: [320, 240]\n"
               "lights: [{at: [%.17g, %.17g, %.17g], intensity: %.17g}]\n"
               "sample: {shape: %s, table: %s-table.exr, r0: %g}\n",
               light.x, light.y, light.z, r * r * r / light.z, s->shape, s->name, s->r0) &&
           put(folder, s->name, "-eye", e,
               "sample: %s\n"
               "view: {kind: camera, width: 320, height: 240, camera: [12mm, -18mm, 0.22m], "
               "target: [0m, 0m, 0m], light: [%.17gm, %.17gm, %.17gm], light-diameter: 0m, "
               "light-beam: 0, natural-vignetting: false, focal: %.17gm, pixel: 10um, "
               "size: [%gm, %gm]}\n",
               s->sample, light.x, light.y, light.z, 120 / tan(fov_rad / 2) * 10e-6, s->size_m,
               s->size_m);
}
