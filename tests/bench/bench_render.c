// bench_render.c - frames of the shipped scenes, R17's passes beside the default path, tables
// against error.
#define _GNU_SOURCE
#include "core/datapath.h"
#include "core/log.h"
#include "core/mem.h"
#include "process/env_direct.h"
#include "process/factor.h"
#include "render/cpu.h"
#include "render/env_gl.h"
#include "render/gl_render.h"
#include "render/relight.h"
#include "tests/bench/bench.h"
#include "ui/coil.h"
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct stage {
    struct scene scene;
    struct gl_renderer *renderer;
    struct gl_target target;
    struct image cpu;
    // R17's passes
    struct factors factors;
    struct separable how;
    struct image blurred;
};

// The table of a screen: crossed slits, 25 um, in a file for scene_read().
static bool screen_table(const char *path, struct err *e)
{
    struct slits s = {.row = {{.pitch_m = 25e-6, .width_m = 9e-6, .count = 4},
                              {.pitch_m = 25e-6, .width_m = 13e-6, .count = 4}}};
    struct spectrum light = {0};
    struct table t = {0};
    bool ok = illuminant_get(&light, "D65", e) && slits_light(&s, &light, 81, e) &&
              table_init(&t, 257, 0.3, 3, 1, e);
    if (ok) {
        t.is_rgb = true;
#pragma omp parallel for schedule(dynamic, 8)
        for (int k = 0; k < 257 * 257; k++) {
            double rgb[3];
            slits_eval(&s, table_node(&t, k % 257), table_node(&t, k / 257), rgb);
            for (int c = 0; c < 3; c++)
                t.tab[3 * k + c] = (float)rgb[c];
        }
        ok = table_write(&t, path, e);
    }
    slits_finish(&s);
    spectrum_finish(&light);
    table_finish(&t);
    return ok;
}

static bool frame(void *ctx, struct err *e)
{
    struct stage *b = ctx;
    if (!gl_renderer_draw(b->renderer, &b->scene, &b->target, e))
        return false;
    glFinish();
    return true;
}

static double difference(const struct image *a, const struct image *truth)
{
    double sum = 0, all = 0;
    for (size_t k = 0; k < (size_t)a->w * (size_t)a->h * 3; k++) {
        const double d = (double)a->px[k] - (double)truth->px[k];
        sum += d * d;
        all += (double)truth->px[k] * (double)truth->px[k];
    }
    return sqrt(sum / all);
}

// `tables` holds one for every scene, and phone.exr for those that would sum a photograph.
static bool stage_init(struct stage *b, const char *name, const char *tables, int w, int h,
                       struct err *e)
{
    char *file = xasprintf("rigs/scenes/%s.yaml", name), *path = data_path(file, e);
    char *table = xasprintf("%s/%s", tables, strcmp(name, "plane") ? "phone.exr" : "snake.exr");
    const bool instead = !strcmp(name, "laptop") || !strcmp(name, "plane");
    const struct scene_options o = {.table = instead ? table : NULL,
                                    .tables = tables,
                                    .exposure_ev = NAN,
                                    .w = w,
                                    .h = h,
                                    .nodes = 1024};
    *b = (struct stage){0};
    const bool ok = path && scene_read(&b->scene, path, &o, e) &&
                    gl_target_init(&b->target, w, h, e) &&
                    gl_renderer_open(&b->renderer, &b->scene, e);
    free(table);
    free(path);
    free(file);
    return ok;
}

static void stage_finish(struct stage *b)
{
    gl_renderer_close(b->renderer);
    gl_target_finish(&b->target);
    image_finish(&b->cpu);
    image_finish(&b->blurred);
    factors_finish(&b->factors);
    scene_finish(&b->scene);
}

// Both renderers on a small picture: the CPU's takes seconds. Its time comes back as pixels per
// second.
static bool compare_small(struct stage *b, double *error, double *cpu_rate, struct err *e)
{
    enum { W = 240, H = 135 };
    struct gl_target small = {0};
    struct image im = {0};
    b->scene.w = W;
    b->scene.h = H;
    bool ok = gl_target_init(&small, W, H, e) &&
              gl_renderer_draw(b->renderer, &b->scene, &small, e) && gl_target_read(&small, &im, e);
    const double start_s = now_s();
    ok = ok && cpu_render(&b->scene, false, &b->cpu, e);
    *cpu_rate = W * H / (now_s() - start_s);
    if (ok)
        *error = difference(&im, &b->cpu);
    image_finish(&im);
    gl_target_finish(&small);
    return ok;
}

// One scene: GL's frame, and its difference to the CPU's; how many fit into one of R17's.
static bool measure_scene(struct bench_report *r, const char *name, const char *tables, int w,
                          int h, double r17_s, struct err *e)
{
    struct stage b;
    struct bench_time gl;
    double error = 0, cpu_rate = 0;
    bool ok = stage_init(&b, name, tables, w, h, e) && bench_measure(frame, &b, &gl, e);
    const struct gl_work work =
        ok ? gl_renderer_work(b.renderer, &b.scene, &b.target) : (struct gl_work){0};
    ok = ok && compare_small(&b, &error, &cpu_rate, e);
    if (ok) {
        char setting[120];
        snprintf(setting, sizeof setting, "%s %dx%d, skips %.0f %% shading, %.0f %% look-ups", name,
                 w, h, 100 - 100.0 * (double)work.shaded / (double)work.shaded_most,
                 100 - 100.0 * (double)work.looked_up / (double)work.looked_up_most);
        bench_row(r, "gl", setting, gl, error, "relative RMSE against the CPU, 240x135");
        char what[80];
        snprintf(what, sizeof what, "%s", name);
        bench_figure(r, what, 1 / gl.wall_s, "frames per second");
        snprintf(what, sizeof what, "R17's two-pass shader over %s", name);
        bench_figure(r, what, r17_s / gl.wall_s, "times slower");
        snprintf(what, sizeof what, "%s, over the CPU in double", name);
        bench_figure(r, what, w * h / gl.wall_s / cpu_rate, "times as many pixels per second");
    }
    stage_finish(&b);
    return ok;
}

static bool r17_frame(void *ctx, struct err *e)
{
    struct stage *b = ctx;
    image_finish(&b->blurred);
    return env_gl_separable(&b->factors, &b->scene.surround->env, &b->scene.object[0].shape.frame,
                            &b->how, &b->blurred, e) &&
           frame(ctx, e);
}

static bool new_environment(void *ctx, struct err *e)
{
    struct stage *b = ctx;
    image_finish(&b->scene.object[0].seen);
    return scene_prefilter(&b->scene, e) && gl_renderer_surround(b->renderer, &b->scene, e) &&
           frame(ctx, e);
}

enum { VIEWS = 64 };

// Directions to the camera from all over the screen, and what full integration has them see.
static bool judge(struct stage *b, double exact[1], double r17[1], struct err *e)
{
    const struct object *o = &b->scene.object[0];
    double at[VIEWS][2], truth[VIEWS][3], sum[3] = {0};
    struct vec3 wo[VIEWS];
    for (int k = 0; k < VIEWS; k++) {
        const struct vec3 place =
            v3((k % 8 / 7. - .5) * o->shape.width_m, (k / 8 / 7. - .5) * o->shape.height_m, 0);
        const struct vec3 p = v3_add(o->shape.at_m, frame_world(&o->shape.frame, place));
        wo[k] = frame_local(&o->shape.frame, v3_unit(v3_sub(b->scene.camera.eye_m, p)));
        at[k][0] = wo[k].x;
        at[k][1] = wo[k].y;
    }
    const struct fresnel f = {true, o->material.r0};
    if (!env_direct(&o->material.table, &f, &b->scene.surround->env, &o->shape.frame, VIEWS, at,
                    truth, e))
        return false;
    for (int k = 0; k < VIEWS; k++) {
        double one[3], two[3];
        surround_map_at(&o->seen, wo[k], one);
        const struct vec3 mirror = frame_world(&o->shape.frame, v3(-wo[k].x, -wo[k].y, wo[k].z));
        double x, y;
        latlong_pixel(mirror, b->blurred.w, b->blurred.h, &x, &y);
        const size_t px = (size_t)fmax(0, fmin(b->blurred.h - 1, round(y))) * (size_t)b->blurred.w +
                          (size_t)(lround(x) + b->blurred.w) % (size_t)b->blurred.w;
        for (int c = 0; c < 3; c++) {
            two[c] = (double)b->blurred.px[3 * px + (size_t)c];
            one[c] /= o->material.r0 * o->material.gain; // env_direct takes F^2 / F0^2
            sum[0] += (one[c] - truth[k][c]) * (one[c] - truth[k][c]);
            sum[1] += (two[c] - truth[k][c]) * (two[c] - truth[k][c]);
            sum[2] += truth[k][c] * truth[k][c];
        }
    }
    *exact = sqrt(sum[0] / sum[2]);
    *r17 = sqrt(sum[1] / sum[2]);
    return true;
}

// The phone in a room: a look-up per pixel, against R17's two passes over the map in every frame.
static bool measure_r17(struct bench_report *r, const char *tables, int w, int h, double *r17_s,
                        struct err *e)
{
    struct stage b;
    struct bench_time ours, theirs, change;
    double ours_error = 0, their_error = 0;
    const int width = bench_quick(r) ? 512 : 3070;
    bool ok = stage_init(&b, "phone-room", tables, w, h, e) &&
              factor(&b.factors, &b.scene.object[0].material.table, 1, false, false, e);
    b.how = (struct separable){.width = width, .taps = 256, .rotate = true};
    ok = ok && bench_measure(frame, &b, &ours, e) && bench_measure(r17_frame, &b, &theirs, e) &&
         judge(&b, &ours_error, &their_error, e) && bench_measure(new_environment, &b, &change, e);
    if (ok) {
        char setting[80];
        snprintf(setting, sizeof setting, "phone-room, %d x %d map, 256 taps", width, width / 2);
        bench_row(r, "r17", setting, theirs, their_error, "relative RMSE, full integration");
        bench_row(r, "exact map", "phone-room, camera moves", ours, ours_error,
                  "relative RMSE, full integration");
        bench_row(r, "exact map", "phone-room, new environment", change, ours_error,
                  "relative RMSE, full integration");
        bench_figure(r, "R17's two-pass shader over the default path", theirs.wall_s / ours.wall_s,
                     "times slower");
        bench_figure(r, "new environment over camera move", change.wall_s / ours.wall_s, "times");
        *r17_s = theirs.wall_s;
    }
    stage_finish(&b);
    return ok;
}

// A set of L tables with curves in w, made up so that each adds half of the one before.
static bool falling_tables(struct table *t, struct err *e)
{
    enum { L = 8, N = 257, NW = 65 };
    if (!table_init(t, N, 0.5, 1, L, e))
        return false;
    t->is_rgb = true;
    t->basis = TABLE_POD;
    t->w_max = 2;
    t->nw = NW;
    t->curve = xcalloc(L * NW, sizeof *t->curve);
    for (int m = 0; m < L; m++) {
        for (int k = 0; k < NW; k++)
            t->curve[m * NW + k] = cos(m * acos(2.0 * k / (NW - 1) - 1));
        for (int k = 0; k < N * N; k++)
            for (int c = 0; c < 3; c++)
                t->tab[((size_t)m * N * N + (size_t)k) * 3 + (size_t)c] =
                    (float)(exp2(-2 * m) * (1 + sin((m + 2) * 9 * table_node(t, k % N) + c) *
                                                    cos((m + 1) * 7 * table_node(t, k / N))));
    }
    return true;
}

static bool measure_counts(struct bench_report *r, const char *tables, int w, int h, struct err *e)
{
    struct stage b;
    struct image all = {0}, some = {0};
    bool ok = stage_init(&b, "plane", tables, w, h, e) && frame(&b, e) &&
              gl_target_read(&b.target, &all, e);
    const int n = ok ? b.scene.object[0].material.table.count : 0;
    for (int count = 1; ok && count <= n; count++) {
        struct bench_time time;
        char setting[60];
        b.scene.object[0].material.tables_used = count;
        ok = bench_measure(frame, &b, &time, e) && gl_target_read(&b.target, &some, e);
        if (ok) {
            snprintf(setting, sizeof setting, "L = %d of %d tables, %dx%d", count, n, w, h);
            bench_row(r, "tables", setting, time, difference(&some, &all),
                      "relative RMSE against all tables");
        }
        image_finish(&some);
    }
    image_finish(&all);
    stage_finish(&b);
    return ok;
}

// A photograph at 530 nm of the screen that screen_table() has.
static struct photo *screen_photo(struct err *e)
{
    enum { SIDE = 1001 };
    const double h_per_px = 7.2e-4, lambda_m = 530e-9;
    const struct multislit across = {.pitch_m = 25e-6, .width_m = 9e-6, .count = 4},
                           down = {.pitch_m = 25e-6, .width_m = 13e-6, .count = 4};
    struct photo *p = xcalloc(1, sizeof *p);
    struct image im;
    p->request = (struct lut_request){.lambda_m = lambda_m,
                                      .f0 = 0.2,
                                      .exponent = 2,
                                      .n = 501,
                                      .range = 0.25,
                                      .power = 3,
                                      .is_rgb = true,
                                      .tolerance = 1e-4};
    if (!image_init(&im, SIDE, SIDE, 1, e))
        return NULL;
    double row[SIDE], column[SIDE];
    for (int k = 0; k < SIDE; k++) {
        row[k] = multislit_power(&across, (k - SIDE / 2) * h_per_px, lambda_m);
        column[k] = multislit_power(&down, (k - SIDE / 2) * h_per_px, lambda_m);
    }
    for (int k = 0; k < SIDE * SIDE; k++)
        im.px[k] = (float)(row[k % SIDE] * column[k / SIDE]);
    const bool ok = lut_pattern_init(&p->pattern, &im, 0, 1, e);
    image_finish(&im);
    p->pattern.cx = p->pattern.cy = SIDE / 2;
    p->pattern.h_per_px = h_per_px;
    return ok ? p : NULL;
}

// The table in the place of the scene's, by direct sampling of many wavelengths.
static bool sampled_table(const struct photo *p, struct table *t, struct err *e)
{
    struct spectrum light;
    struct lut_report report;
    struct lut_request r = p->request;
    r.method = LUT_SAMPLED;
    r.wavelengths = 401;
    r.pattern = &p->pattern;
    r.light = &light;
    const bool ok = illuminant_get(&light, "A", e) && lut_build(&r, t, &report, e);
    if (ok)
        spectrum_finish(&light);
    return ok;
}

static double table_difference(const struct table *a, const struct table *truth)
{
    struct image x = {.w = a->n, .h = a->n, .nc = 3, .px = a->tab};
    struct image y = {.w = a->n, .h = a->n, .nc = 3, .px = truth->tab};
    return difference(&x, &y);
}

// Another light while frames go on: until the table is whole, and the slowest frame meanwhile.
static bool measure_relight(struct bench_report *r, const char *tables, int w, int h, struct err *e)
{
    struct stage b;
    struct bench_time alone, whole = {.runs = 1};
    struct relight *light = NULL;
    struct table truth = {0};
    double slowest = 0;
    bool ok = stage_init(&b, "phone", tables, w, h, e);
    struct material *m = ok ? &b.scene.object[0].material : NULL;
    ok = ok && (m->photo = screen_photo(e)) && sampled_table(m->photo, &truth, e) &&
         bench_measure(frame, &b, &alone, e) && relight_open(&light, &b.scene, "A", e);
    const double start = now_s();
    while (ok && !relight_done(light, e)) {
        const double began = now_s();
        if (relight_take(light, &b.scene))
            ok = gl_renderer_materials(b.renderer, &b.scene, e);
        ok = ok && frame(&b, e);
        slowest = fmax(slowest, now_s() - began);
    }
    whole.wall_s = now_s() - start;
    relight_close(light);
    if (ok && e->code == ERR_NONE) {
        bench_row(r, "relight", "phone, illuminant A, 501 nodes, frames go on", whole,
                  table_difference(&m->table, &truth), "relative L2, 401 wavelengths sampled");
        bench_figure(r, "frame alone", 1e3 * alone.wall_s, "ms");
        bench_figure(r, "slowest frame while the light changes", 1e3 * slowest, "ms");
    }
    table_finish(&truth);
    stage_finish(&b);
    return ok;
}

// Stand-ins for the tables that the gallery makes: the work is that of any of their size.
static bool make_tables(const char *folder, struct err *e)
{
    static const char *const names[] = {"phone-fine", "holographic", "tv", "blazed", "cd"};
    struct table falling;
    char *phone = xasprintf("%s/phone.exr", folder), *snake = xasprintf("%s/snake.exr", folder);
    char *coil = xasprintf("%s/snake.obj", folder);
    bool ok = screen_table(phone, e) && falling_tables(&falling, e);
    if (ok) {
        ok = table_write(&falling, snake, e) && coil_write(coil, e);
        table_finish(&falling);
    }
    for (size_t k = 0; ok && k < sizeof names / sizeof *names; k++) {
        char *link = xasprintf("%s/%s.exr", folder, names[k]);
        ok = !symlink("phone.exr", link) || err_errno(e, "%s", link);
        free(link);
    }
    free(phone);
    free(snake);
    free(coil);
    return ok;
}

static void drop_tables(const char *folder)
{
    struct dirent **list = NULL;
    const int n = scandir(folder, &list, NULL, NULL);
    for (int k = 0; k < n; k++) {
        char *path = xasprintf("%s/%s", folder, list[k]->d_name);
        unlink(path);
        free(path);
        free(list[k]);
    }
    free(list);
    rmdir(folder);
}

static bool run(struct bench_report *r, struct err *e)
{
    static const char *const scenes[] = {
        "phone",   "cd",          "phone-room",       "plane",        "cylinder",
        "cd-g04",  "cd-room",     "radial",           "tv",           "phone-fine",
        "laptop",  "holographic", "blazed",           "cd-heights",   "led-array",
        "tv-room", "snake",       "holographic-room", "radial-whole", "phone-room-turned"};
    const bool quick = bench_quick(r);
    const size_t n = quick ? 3 : sizeof scenes / sizeof *scenes;
    const int w = quick ? 480 : 1920, h = quick ? 270 : 1080;
    char folder[] = "/tmp/nacre_bench_XXXXXX";
    struct gl_context *gl = NULL;
    double r17_s = NAN;
    if (!gl_context_open(&gl, e)) {
        bench_note(r, "%s", e->msg);
        return true;
    }
    bench_note(r, "OpenGL: %s", gl_name());
    bool ok = mkdtemp(folder) || err_errno(e, "%s", folder);
    ok = ok && make_tables(folder, e) && measure_r17(r, folder, w, h, &r17_s, e);
    for (size_t k = 0; ok && k < n; k++)
        ok = measure_scene(r, scenes[k], folder, w, h, r17_s, e);
    ok = ok && measure_counts(r, folder, w, h, e) && measure_relight(r, folder, w, h, e);
    drop_tables(folder);
    gl_context_close(gl);
    return ok;
}

const struct bench bench_render = {
    "render", "frames of the scenes, R17's passes beside the default path, tables against error",
    run};
