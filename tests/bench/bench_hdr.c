// bench_hdr.c - merging brackets: time and error against the true light, beside OpenCV and
// pfstools; linear frames against the Cramer-Rao bound, and the drift of the light.
#define _GNU_SOURCE
#include "core/imgfile.h"
#include "core/mem.h"
#include "core/sort.h"
#include "process/exposure.h"
#include "process/hdr.h"
#include "tests/bench/bench.h"
#include "tests/noise.h"
#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { FRAMES = 9, LINEAR = 6 };

// Nine 8-bit frames through the sRGB curve, a stop and a half apart.
struct job {
    int w, h;
    size_t n;     // samples of a frame
    float *truth; // [h][w][3] in the units of X per second
    uint8_t *code[FRAMES];
    double time_s[FRAMES];
    struct response response;
    struct image merged;
    float *out; // [h][w][3]
    char folder[40];
};

// Smooth light over 11 stops with texture, and coloured highlights: spots that are bright in one
// channel alone, as a pattern behind a narrow filter has them.
static double light(int i, int j, int c, int w, int h)
{
    const double x = (double)i / w, y = (double)j / h;
    double stops = 9 * x - 5 + sin(17 * y + 5 * x + c) + 0.3 * sin(0.9 * i) * cos(0.7 * j);
    const int p = i / 97, q = j / 89;
    const double spot = hypot(i - 97 * p - 48, j - 89 * q - 44) / 9;
    if ((p + q) % 3 == c && spot < 3)
        stops = fmax(stops, 8 - 1.2 * spot * spot);
    return exp2(stops);
}

static void job_finish(struct job *b)
{
    char command[80];
    free(b->truth);
    free(b->out);
    for (int k = 0; k < FRAMES; k++)
        free(b->code[k]);
    image_finish(&b->merged);
    if (*b->folder) {
        snprintf(command, sizeof command, "rm -rf %s", b->folder);
        if (system(command))
            *b->folder = 0;
    }
}

static bool job_init(struct job *b, int w, int h, struct err *e)
{
    *b = (struct job){.w = w, .h = h, .n = 3 * (size_t)w * (size_t)h};
    b->truth = sample_alloc(b->n, sizeof *b->truth, "scene", e);
    b->out = b->truth ? sample_alloc(b->n, sizeof *b->out, "scene", e) : NULL;
    bool ok = b->out;
    for (int k = 0; ok && k < FRAMES; k++)
        ok = (b->code[k] = sample_alloc(b->n, 1, "frame", e));
    if (!ok)
        return false;
    response_srgb(&b->response, 3);
    for (int k = 0; k < FRAMES; k++)
        b->time_s[k] = exp2(4 - 1.5 * k);
    double edge[RESPONSE_CODES]; // a code stands for what lies between the curve's middles
    for (int z = 0; z + 1 < RESPONSE_CODES; z++)
        edge[z] = exp(0.5 * (b->response.log_x[0][z] + b->response.log_x[0][z + 1]));
#pragma omp parallel for schedule(static)
    for (int j = 0; j < h; j++) {
        uint64_t seed = 77 + (uint64_t)j;
        for (int i = 0; i < 3 * w; i++) {
            const size_t at = (size_t)j * 3 * (size_t)w + (size_t)i;
            const double l = light(i / 3, j, i % 3, w, h);
            b->truth[at] = (float)l;
            for (int k = 0; k < FRAMES; k++) { // shot noise of 20,000 electrons at code 255
                const double x = l * b->time_s[k];
                const double noisy = x + sqrt(2.3e-4 * x + 1e-7) * noise_gauss(&seed);
                int lo = 0, hi = RESPONSE_CODES - 1;
                while (lo < hi) {
                    const int mid = (lo + hi) / 2;
                    if (noisy > edge[mid])
                        lo = mid + 1;
                    else
                        hi = mid;
                }
                b->code[k][at] = (uint8_t)lo;
            }
        }
    }
    snprintf(b->folder, sizeof b->folder, "/tmp/nacre-bench-XXXXXX");
    return mkdtemp(b->folder) || err_errno(e, "%s", b->folder);
}

static bool run_ours(void *ctx, struct err *e)
{
    struct job *b = ctx;
    struct hdr_counts counts;
    const struct bracket all = {FRAMES, b->w, b->h, 3, (const uint8_t *const *)b->code, b->time_s};
    image_finish(&b->merged);
    return hdr_merge_codes(&all, &b->response, HDR_POISSON, &b->merged, &counts, e);
}

// Median of |out / truth - 1| after the one factor that fits best, and the mean of out / truth over
// the brightest 0.1 %.
static void errors(const struct job *b, const float *out, double *median, double *brightest)
{
    const size_t step = b->n / 2000000 + 1, count = b->n / step;
    double *q = xcalloc(count, sizeof *q), *l = xcalloc(count, sizeof *l), sum = 0;
    size_t n = 0, bright = 0;
    for (size_t k = 0; k < count; k++) {
        q[k] = (double)out[k * step] / (double)b->truth[k * step];
        l[k] = (double)b->truth[k * step];
    }
    sort_doubles(l, count);
    const double limit = l[count - count / 1000];
    memcpy(l, q, count * sizeof *l);
    sort_doubles(l, count);
    const double scale = l[count / 2];
    for (size_t k = 0; k < count; k++) {
        if ((double)b->truth[k * step] >= limit) {
            sum += q[k] / scale;
            bright++;
        }
        l[n++] = fabs(q[k] / scale - 1);
    }
    sort_doubles(l, n);
    *median = l[n / 2];
    *brightest = sum / (double)bright;
    free(q);
    free(l);
}

static bool write_all(const char *path, const void *data, size_t size)
{
    FILE *f = fopen(path, "ab");
    const bool ok = f && fwrite(data, 1, size, f) == size;
    return f && !fclose(f) && ok;
}

static bool read_all(const char *path, void *data, size_t size)
{
    FILE *f = fopen(path, "rb");
    const bool ok = f && fread(data, 1, size, f) == size;
    if (f)
        fclose(f);
    return ok;
}

static bool write_frames(const struct job *b)
{
    char path[80];
    float x[RESPONSE_CODES][3];
    for (int z = 0; z < RESPONSE_CODES; z++)
        for (int c = 0; c < 3; c++)
            x[z][c] = (float)exp(b->response.log_x[c][z]);
    snprintf(path, sizeof path, "%s/response", b->folder);
    bool ok = write_all(path, x, sizeof x);
    snprintf(path, sizeof path, "%s/frames", b->folder);
    for (int k = 0; ok && k < FRAMES; k++)
        ok = write_all(path, b->code[k], b->n);
    return ok;
}

// The peer program lies beside this one. False where it was not built.
static bool run_opencv(struct job *b, const char *method, double *wall_s)
{
    char self[4096], path[80], *line, *more;
    const ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
    self[n > 0 ? n : 0] = 0;
    char *slash = strrchr(self, '/');
    if (!slash)
        return false;
    *slash = 0;
    line = xasprintf("%s/nacre-hdr-peer %s %d %d %s/frames %s/response %s/out", self, method, b->w,
                     b->h, b->folder, b->folder, b->folder);
    for (int k = 0; k < FRAMES; k++) {
        more = xasprintf("%s %.9g", line, b->time_s[k]);
        free(line);
        line = more;
    }
    FILE *p = popen(line, "r");
    bool ok = p && fscanf(p, "%lf", wall_s) == 1;
    if (p)
        pclose(p);
    free(line);
    snprintf(path, sizeof path, "%s/out", b->folder);
    ok = ok && read_all(path, b->out, b->n * sizeof *b->out);
    unlink(path);
    return ok;
}

// pfshdrcalibrate recovers its own curve; it reads picture files by a list with exposures.
static bool run_pfstools(struct job *b, double *wall_s, struct err *e)
{
    char path[100], list[100], *line;
    if (system("command -v pfshdrcalibrate pfsinhdrgen pfsout >/dev/null 2>&1"))
        return false;
    snprintf(list, sizeof list, "%s/list.hdrgen", b->folder);
    FILE *f = fopen(list, "w");
    bool ok = f;
    for (int k = 0; ok && k < FRAMES; k++) {
        snprintf(path, sizeof path, "%s/%d.ppm", b->folder, k);
        char head[40];
        snprintf(head, sizeof head, "P6\n%d %d\n255\n", b->w, b->h);
        ok = write_all(path, head, strlen(head)) && write_all(path, b->code[k], b->n);
        fprintf(f, "%s %.9g 1 100 0\n", path, 1 / b->time_s[k]); // inverse time, f-number, ISO
    }
    if (f)
        fclose(f);
    const double start = omp_get_wtime();
    line = xasprintf("pfsinhdrgen %s | OMP_NUM_THREADS=1 pfshdrcalibrate 2>/dev/null | "
                     "pfsout %s/pfs.exr 2>/dev/null",
                     list, b->folder);
    ok = ok && !system(line);
    *wall_s = omp_get_wtime() - start;
    free(line);
    struct image im = {0};
    snprintf(path, sizeof path, "%s/pfs.exr", b->folder);
    ok = ok && image_read(&im, path, e) && im.w == b->w && im.h == b->h && im.nc >= 3;
    for (size_t k = 0; ok && k < b->n; k++)
        b->out[k] = im.px[k / 3 * (size_t)im.nc + k % 3];
    image_finish(&im);
    return ok;
}

static void add(struct bench_report *r, const struct job *b, const char *method,
                const char *setting, struct bench_time t)
{
    double median, brightest;
    char what[100];
    errors(b, b->out, &median, &brightest);
    bench_row(r, method, setting, t, median, "median relative error");
    snprintf(what, sizeof what, "%s: brightest 0.1 %% over truth", method);
    bench_figure(r, what, brightest, "x");
}

static bool codes(struct bench_report *r, struct err *e)
{
    struct job b;
    struct bench_time ours;
    char setting[80];
    const int cores = omp_get_max_threads(), w = bench_quick(r) ? 1500 : 3000, h = w * 2 / 3;
    double peer_s = NAN;
    bool ok = job_init(&b, w, h, e);
    omp_set_num_threads(1);
    ok = ok && bench_measure(run_ours, &b, &ours, e);
    omp_set_num_threads(cores);
    if (ok) {
        for (size_t k = 0; k < b.n; k++)
            b.out[k] = b.merged.px[k / 3 * 7 + k % 3];
        snprintf(setting, sizeof setting, "9 frames %d x %d, 8 bit, 1 thread", w, h);
        add(r, &b, "ours", setting, ours);
        bench_default(r);
        ok = write_frames(&b) || err_errno(e, "%s", b.folder);
    }
    static const char *const method[] = {"robertson", "debevec"};
    for (int m = 0; ok && m < 2; m++) {
        char name[80];
        if (!run_opencv(&b, method[m], &peer_s)) {
            bench_note(r, "nacre-hdr-peer is not built (Debian: libopencv-photo-dev): OpenCV's "
                          "merges are not compared");
            break;
        }
        snprintf(name, sizeof name, "opencv %s", method[m]);
        snprintf(setting, sizeof setting, "true response, %d x %d, 1 thread", w, h);
        add(r, &b, name, setting, (struct bench_time){peer_s, peer_s, NAN, 3});
        snprintf(name, sizeof name, "opencv %s takes, times ours (processor)", method[m]);
        bench_figure(r, name, peer_s / ours.cpu_s, "x");
    }
    if (ok && run_pfstools(&b, &peer_s, e))
        add(r, &b, "pfshdrcalibrate", "its own response",
            (struct bench_time){peer_s, peer_s, NAN, 1});
    else if (ok)
        bench_note(r, "pfshdrcalibrate is not installed (Debian: pfstools): not compared");
    job_finish(&b);
    return ok;
}

// Linear frames of a 12-bit sensor, two stops apart, over 12 stops of light.
static const double gain = 0.4, read_noise = 1.2, full = 3800;

struct linear {
    int w, h;
    float *px[LINEAR];
    float *truth;
    double time_s[LINEAR], log_scale[LINEAR];
    struct hdr_frames f;
    struct image merged;
};

static bool run_linear(void *ctx, struct err *e)
{
    struct linear *b = ctx;
    struct hdr_counts counts;
    image_finish(&b->merged);
    return hdr_merge(&b->f, HDR_POISSON, &b->merged, &counts, e);
}

static bool run_drift(void *ctx, struct err *e)
{
    struct linear *b = ctx;
    int unlinked;
    (void)e;
    exposure_drift(&b->f, b->log_scale, &unlinked);
    return true;
}

static bool linear_init(struct linear *b, int w, int h, double drift, struct err *e)
{
    const size_t n = (size_t)w * (size_t)h;
    *b = (struct linear){.w = w, .h = h};
    bool ok = (b->truth = sample_alloc(n, sizeof *b->truth, "scene", e));
    for (int k = 0; ok && k < LINEAR; k++) {
        ok = (b->px[k] = sample_alloc(n, sizeof(float), "frame", e));
        b->time_s[k] = exp2(-2 * k);
    }
#pragma omp parallel for schedule(static)
    for (int j = 0; j < h; j++) {
        uint64_t seed = 5 + (uint64_t)j;
        for (int i = 0; ok && i < w; i++) {
            const size_t at = (size_t)j * (size_t)w + (size_t)i;
            const double l = exp2(8 + 12.0 * i / w);
            b->truth[at] = (float)l;
            for (int k = 0; k < LINEAR; k++) {
                const double x = l * b->time_s[k] * pow(1 + drift, k);
                const double noisy =
                    x + sqrt(gain * x + read_noise * read_noise) * noise_gauss(&seed);
                b->px[k][at] = (float)fmin(noisy, full);
            }
        }
    }
    b->f = (struct hdr_frames){LINEAR,
                               w,
                               h,
                               1,
                               (const float *const *)b->px,
                               b->time_s,
                               full,
                               {read_noise * read_noise, gain}};
    return ok;
}

static void linear_finish(struct linear *b)
{
    for (int k = 0; k < LINEAR; k++)
        free(b->px[k]);
    free(b->truth);
    image_finish(&b->merged);
}

// Fisher information about the radiance in a sample of mean x that is cut off at `full`: Phi(z) - z
// phi(z) + phi(z)^2 / (1 - Phi(z)) of the whole (Tobin 1958).
static double information(double x, double time_s)
{
    const double v = gain * x + read_noise * read_noise, z = (full - x) / sqrt(v);
    const double phi = exp(-0.5 * z * z) / sqrt(2 * M_PI), over = 0.5 * erfc(z / M_SQRT2);
    const double part = z > 30 ? 1 : z < -6 ? 0 : 1 - over - z * phi + phi * phi / over;
    return part * time_s * time_s / v;
}

// The worst of ten stops: |variance / Cramer-Rao bound - 1| and |bias|.
static void against_bound(const struct linear *b, double *variance, double *bias)
{
    *variance = *bias = 0;
    for (int stop = 1; stop <= 10; stop++) {
        double chi = 0, sum = 0;
        long n = 0;
        for (int j = 0; j < b->h; j++)
            for (int i = stop * b->w / 12; i < (stop + 1) * b->w / 12; i++) {
                const size_t at = (size_t)j * (size_t)b->w + (size_t)i;
                const double l = (double)b->truth[at], d = (double)b->merged.px[3 * at] - l;
                double bound = 0;
                for (int k = 0; k < LINEAR; k++)
                    bound += information(l * b->time_s[k], b->time_s[k]);
                chi += d * d * bound;
                sum += d / l;
                n++;
            }
        *variance = fmax(*variance, fabs(chi / (double)n - 1));
        *bias = fmax(*bias, fabs(sum / (double)n));
    }
}

static bool frames(struct bench_report *r, struct err *e)
{
    struct linear b;
    struct bench_time t;
    double variance, bias, worst = 0;
    const int w = bench_quick(r) ? 1200 : 2400, h = w / 2;
    char setting[80];
    bool ok = linear_init(&b, w, h, 0, e) && bench_measure(run_linear, &b, &t, e);
    if (ok) {
        against_bound(&b, &variance, &bias);
        snprintf(setting, sizeof setting, "%d frames %d x %d, 12 bit, all cores", LINEAR, w, h);
        bench_row(r, "linear", setting, t, variance, "variance over Cramer-Rao, worst of 10 stops");
        bench_figure(r, "linear: bias, worst of 10 stops", bias, "relative");
    }
    linear_finish(&b);
    ok = ok && linear_init(&b, w, h, 0.03, e) && bench_measure(run_drift, &b, &t, e);
    if (ok) {
        for (int k = 0; k < LINEAR; k++)
            worst = fmax(worst, fabs(expm1(b.log_scale[k] - b.log_scale[0] - k * log(1.03))));
        bench_row(r, "drift", "3 % a frame", t, worst, "what is left, relative");
        linear_finish(&b);
    }
    return ok;
}

static bool run(struct bench_report *r, struct err *e)
{
    return codes(r, e) && frames(r, e);
}

const struct bench bench_hdr = {
    "hdr", "merging brackets against the true light, and against OpenCV and pfstools", run};
