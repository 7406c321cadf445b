// sim_cam.c - "sim:SCENE.yaml": a camera that photographs a simulated world.
//
// A thread waits for each exposure to pass (or, on the virtual clock, skips what is left of it
// after `grace`), then looks up when which light was on and makes the counts. Finished frames wait
// behind an eventfd for pump().
#define _GNU_SOURCE
#include "core/mem.h"
#include "sim/sensor.h"
#include "sim/sim.h"
#include "sim/world.h"
#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <time.h>
#include <unistd.h>

enum { QUEUE = 8, LAYERS = 8, SETTLE = 4 };

struct job {
    struct cam_shot shot;
    struct cam_frame frame;
    uint16_t *raw; // [h][w], owned
    struct err err;
};

struct sim {
    struct cam base;
    char *scene, *rig, *world_name;
    int w, h, seed, realtime, settle;
    int64_t grace_ns, dead_ns;

    struct lab lab;
    struct sensor sensor;
    struct world *world;
    double *seconds; // [LAYERS + 1][h] light of each layer by row, and of one too many
    uint64_t seq;
    double focus_per_m;                // NAN: as it was found
    struct cam_shot asked[SETTLE + 1]; // the last shots, newest first: settings land `settle` late
    pthread_t thread;
    bool running;

    pthread_mutex_t mutex; // guards what follows
    pthread_cond_t wake;
    bool quit;
    int waiting,
        finished; // jobs [0, finished) can be delivered, [finished, waiting) are to be made
    struct job job[QUEUE];
};

// Waits until the world's clock is at `until_ns`, or for `at_most_ns`; false when told to quit.
static bool wait_until(struct sim *s, int64_t until_ns, int64_t at_most_ns)
{
    const int64_t from = world_now_ns(s->world);
    int64_t left = until_ns - from < at_most_ns ? until_ns - from : at_most_ns;
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    left += t.tv_nsec;
    t.tv_sec += left / 1000000000;
    t.tv_nsec = left % 1000000000;
    pthread_mutex_lock(&s->mutex);
    int rc = left > 0 ? 0 : ETIMEDOUT;
    while (!s->quit && rc != ETIMEDOUT)
        rc = pthread_cond_timedwait(&s->wake, &s->mutex, &t);
    const bool go_on = !s->quit;
    pthread_mutex_unlock(&s->mutex);
    return go_on;
}

// The light that reaches the rows of a frame, as layers; without triggers line 0 is always on.
static int collect_light(struct sim *s, const struct cam_frame *f, struct sensor_layer *layers,
                         struct err *e)
{
    struct world_state state;
    const int64_t row_ns = s->base.caps.row_ns;
    int n = 0;
    world_read(s->world, &state);
    lab_focus(&s->lab, f->focus_per_m);
    for (int line = 0; line < (state.has_lights ? LAB_LINES : 1); line++)
        for (int p = 0; p < (state.has_filters ? LAB_POSITIONS : 1); p++) {
            double *seconds = s->seconds + (size_t)n * (size_t)f->h, sum = 0;
            for (int j = 0; j < f->h; j++) {
                const int64_t from = f->device_ns + j * row_ns, to = from + f->exposure_ns;
                seconds[j] = world_lit_s(&state, line, state.has_filters ? p : -1, from, to);
                sum += seconds[j];
            }
            if (!(sum > 0))
                continue;
            const struct image *im;
            if (n == LAYERS) {
                err_set(e, ERR_DEVICE, "more than %d lights and filters in one frame", LAYERS);
                return -1;
            }
            if (!lab_photo(&s->lab, line, p, &im, e))
                return -1;
            layers[n++] = (struct sensor_layer){im->px, seconds};
        }
    return n;
}

static void make_frame(struct sim *s, struct job *job)
{
    struct cam_frame *f = &job->frame;
    const struct cam_caps *caps = &s->base.caps;
    struct sensor_layer layers[LAYERS];
    f->device_ns = world_now_ns(s->world);
    const int64_t end_ns = f->device_ns + (f->h - 1) * caps->row_ns + f->exposure_ns;
    if (!wait_until(s, end_ns, s->realtime ? INT64_MAX : s->grace_ns))
        return;
    const int n = collect_light(s, f, layers, &job->err);
    const size_t count = (size_t)f->w * (size_t)f->h;
    if (n >= 0 && (job->raw = sample_alloc(count, sizeof *job->raw, "frame", &job->err)))
        sensor_expose(&s->sensor, layers, n, (double)f->exposure_ns * 1e-9, f->gain, f->seq,
                      job->raw);
    f->raw = job->raw;
    if (!s->realtime)
        world_skip(s->world, end_ns - world_now_ns(s->world));
}

static void *work(void *arg)
{
    struct sim *s = arg;
    pthread_mutex_lock(&s->mutex);
    while (!s->quit) {
        if (s->finished == s->waiting) {
            pthread_cond_wait(&s->wake, &s->mutex);
            continue;
        }
        struct job job = s->job[s->finished];
        pthread_mutex_unlock(&s->mutex);
        make_frame(s, &job);
        pthread_mutex_lock(&s->mutex);
        s->job[s->finished++] = job; // pump() may have moved the queue: finished moved with it
        eventfd_write(s->base.fd, 1);
    }
    pthread_mutex_unlock(&s->mutex);
    return NULL;
}

static void fill_caps(struct sim *s)
{
    const struct sim_sensor *sensor = &s->lab.scene.sensor;
    struct cam_caps *c = &s->base.caps;
    snprintf(c->model, sizeof c->model, "simulated"); // whatever lies under it
    snprintf(c->serial, sizeof c->serial, "sim-%d", s->seed);
    c->w = s->lab.scene.view.w;
    c->h = s->lab.scene.view.h;
    c->bits = sensor->bits;
    c->black = sensor->black;
    c->pattern = sensor->bayer ? CAM_RGGB : CAM_MONO;
    c->clock = CAM_CLOCK_BOOT;
    c->exposure_min_ns = llround(sensor->exposure_min_s * 1e9);
    c->exposure_max_ns = llround(sensor->exposure_max_s * 1e9);
    c->exposure_step_ns = llround(sensor->exposure_step_s * 1e9);
    c->gain_min = 1;
    c->gain_max = 16;
    c->row_ns = llround(sensor->row_s * 1e9);
    c->dead_ns = s->dead_ns;
    c->settle = s->settle;
    c->focus_max_per_m = 2 * s->lab.scene.bokeh.focus_per_m;
    s->focus_per_m = NAN;
}

static bool check_lights(const struct lab *lab, struct err *e)
{
    bool ok = true;
    for (int l = 0; ok && l < lab->rig.n_lights; l++)
        for (int f = 0; ok && f < lab->rig.n_filters; f++) {
            struct band b = {0};
            ok = lab_band(lab, lab->rig.light[l].line, lab->rig.filter[f].position, &b, e);
            band_finish(&b);
        }
    return ok;
}

static bool sim_open(struct cam *cam, struct err *e)
{
    struct sim *s = (struct sim *)cam;
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&s->wake, &monotonic);
    pthread_condattr_destroy(&monotonic);
    pthread_mutex_init(&s->mutex, NULL);
    if (!lab_open(&s->lab, s->scene, s->rig, e) || !check_lights(&s->lab, e))
        return false;
    struct sim_scene *scene = &s->lab.scene;
    if (s->w || s->h)
        view_resize(&scene->view, s->w, s->h);
    fill_caps(s);
    if (!sensor_init(&s->sensor, &scene->sensor, scene->view.w, scene->view.h, (uint64_t)s->seed,
                     e))
        return false;
    s->seconds = xcalloc((LAYERS + 1) * (size_t)scene->view.h, sizeof *s->seconds);
    if (!(s->world = world_open(s->world_name, e)))
        return false;
    cam->fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    if (cam->fd < 0)
        return err_errno(e, "eventfd");
    const int rc = pthread_create(&s->thread, NULL, work, s);
    s->running = rc == 0;
    return s->running || err_set(e, ERR_DEVICE, "no thread: %s", strerror(rc));
}

static bool sim_shoot(struct cam *cam, const struct cam_shot *shot, struct err *e)
{
    struct sim *s = (struct sim *)cam;
    const struct cam_caps *c = &cam->caps;
    memmove(s->asked + 1, s->asked, SETTLE * sizeof *s->asked);
    s->asked[0] = *shot;
    const struct cam_shot *set = &s->asked[s->settle];
    while (!set->id) // the first ones find no settings before them
        set--;
    int64_t exposure = set->exposure_ns;
    if (c->exposure_step_ns > 0)
        exposure = (exposure + c->exposure_step_ns / 2) / c->exposure_step_ns * c->exposure_step_ns;
    exposure = exposure < c->exposure_min_ns ? c->exposure_min_ns : exposure;
    exposure = exposure > c->exposure_max_ns ? c->exposure_max_ns : exposure;
    if (!isnan(set->focus_per_m))
        s->focus_per_m = fmax(c->focus_min_per_m, fmin(c->focus_max_per_m, set->focus_per_m));
    pthread_mutex_lock(&s->mutex);
    const bool full = s->waiting == QUEUE;
    if (!full)
        s->job[s->waiting++] = (struct job){
            .shot = *shot,
            .frame = {.seq = s->seq++,
                      .shot = shot->id,
                      .exposure_ns = exposure,
                      .gain = fmax(c->gain_min, fmin(c->gain_max, set->gain)),
                      .focus_per_m = s->focus_per_m,
                      .temperature_k = 303,
                      .w = c->w,
                      .h = c->h},
        };
    pthread_cond_signal(&s->wake);
    pthread_mutex_unlock(&s->mutex);
    return !full || err_set(e, ERR_DEVICE, "busy: %d shots are waiting", QUEUE);
}

static bool sim_pump(struct cam *cam, struct err *e)
{
    struct sim *s = (struct sim *)cam;
    eventfd_t ignored;
    eventfd_read(cam->fd, &ignored);
    for (;;) {
        pthread_mutex_lock(&s->mutex);
        const bool ready = s->finished > 0;
        struct job job = s->job[0];
        if (ready) {
            memmove(s->job, s->job + 1, (QUEUE - 1) * sizeof *s->job);
            s->finished--;
            s->waiting--;
        }
        pthread_mutex_unlock(&s->mutex);
        if (!ready)
            return true;
        const bool ok = job.raw != NULL;
        if (ok)
            cam_deliver(cam, &job.frame);
        else
            *e = job.err;
        free(job.raw);
        if (!ok)
            return false;
    }
}

static void sim_close(struct cam *cam)
{
    struct sim *s = (struct sim *)cam;
    if (s->running) {
        pthread_mutex_lock(&s->mutex);
        s->quit = true;
        pthread_cond_signal(&s->wake);
        pthread_mutex_unlock(&s->mutex);
        pthread_join(s->thread, NULL);
    }
    for (int k = 0; k < s->waiting; k++)
        free(s->job[k].raw);
    world_close(s->world);
    sensor_finish(&s->sensor);
    lab_finish(&s->lab);
    free(s->seconds);
}

#define AT(field) offsetof(struct sim, field)
static const struct devopt options[] = {
    {"scene", DEVOPT_TEXT, AT(scene), .def = "",
     .help = "sample, view and sensor; built-in if none"},
    {"rig", DEVOPT_TEXT, AT(rig), .def = "", .help = "rig file whose lights and filters there are"},
    {"world", DEVOPT_TEXT, AT(world_name), .def = "",
     .help = "name shared with simulated triggers"},
    {"w", DEVOPT_INT, AT(w), UNIT_NONE, 1, 16384, NULL, "pixels, instead of the scene's"},
    {"h", DEVOPT_INT, AT(h), UNIT_NONE, 1, 16384, NULL, "pixels, instead of the scene's"},
    {"seed", DEVOPT_INT, AT(seed), UNIT_NONE, 0, INT32_MAX, "1", "of all noise"},
    {"realtime", DEVOPT_INT, AT(realtime), UNIT_NONE, 0, 1, "0", "1: exposures take their time"},
    {"grace", DEVOPT_NS, AT(grace_ns), UNIT_S, 0, 10, "2ms",
     "real time of an exposure before the virtual clock skips the rest"},
    {"settle", DEVOPT_INT, AT(settle), UNIT_NONE, 0, SETTLE, "0",
     "frames until settings are in force"},
    {"dead", DEVOPT_NS, AT(dead_ns), UNIT_S, 0, 600, "20s",
     "longest time from an exposure to its frame: the first one of a light and filter is computed"},
    {0},
};

const struct cam_driver sim_cam = {
    .name = "sim",
    .summary = "simulated camera over a simulated sample",
    .size = sizeof(struct sim),
    .options = options,
    .open = sim_open,
    .shoot = sim_shoot,
    .pump = sim_pump,
    .close = sim_close,
};

// "fault:drop=2,in=sim:scene=x": the simulated camera may be inside another one.
static const char *sim_part(const char *uri)
{
    for (const char *at = uri; at; at = strstr(at + 1, "sim:"))
        if (!strncmp(at, "sim:", 4) && (at == uri || at[-1] == '='))
            return at + 4;
    return NULL;
}

// A rig has a camera; a scene's stands within its view.
static bool is_rig(const char *path)
{
    struct yaml *y;
    struct err ignored;
    if (!yaml_open(&y, path, &ignored))
        return false;
    const bool found = ymap_find(yaml_root(y), "camera") != NULL;
    yaml_close(y, false, &ignored);
    return found;
}

bool sim_lab_open(struct lab *lab, const char *path, struct err *e)
{
    struct rig rig;
    if (!strcmp(path, "sim"))
        return lab_open(lab, NULL, NULL, e);
    if (!is_rig(path))
        return lab_open(lab, path, NULL, e);
    if (!rig_open(&rig, path, e))
        return false;
    const char *args = sim_part(rig.camera.uri);
    struct sim *s = xcalloc(1, sizeof *s);
    const bool ok = (args || err_set(e, ERR_DATA, "%s: its camera '%s' is not simulated", path,
                                     rig.camera.uri)) &&
                    devopt_parse(options, args, s, e) && lab_open(lab, s->scene, path, e);
    if (ok && (s->w || s->h))
        view_resize(&lab->scene.view, s->w, s->h);
    devopt_finish(options, s);
    free(s);
    rig_finish(&rig);
    return ok;
}
