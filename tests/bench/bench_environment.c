// bench_environment.c - prefiltering: exact, separable and direct, time against error.
#define _GNU_SOURCE
#include "core/log.h"
#include "process/env_direct.h"
#include "process/env_exact.h"
#include "process/env_separable.h"
#include "tests/bench/bench.h"
#include <math.h>
#include <stdio.h>

enum { NODES = 1024, POINTS = 64 };

struct job {
    struct environment env;
    struct table lut;
    struct frame frame;
    struct fresnel fresnel;
    struct env_how how;
    struct env_kernel kernel;
    struct factors factors;
    struct separable separable;
    struct image out;
    double truth[POINTS][8];
    int n;
};

static bool read_case(struct job *j, struct err *e)
{
    const struct table_nodes nodes = {.6, 1};
    FILE *f = fopen(bench_shared("reference/env/truth.csv"), "r");
    char line[400];
    while (f && fgets(line, sizeof line, f) && j->n < POINTS) {
        double *v = j->truth[j->n];
        j->n += sscanf(line, "%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf", v, v + 1, v + 2, v + 3, v + 4,
                       v + 5, v + 6, v + 7) == 8;
    }
    if (f)
        fclose(f);
    frame_from(v3(0.02485224698535815, 0.932164182982101, -0.3611818126443947),
               v3(-0.4075768572238095, -0.32045440146607745, -0.855096533753108), &j->frame);
    return table_read(&j->lut, bench_shared("reference/env/lut.pfm"), &nodes, e) &&
           environment_read(&j->env, bench_shared("reference/env/env.pfm"), e);
}

static bool cold(void *ctx, struct err *e)
{
    struct job *j = ctx;
    image_finish(&j->out);
    env_kernel_finish(&j->kernel);
    return env_kernel_init(&j->kernel, &j->lut, &j->fresnel, &j->how, e) &&
           env_exact(&j->kernel, &j->env, &j->frame, NODES, &j->out, e);
}

static bool warm(void *ctx, struct err *e)
{
    struct job *j = ctx;
    image_finish(&j->out);
    return env_exact(&j->kernel, &j->env, &j->frame, NODES, &j->out, e);
}

static bool blurred(void *ctx, struct err *e)
{
    struct job *j = ctx;
    image_finish(&j->out);
    return env_separable(&j->factors, &j->env, &j->frame, &j->separable, &j->out, e);
}

static bool judged(void *ctx, struct err *e)
{
    struct job *j = ctx;
    const double o[1][2] = {{j->truth[0][0], j->truth[0][1]}};
    double rgb[1][3];
    return env_direct(&j->lut, &j->fresnel, &j->env, &j->frame, 1, o, rgb, e);
}

static double bilinear(const struct image *im, double x, double y, int c)
{
    const int i = (int)floor(x), k = (int)floor(y);
    const float *p = im->px + ((size_t)k * (size_t)im->w + (size_t)i) * 3 + c;
    const float *q = p + 3 * im->w;
    return (1 - y + k) * ((1 - x + i) * (double)p[0] + (x - i) * (double)p[3]) +
           (y - k) * ((1 - x + i) * (double)q[0] + (x - i) * (double)q[3]);
}

// Relative L2 against the truth; of the separable map where o is at most `cone` off the normal.
static double error(const struct job *j, bool is_map, double cone)
{
    double wrong = 0, all = 0;
    for (int k = 0; k < j->n; k++) {
        const double *v = j->truth[k], on = sqrt(1 - v[0] * v[0] - v[1] * v[1]);
        double x = (v[0] + 1) / 2 * (NODES - 1), y = (v[1] + 1) / 2 * (NODES - 1);
        if (acos(on) > cone)
            continue;
        if (is_map)
            latlong_pixel(frame_world(&j->frame, v3(-v[0], -v[1], on)), j->out.w, j->out.h, &x, &y);
        for (int c = 0; c < 3; c++) {
            const double want = v[2 + c + (j->fresnel.schlick ? 3 : 0)];
            const double d = bilinear(&j->out, x, y, c) - want;
            wrong += d * d;
            all += want * want;
        }
    }
    return sqrt(wrong / all);
}

static const char of_all[] = "relative L2, truth.csv";
static const char of_near[] = "relative L2, o within 30 deg";

static bool exact_rows(struct bench_report *r, struct job *j, double *cold_s, struct err *e)
{
    static const int products[] = {1, 4, 6, 9, 12, 16};
    struct bench_time t;
    char text[80];
    for (int s = 0; s < 2; s++) {
        j->fresnel = (struct fresnel){s == 1, .04};
        j->how = (struct env_how){.tolerance = 1e-3, .detail_rad = M_PI / j->env.map.h};
        if (!bench_measure(cold, j, &t, e))
            return false;
        snprintf(text, sizeof text, "1024 nodes, %s, cold", s ? "Schlick 1e-3" : "constant");
        bench_row(r, "exact", text, t, error(j, false, 2), of_all);
        if (!s)
            *cold_s = t.wall_s;
        if (!bench_measure(warm, j, &t, e))
            return false;
        snprintf(text, sizeof text, "1024 nodes, %s, a new turn", s ? "Schlick 1e-3" : "constant");
        bench_row(r, "exact", text, t, error(j, false, 2), of_all);
    }
    for (int k = 0; k < 6; k++) {
        j->how.products = products[k];
        if (!bench_measure(cold, j, &t, e))
            return false;
        snprintf(text, sizeof text, "1024 nodes, Schlick, %d products", products[k]);
        bench_row(r, "products", text, t, error(j, false, 2), of_all);
    }
    return true;
}

static bool separable_rows(struct bench_report *r, struct job *j, double *rank1_s, struct err *e)
{
    static const int ranks[] = {1, 3, 11, 21};
    struct bench_time t;
    char text[80];
    j->fresnel.schlick = false;
    for (int k = 0; k < (bench_quick(r) ? 1 : 4); k++) {
        j->separable = (struct separable){bench_quick(r) ? 1536 : 3070, 256, true};
        factors_finish(&j->factors);
        if (!factor(&j->factors, &j->lut, ranks[k], false, false, e) ||
            !bench_measure(blurred, j, &t, e))
            return false;
        snprintf(text, sizeof text, "%d wide, 256 taps, rank %d", j->separable.width, ranks[k]);
        bench_row(r, "separable", text, t, error(j, true, M_PI / 6), of_near);
        if (!k)
            *rank1_s = t.wall_s;
    }
    return true;
}

static bool run(struct bench_report *r, struct err *e)
{
    if (!bench_shared("reference/env/truth.csv")) {
        bench_note(r, "reference data absent: no environment to filter");
        return true;
    }
    struct job j = {0};
    struct bench_time t = {0};
    double exact_s = 0, rank1_s = 0;
    const bool ok = read_case(&j, e) && exact_rows(r, &j, &exact_s, e) &&
                    separable_rows(r, &j, &rank1_s, e) && bench_measure(judged, &j, &t, e);
    if (ok) {
        bench_figure(r, "direct / exact (one direction times the nodes of the disk)",
                     t.wall_s * M_PI / 4 * NODES * NODES / exact_s, "times");
        bench_figure(r, "separable rank 1 / exact, cold", rank1_s / exact_s, "times");
    }
    image_finish(&j.out);
    env_kernel_finish(&j.kernel);
    factors_finish(&j.factors);
    table_finish(&j.lut);
    environment_finish(&j.env);
    return ok;
}

const struct bench bench_environment = {
    .name = "environment",
    .summary = "a diffracting sample under an environment",
    .run = run,
};
