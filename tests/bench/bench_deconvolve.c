// bench_deconvolve.c - Richardson-Lucy: time and error against the true scene, beside OpenCV's and
// scikit-image's.
#define _GNU_SOURCE
#include "core/mem.h"
#include "process/deconvolve.h"
#include "tests/bench/bench.h"
#include "tests/bench/cv_peer.h"
#include "tests/noise.h"
#include <math.h>
#include <omp.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// A photograph's window on a scene that goes on beyond its border, with shot noise.
struct job {
    int w, h;
    double sigma_px;
    struct deconvolve_options opt;
    struct deconvolve_result result;
    struct blur *blur;
    float *truth, *data, *out; // [h][w]
};

static double scene(int i, int j)
{
    return 30 + (i / 7 % 2 ? 120 : 0) + (hypot(i % 97 - 48, j % 89 - 44) < 15 ? 300 : 0) +
           (i % 41 == 7 && j % 37 == 5 ? 2000 : 0) + 20 * sin(0.02 * i + 0.013 * j);
}

static bool job_init(struct job *b, int side, double sigma_px, struct err *e)
{
    const int pad = (int)ceil(5 * sigma_px), wide = side + 2 * pad;
    *b = (struct job){.w = side, .h = side, .sigma_px = sigma_px};
    const size_t n = (size_t)side * (size_t)side, nw = (size_t)wide * (size_t)wide;
    float *big = sample_alloc(nw, sizeof *big, "scene", e),
          *soft = sample_alloc(nw, sizeof *soft, "scene", e);
    b->truth = sample_alloc(n, sizeof *b->truth, "scene", e);
    b->data = sample_alloc(n, sizeof *b->data, "scene", e);
    b->out = sample_alloc(n, sizeof *b->out, "scene", e);
    b->blur = blur_gauss(side, side, sigma_px, e);
    struct blur *wider = blur_gauss(wide, wide, sigma_px, e);
    const bool ok = big && soft && b->truth && b->data && b->out && b->blur && wider;
    if (ok) {
        for (int j = 0; j < wide; j++)
            for (int i = 0; i < wide; i++)
                big[(size_t)j * (size_t)wide + (size_t)i] = (float)scene(i, j);
        blur_apply(wider, big, soft);
        uint64_t seed = 1;
        for (int j = 0; j < side; j++)
            for (int i = 0; i < side; i++) {
                const size_t from = (size_t)(j + pad) * (size_t)wide + (size_t)(i + pad);
                const size_t to = (size_t)j * (size_t)side + (size_t)i;
                const double clean = (double)soft[from];
                b->truth[to] = big[from];
                b->data[to] = (float)fmax(0, clean + sqrt(clean) * noise_gauss(&seed));
            }
    }
    blur_free(wider);
    free(big);
    free(soft);
    return ok;
}

static void job_finish(struct job *b)
{
    blur_free(b->blur);
    free(b->truth);
    free(b->data);
    free(b->out);
}

// Relative RMSE inside (more than four sigma from the border) or at the border.
static double error(const struct job *b, bool inside)
{
    const int margin = (int)(4 * b->sigma_px);
    double miss = 0, all = 0;
    for (int j = 0; j < b->h; j++)
        for (int i = 0; i < b->w; i++) {
            const bool deep = i >= margin && j >= margin && i < b->w - margin && j < b->h - margin;
            const size_t k = (size_t)j * (size_t)b->w + (size_t)i;
            if (deep == inside) {
                const double t = (double)b->truth[k], d = (double)b->out[k] - t;
                miss += d * d;
                all += t * t;
            }
        }
    return sqrt(miss / all);
}

static bool run_ours(void *ctx, struct err *e)
{
    struct job *b = ctx;
    return deconvolve(b->blur, b->w, b->h, b->data, &b->opt, b->out, &b->result, e);
}

static bool run_opencv(void *ctx, struct err *e)
{
    (void)e;
    struct job *b = ctx;
    cv_richardson_lucy(b->data, b->w, b->h, b->sigma_px, b->opt.iterations, b->out);
    return true;
}

static const char python[] =
    "import time,numpy as np\n"
    "from skimage.restoration import richardson_lucy\n"
    "n,s,it=%d,%g,%d\n"
    "d=np.fromfile('%s',np.float32).reshape(n,n);m=d.max()\n"
    "r=int(np.ceil(4*s));x=np.arange(-r,r+1);k=np.exp(-x*x/(2*s*s));p=np.outer(k,k);p/=p.sum()\n"
    "p=p.astype(np.float32);richardson_lucy(d/m,p,num_iter=2,clip=False)\n"
    "t=[]\n"
    "for _ in range(3):\n"
    " a=time.perf_counter();u=richardson_lucy(d/"
    "m,p,num_iter=it,clip=False);t.append(time.perf_counter()-a)\n"
    "(u*m).astype(np.float32).tofile('%s');print(sorted(t)[1])\n";

// The time of scikit-image on one thread, its result in b->out; false where it is not installed.
static bool run_skimage(struct job *b, double *wall_s)
{
    char data[] = "/tmp/nacre-bench-XXXXXX", script[1200], result[64];
    const int fd = mkstemp(data);
    if (fd < 0)
        return false;
    const size_t bytes = (size_t)b->w * (size_t)b->h * sizeof(float);
    bool ok = write(fd, b->data, bytes) == (ssize_t)bytes;
    close(fd);
    snprintf(result, sizeof result, "%s.out", data);
    char *command = NULL;
    snprintf(script, sizeof script, python, b->w, b->sigma_px, b->opt.iterations, data, result);
    command = xasprintf("PATH=/usr/bin:$PATH OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python3 -c "
                        "\"%s\" 2>/dev/null",
                        script);
    FILE *p = ok ? popen(command, "r") : NULL;
    ok = p && fscanf(p, "%lf", wall_s) == 1;
    if (p)
        pclose(p);
    FILE *f = ok ? fopen(result, "rb") : NULL;
    ok = f && fread(b->out, 1, bytes, f) == bytes;
    if (f)
        fclose(f);
    unlink(data);
    unlink(result);
    free(command);
    return ok;
}

static void add(struct bench_report *r, const struct job *b, const char *method,
                const char *setting, struct bench_time t)
{
    bench_row(r, method, setting, t, error(b, true), "interior RMSE, relative");
    bench_figure(r, setting, error(b, false), "= RMSE at the border, relative");
}

static bool run(struct bench_report *r, struct err *e)
{
    struct job b;
    const int side = bench_quick(r) ? 512 : 1024, cores = omp_get_max_threads();
    if (!job_init(&b, side, 3, e))
        return false;
    struct bench_time ours, cv, two;
    char setting[80];
    b.opt.iterations = 30;
    omp_set_num_threads(1);
    bool ok = bench_measure(run_ours, &b, &ours, e);
    if (ok) {
        snprintf(setting, sizeof setting, "ours, %d^2, sigma 3, 30 it., 1 thread", side);
        add(r, &b, "ours", setting, ours);
        ok = bench_measure(run_opencv, &b, &cv, e);
    }
    if (ok) {
        snprintf(setting, sizeof setting, "sepFilter2D, %d^2, sigma 3, 30 it.", side);
        add(r, &b, "opencv loop", setting, cv);
        bench_figure(r, "OpenCV's loop takes, times ours", cv.wall_s / ours.wall_s, "x");
        double sk_s;
        if (run_skimage(&b, &sk_s)) {
            snprintf(setting, sizeof setting, "scikit-image, %d^2, sigma 3, 30 it.", side);
            add(r, &b, "scikit-image", setting, (struct bench_time){sk_s, sk_s, NAN, 3});
            bench_figure(r, "scikit-image takes, times ours", sk_s / ours.wall_s, "x");
        } else {
            bench_note(r, "scikit-image is not installed (make bench-peers): not compared");
        }
    }
    omp_set_num_threads(cores);
    static const int counts[] = {5, 10, 20, 40, 80};
    for (int k = 0; ok && k < 5; k++) {
        b.opt.iterations = counts[k];
        snprintf(setting, sizeof setting, "%d iterations, all cores", counts[k]);
        if ((ok = bench_measure(run_ours, &b, &two, e)))
            bench_row(r, "ours", setting, two, error(&b, true), "interior RMSE, relative");
        b.opt.accelerate = true;
        if (ok && (ok = bench_measure(run_ours, &b, &two, e)))
            bench_row(r, "accelerated", setting, two, error(&b, true), "interior RMSE, relative");
        b.opt.accelerate = false;
    }
    b.opt.iterations = 0;
    if (ok && (ok = bench_measure(run_ours, &b, &two, e))) {
        snprintf(setting, sizeof setting, "auto: %d iterations", b.result.iterations);
        bench_row(r, "auto", setting, two, error(&b, true), "interior RMSE, relative");
    }
    job_finish(&b);
    return ok;
}

const struct bench bench_deconvolve = {
    "deconvolve", "Richardson-Lucy against the true scene, and against peers", run};
