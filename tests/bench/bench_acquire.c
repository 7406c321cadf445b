// bench_acquire.c - from the camera to durable disk: frames per second, processor time per frame,
// and what stands in the way.
//
// The disk's own rate is that of writing, syncing and renaming files of the same size, and syncing
// their folder. The error of every row is the share of frames that the session does not prove.
#define _GNU_SOURCE
#include "acquire/preview.h"
#include "acquire/shooter.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/outfile.h"
#include "sim/sim.h"
#include "tests/bench/bench.h"
#include <ftw.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static const struct cam_driver *const cams[] = {&sim_cam, &replay_cam, NULL};
static const struct trig_driver *const trigs[] = {&sim_trig, NULL};
static const struct drivers drivers = {cams, trigs, false};

struct job {
    struct bench_report *report;
    char folder[80]; // of everything that is written
    int w, h, frames;
    struct preview *preview;     // NULL: nobody looks
    double first_mb, last_mb;    // memory after a tenth of the frames, and at the end
    double start_s, start_cpu_s; // when the first frame was kept
    struct loop *loop;
    struct err how;
};

static double cpu_s(void)
{
    struct rusage u;
    getrusage(RUSAGE_SELF, &u);
    return (double)(u.ru_utime.tv_sec + u.ru_stime.tv_sec) +
           1e-6 * (double)(u.ru_utime.tv_usec + u.ru_stime.tv_usec);
}

static double resident_mb(void)
{
    long pages = 0;
    FILE *f = fopen("/proc/self/statm", "r");
    if (f && fscanf(f, "%*d %ld", &pages) != 1)
        pages = 0;
    if (f)
        fclose(f);
    return (double)pages * (double)sysconf(_SC_PAGESIZE) * 1e-6;
}

static int remove_one(const char *path, const struct stat *st, int type, struct FTW *ftw)
{
    (void)st;
    (void)type;
    (void)ftw;
    return remove(path);
}

static void clear(const char *folder, const char *name)
{
    char *path = xasprintf("%s/%s", folder, name);
    nftw(path, remove_one, 16, FTW_DEPTH | FTW_PHYS);
    free(path);
}

static bool put(const struct job *j, const char *name, const char *text, struct err *e)
{
    char *path = xasprintf("%s/%s", j->folder, name);
    const bool ok = outfile_write(path, text, strlen(text), e);
    free(path);
    return ok;
}

static bool put_rig(const struct job *j, const char *camera, struct err *e)
{
    char *text = xasprintf(
        "name: r\ncamera: {uri: '%s'}\nlights:\n  trigger: 'sim:lines=1,world=@run'\n"
        "  list: [{name: led, line: 0, irradiance: 10, centre: 560nm, width: 60nm, max_on: 9s, "
        "max_duty: 1}]\n"
        "filters:\n  trigger: 'sim:positions=1,world=@run'\n"
        "  list: [{name: green, position: 0, centre: 530nm, width: 10nm}]\n",
        camera);
    const bool ok = put(j, "rig.yaml", text, e);
    free(text);
    return ok;
}

// A scene that is cheap to look at: what is timed is not the simulator.
static bool put_files(const struct job *j, struct err *e)
{
    char camera[100], plan[200];
    snprintf(camera, sizeof camera, "sim:w=%d,h=%d,world=@run,grace=0,scene=scene.yaml,rig=@rig",
             j->w, j->h);
    snprintf(plan, sizeof plan,
             "name: p\nlights: [led]\nfilters: [green]\nexposures: {first: 1ms, last: 8ms, step: "
             "0.333}\n"
             "repeats: %d\n",
             (j->frames + 9) / 10); // ten exposures
    return put_rig(j, camera, e) &&
           put(j, "scene.yaml",
               "sample: {kind: flat}\nsensor: {shot-noise: false, hot-pixels: 0, blooming: 0}\n",
               e) &&
           put(j, "plan.yaml", plan, e);
}

static void ended(void *ctx, const struct err *how)
{
    struct job *j = ctx;
    j->how = *how;
    loop_stop(j->loop);
}

static void seen(void *ctx, const struct cam_frame *f, const struct cam_caps *caps)
{
    struct job *j = ctx;
    if (j->preview)
        preview_show(j->preview, f, caps);
}

static void kept(void *ctx, const struct session_frame *f, int done, int planned)
{
    struct job *j = ctx;
    (void)f;
    if (done == 1) { // the simulator has computed its picture
        j->start_s = now_s();
        j->start_cpu_s = cpu_s();
    }
    if (done == planned / 10)
        j->first_mb = resident_mb();
    if (done == planned)
        j->last_mb = resident_mb();
}

// A whole capture; *lost is the share of frames that are not proven.
static bool capture(struct job *j, struct bench_time *t, double *lost, struct err *e)
{
    char *rig = xasprintf("%s/rig.yaml", j->folder), *plan = xasprintf("%s/plan.yaml", j->folder);
    char *folder = xasprintf("%s/s", j->folder);
    const struct shooter_order order = {.rig = rig,
                                        .plan = plan,
                                        .session = folder,
                                        .drivers = &drivers,
                                        .kept = kept,
                                        .seen = seen,
                                        .end = ended,
                                        .ctx = j};
    clear(j->folder, "s");
    j->loop = loop_new();
    struct shooter *shooter = shooter_new(j->loop, &order, e);
    bool ok = shooter && loop_run(j->loop, e);
    shooter_free(shooter);
    const double wall_s = now_s() - j->start_s, cpu_used_s = cpu_s() - j->start_cpu_s;
    loop_free(j->loop);
    if (ok && j->how.code) {
        *e = j->how;
        ok = false;
    }
    struct session *s = NULL;
    struct session_report r;
    ok = ok && session_open(&s, folder, SESSION_READ, e) && session_verify(s, &r, e);
    if (ok) {
        *lost = 1 - (double)r.good / r.planned;
        *t = (struct bench_time){wall_s / (r.planned - 1), cpu_used_s / (r.planned - 1),
                                 resident_mb(), r.planned};
    }
    session_close(s);
    free(folder);
    free(rig);
    free(plan);
    return ok;
}

// The camera alone: what the simulator itself costs.
static void drop_frame(void *ctx, const struct cam_frame *f)
{
    (void)f;
    ++*(int *)ctx;
}

static bool camera_alone(const struct job *j, struct bench_time *t, struct err *e)
{
    int got = 0;
    char *uri = xasprintf("sim:w=%d,h=%d,grace=0,scene=%s/scene.yaml", j->w, j->h, j->folder);
    struct cam *cam = cam_open(cams, uri, drop_frame, &got, e);
    bool ok = cam != NULL;
    double cpu = 0, start = 0;
    const int frames = j->frames < 8 ? j->frames : 8;
    for (int k = 0; ok && k <= frames; k++) { // the first one warms up
        const struct cam_shot shot = {(uint64_t)k + 1, 4000000, 1, NAN};
        ok = cam_shoot(cam, &shot, e);
        while (ok && got <= k) {
            struct pollfd p = {cam->fd, POLLIN, 0};
            poll(&p, 1, 1000);
            ok = cam_pump(cam, e);
        }
        if (!k) {
            cpu = cpu_s();
            start = now_s();
        }
    }
    *t = (struct bench_time){(now_s() - start) / frames, (cpu_s() - cpu) / frames, resident_mb(),
                             frames};
    cam_close(cam);
    free(uri);
    return ok;
}

// Files of a frame's size, as durable as frames are.
static bool disk_alone(const struct job *j, int files, struct bench_time *t, struct err *e)
{
    const size_t size = (size_t)j->w * (size_t)j->h * 2 + 1000;
    uint16_t *data = sample_alloc(size, 1, "file", e);
    if (!data)
        return false;
    bool ok = true;
    const double cpu = cpu_s(), start = now_s();
    for (int k = 0; ok && k < files; k++) {
        char *path = xasprintf("%s/f%d", j->folder, k);
        for (size_t i = 0; i < size / 2; i += 256)
            data[i] = (uint16_t)(i + (size_t)k); // unlike the file before
        ok = outfile_write(path, data, size, e);
        free(path);
    }
    *t = (struct bench_time){(now_s() - start) / files, (cpu_s() - cpu) / files, resident_mb(),
                             files};
    for (int k = 0; k < files; k++) {
        char *path = xasprintf("%s/f%d", j->folder, k);
        unlink(path);
        free(path);
    }
    free(data);
    return ok;
}

// The session that was just captured as the camera: what acquisition itself can do.
static bool capture_again(struct job *j, struct bench_time *t, double *lost, struct err *e)
{
    char *from = xasprintf("%s/s", j->folder), *to = xasprintf("%s/recorded", j->folder);
    char *camera = xasprintf("replay:%s", to);
    clear(j->folder, "recorded");
    const bool ok = (!rename(from, to) || err_errno(e, "%s", to)) && put_rig(j, camera, e) &&
                    capture(j, t, lost, e);
    free(camera);
    free(from);
    free(to);
    return ok;
}

static bool one_size(struct job *j, const char *name, struct err *e)
{
    struct bench_time cam, disk, all, again;
    double lost, lost_again;
    char text[60];
    if (!put_files(j, e) || !camera_alone(j, &cam, e) || !disk_alone(j, j->frames, &disk, e) ||
        !capture(j, &all, &lost, e) || !capture_again(j, &again, &lost_again, e))
        return false;
    snprintf(text, sizeof text, "%s, %d x %d", name, j->w, j->h);
    bench_row(j->report, "simulated camera alone", text, cam, 0, "none: nothing is kept");
    bench_row(j->report, "disk alone: write, sync, rename", text, disk, 0, "none");
    bench_row(j->report, "camera to durable disk", text, all, lost, "share of frames not proven");
    bench_row(j->report, "recorded session to durable disk", text, again, lost_again,
              "share of frames not proven");
    snprintf(text, sizeof text, "%s: frames kept from sim", name);
    bench_figure(j->report, text, 1 / all.wall_s, "frames/s");
    snprintf(text, sizeof text, "%s: frames kept from replay", name);
    bench_figure(j->report, text, 1 / again.wall_s, "frames/s");
    snprintf(text, sizeof text, "%s: disk's own rate", name);
    bench_figure(j->report, text, 1 / disk.wall_s, "files/s");
    snprintf(text, sizeof text, "%s: processor per frame without the simulator", name);
    bench_figure(j->report, text, 1e3 * (all.cpu_s - cam.cpu_s), "ms");
    snprintf(text, sizeof text, "%s: slower than the slower of camera and disk", name);
    bench_figure(j->report, text, all.wall_s / fmax(cam.wall_s, disk.wall_s), "times");
    return true;
}

// Somebody who looks on, and is stopped in the middle of it.
static pid_t start_viewer(int fd)
{
    const pid_t pid = fork();
    if (pid)
        return pid;
    struct preview_memory *m = mmap(NULL, sizeof *m, PROT_READ, MAP_SHARED, fd, 0);
    static uint16_t copy[PREVIEW_SIDE * PREVIEW_SIDE];
    for (;;) {
        if (m != MAP_FAILED)
            memcpy(copy, m->picture[m->current & 1].px, sizeof copy);
        usleep(10000);
    }
}

static bool viewers(struct job *j, struct err *e)
{
    struct bench_time none, stalled;
    double lost, lost_too;
    if (!put_files(j, e) || !capture(j, &none, &lost, e))
        return false;
    if (!(j->preview = preview_new(e)))
        return false;
    const pid_t viewer = start_viewer(preview_fd(j->preview));
    usleep(100000);
    kill(viewer, SIGSTOP);
    const bool ok = capture(j, &stalled, &lost_too, e);
    kill(viewer, SIGKILL);
    waitpid(viewer, NULL, 0);
    preview_free(j->preview);
    j->preview = NULL;
    if (!ok)
        return false;
    bench_row(j->report, "nobody looks on", "640 x 480", none, lost, "share of frames not proven");
    bench_row(j->report, "a viewer that is stopped", "640 x 480", stalled, lost_too,
              "share of frames not proven");
    bench_figure(j->report, "stopped viewer against none", stalled.wall_s / none.wall_s, "times");
    return true;
}

static bool flat_memory(struct job *j, struct err *e)
{
    struct bench_time t;
    double lost;
    char text[60];
    if (!put_files(j, e) || !capture(j, &t, &lost, e))
        return false;
    snprintf(text, sizeof text, "%d frames of %d x %d", j->frames, j->w, j->h);
    bench_row(j->report, "many small frames", text, t, lost, "share of frames not proven");
    bench_figure(j->report, "memory after a tenth of them", j->first_mb, "MB");
    bench_figure(j->report, "memory after all", j->last_mb, "MB");
    return true;
}

static bool run(struct bench_report *r, struct err *e)
{
    const bool quick = bench_quick(r);
    struct job j = {.report = r};
    snprintf(j.folder, sizeof j.folder, "bench-acquire-XXXXXX"); // here: on the disk that is meant
    if (!mkdtemp(j.folder))
        return err_errno(e, "%s", j.folder);
    bool ok = true;
    static const struct {
        const char *name;
        int w, h, frames;
    } sizes[] = {{"4 Mpx", 2448, 1648, 24}, {"24 Mpx", 6000, 4000, 8}};
    for (int k = 0; ok && k < (quick ? 1 : 2); k++) {
        j.w = sizes[k].w;
        j.h = sizes[k].h;
        j.frames = quick ? 8 : sizes[k].frames;
        ok = one_size(&j, sizes[k].name, e);
    }
    j.w = 640;
    j.h = 480;
    j.frames = quick ? 40 : 200;
    ok = ok && viewers(&j, e);
    j.w = 32;
    j.h = 24;
    j.frames = quick ? 400 : 100000;
    // Durability is measured above; here its waiting is not wanted: in memory, when there is some.
    if (ok && !access("/dev/shm", W_OK)) {
        nftw(j.folder, remove_one, 16, FTW_DEPTH | FTW_PHYS);
        snprintf(j.folder, sizeof j.folder, "/dev/shm/nacre-bench-XXXXXX");
        ok = mkdtemp(j.folder) || err_errno(e, "%s", j.folder);
    }
    ok = ok && flat_memory(&j, e);
    nftw(j.folder, remove_one, 16, FTW_DEPTH | FTW_PHYS);
    return ok;
}

extern const struct bench bench_acquire;
const struct bench bench_acquire = {
    .name = "acquire",
    .summary = "frames from the camera to durable disk",
    .run = run,
};
