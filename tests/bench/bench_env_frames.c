// bench_env_frames.c - whether the exact method's error knows how the sample is turned.
#define _GNU_SOURCE
#include "core/mem.h"
#include "process/env_direct.h"
#include "process/env_exact.h"
#include "tests/bench/bench_environment.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FRAMES = 100, SPOTS = 3, SIDE = 129 };

static struct frame any_frame(int k)
{
    struct frame f;
    const double y = 1 - 2 * (k + .5) / FRAMES, s = sqrt(1 - y * y);
    frame_from(v3(sin(5 * k), cos(3 * k), .3), v3(s * cos(2.4 * k), y, s * sin(2.4 * k)), &f);
    return f;
}

struct off {
    double l2, worst; // relative to the frame's values, and to its peak
};

// At nodes of the map.
static bool one(const struct table *t, const struct fresnel *fresnel, const struct environment *env,
                int turn, const struct env_kernel *k, struct off *off, struct err *e)
{
    double o[SPOTS][2], want[SPOTS][3], wrong = 0, all = 0, most = 0, peak = 0;
    const struct frame f = any_frame(turn);
    int node[SPOTS];
    struct image map;
    for (int q = 0; q < SPOTS; q++) {
        const double r = .99 * sqrt((q + fmod(.618 * turn, 1)) / SPOTS), a = 2.4 * (q + 3 * turn);
        const int i = (int)lround((r * cos(a) + 1) / 2 * (SIDE - 1));
        const int j = (int)lround((r * sin(a) + 1) / 2 * (SIDE - 1));
        node[q] = j * SIDE + i;
        o[q][0] = env_map_cosine(i, SIDE);
        o[q][1] = env_map_cosine(j, SIDE);
    }
    if (!env_direct(t, fresnel, env, &f, SPOTS, (const double(*)[2])o, want, e) ||
        !env_exact(k, env, &f, SIDE, &map, e))
        return false;
    for (int q = 0; q < 3 * SPOTS; q++) {
        const double is = want[q / 3][q % 3], d = (double)map.px[3 * node[q / 3] + q % 3] - is;
        wrong += d * d;
        all += is * is;
        most = fmax(most, fabs(d));
        peak = fmax(peak, is);
    }
    image_finish(&map);
    *off = (struct off){sqrt(wrong / all), most / peak};
    return true;
}

// A turn about the vertical by whole columns: the same light.
static bool together(const struct environment *env, const struct env_kernel *k, double *off,
                     struct err *e)
{
    const size_t w = (size_t)env->map.w, h = (size_t)env->map.h;
    const struct frame f = any_frame(17);
    const size_t columns = 37 * w / 256;
    const double angle = 2 * M_PI * (double)columns / (double)w, c = cos(angle), d = sin(angle);
    const struct vec3 t = v3(c * f.t.x - d * f.t.z, f.t.y, d * f.t.x + c * f.t.z);
    const struct vec3 n = v3(c * f.n.x - d * f.n.z, f.n.y, d * f.n.x + c * f.n.z);
    struct frame moved;
    struct environment sky = {0};
    struct image still, map = {0};
    double most = 0, peak = 0;
    frame_from(t, n, &moved);
    if (!image_init(&sky.map, env->map.w, env->map.h, 3, e))
        return false;
    for (size_t p = 0; p < w * h; p++)
        memcpy(sky.map.px + 3 * p, env->map.px + 3 * (p / w * w + (p + w - columns) % w),
               3 * sizeof *sky.map.px);
    bool ok = env_exact(k, env, &f, SIDE, &still, e);
    if (ok && !env_exact(k, &sky, &moved, SIDE, &map, e)) {
        image_finish(&still);
        ok = false;
    }
    for (int q = 0; ok && q < 3 * SIDE * SIDE; q++) {
        most = fmax(most, fabs((double)map.px[q] - (double)still.px[q]));
        peak = fmax(peak, (double)still.px[q]);
    }
    if (ok) {
        *off = most / peak;
        image_finish(&still);
        image_finish(&map);
    }
    environment_finish(&sky);
    return ok;
}

bool bench_frames(struct bench_report *r, const struct table *t, const struct environment *env,
                  struct err *e)
{
    static const struct fresnel fresnels[2] = {{false, 1}, {true, .04}};
    static const char *const names[] = {"constant", "Schlick 1e-3"};
    const int n = bench_quick(r) ? 4 : FRAMES;
    const struct env_how how = {.tolerance = 1e-3, .detail_rad = M_PI / env->map.h};
    for (int s = 0; s < 2; s++) { // every other frame each
        struct env_kernel kernel;
        struct off worst = {0};
        double wrong = 0, best = INFINITY, turned = 0;
        if (!env_kernel_init(&kernel, t, &fresnels[s], &how, e))
            return false;
        bool ok = true;
        for (int k = s; k < n && ok; k += 2) {
            struct off off = {0};
            ok = one(t, &fresnels[s], env, k, &kernel, &off, e);
            wrong += off.l2 * off.l2;
            best = fmin(best, off.l2);
            worst.l2 = fmax(worst.l2, off.l2);
            worst.worst = fmax(worst.worst, off.worst);
        }
        ok = ok && together(env, &kernel, &turned, e);
        env_kernel_finish(&kernel);
        if (!ok)
            return false;
        bench_note(r,
                   "exact, %s, against direct in %d frames, %d directions each: relative L2 %.1e, "
                   "best frame %.1e, worst frame %.1e; worst value %.1e of its frame's peak; "
                   "sample and environment turned together: %.1e of the peak",
                   names[s], n / 2, SPOTS, sqrt(wrong / (n / 2)), best, worst.l2, worst.worst,
                   turned);
    }
    return true;
}
