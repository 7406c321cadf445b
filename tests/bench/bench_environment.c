// bench_environment.c - prefiltering: exact, separable and direct, time against error.
#define _GNU_SOURCE
#include "tests/bench/bench_environment.h"
#include "core/mem.h"
#include "process/env_direct.h"
#include "process/env_exact.h"
#include "process/env_separable.h"
#include "process/factor_lines.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NODES = 1024, POINTS = 64, JUDGED = 16 };

struct job {
    struct environment env;
    struct table lut;
    struct frame frame;
    struct fresnel fresnel;
    struct env_how how;
    struct env_kernel kernel;
    struct env_light light;
    struct factors factors;
    struct separable separable;
    struct image out;
    double truth[POINTS][8]; // o_t, o_b, constant R, G, B, Schlick R, G, B
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

static bool new_turn(void *ctx, struct err *e)
{
    struct job *j = ctx;
    image_finish(&j->out);
    return env_exact(&j->kernel, &j->env, &j->frame, NODES, &j->out, e);
}

static bool new_table(void *ctx, struct err *e) // or a turn about the normal: light is kept
{
    struct job *j = ctx;
    image_finish(&j->out);
    env_kernel_finish(&j->kernel);
    return env_kernel_init(&j->kernel, &j->lut, &j->fresnel, &j->how, e) &&
           env_exact_map(&j->kernel, &j->light, NODES, &j->out, e);
}

static bool blurred(void *ctx, struct err *e)
{
    struct job *j = ctx;
    image_finish(&j->out);
    return env_separable(&j->factors, &j->env, &j->frame, &j->separable, &j->out, e);
}

// Directions all over the disk, out to the rim.
static void spread(int n, double (*o)[2])
{
    for (int k = 0; k < n; k++) {
        const double r = .99 * sqrt((k + .5) / n);
        o[k][0] = r * cos(2.4 * k);
        o[k][1] = r * sin(2.4 * k);
    }
}

static bool judged(void *ctx, struct err *e)
{
    struct job *j = ctx;
    double o[JUDGED][2], rgb[JUDGED][3];
    spread(JUDGED, o);
    return env_direct(&j->lut, &j->fresnel, &j->env, &j->frame, JUDGED, (const double(*)[2])o, rgb,
                      e);
}

// Lagrange cubic between nodes: bilinear reading would be most of the error.
static void weights(double x, int n, int *first, double w[4])
{
    *first = (int)fmax(0, fmin(n - 4, floor(x) - 1));
    for (int k = 0; k < 4; k++) {
        w[k] = 1;
        for (int m = 0; m < 4; m++)
            if (m != k)
                w[k] *= (x - *first - m) / (k - m);
    }
}

static double cubic(const struct image *im, double x, double y, int c)
{
    double wx[4], wy[4], sum = 0;
    int i, j;
    weights(x, im->w, &i, wx);
    weights(y, im->h, &j, wy);
    for (int q = 0; q < 16; q++)
        sum +=
            wx[q % 4] * wy[q / 4] *
            (double)
                im->px[((size_t)(j + q / 4) * (size_t)im->w + (size_t)(i + q % 4)) * 3 + (size_t)c];
    return sum;
}

struct off {
    double l2, worst; // relative
};

// Against truth.csv, where o is at most `cone` off the normal; of a lat-long map, or over o.
static struct off error(const struct job *j, bool latlong, double cone)
{
    double wrong = 0, all = 0, worst = 0;
    for (int k = 0; k < j->n; k++) {
        const double *v = j->truth[k], on = sqrt(1 - v[0] * v[0] - v[1] * v[1]);
        double x = (v[0] + 1) / 2 * (NODES - 1), y = (v[1] + 1) / 2 * (NODES - 1);
        if (acos(on) > cone)
            continue;
        if (latlong)
            latlong_pixel(frame_world(&j->frame, v3(-v[0], -v[1], on)), j->out.w, j->out.h, &x, &y);
        for (int c = 0; c < 3; c++) {
            const double want = v[2 + c + (j->fresnel.schlick ? 3 : 0)];
            const double d = cubic(&j->out, x, y, c) - want;
            wrong += d * d;
            all += want * want;
            worst = fmax(worst, fabs(d / want));
        }
    }
    return (struct off){sqrt(wrong / all), worst};
}

static const double whole = 2, near = M_PI / 6;

struct compared { // seconds and errors that the figures are made of
    double exact_s, exact_near, rank1_s, rank1_near, two_passes_s;
};

static const char of_all[] = "relative L2, truth.csv";
static const char of_near[] = "relative L2, o within 30 deg";

// Two rows: of all of truth.csv, and of where R17's assumption holds. Two plots, then.
static void rows_of(struct bench_report *r, const struct job *j, const char *method,
                    const char *text, struct bench_time t, bool latlong)
{
    bench_row(r, method, text, t, error(j, latlong, whole).l2, of_all);
    bench_row(r, method, text, t, error(j, latlong, near).l2, of_near);
}

static bool measure(struct bench_report *r, struct job *j, bool (*fn)(void *, struct err *),
                    const char *method, const char *text, struct bench_time *t, struct err *e)
{
    if (!bench_measure(fn, j, t, e))
        return false;
    if (fn == cold)
        rows_of(r, j, method, text, *t, false);
    else // the same map once more
        bench_row(r, method, text, *t, error(j, false, whole).l2, of_all);
    return true;
}

static bool exact_rows(struct bench_report *r, struct job *j, struct compared *c, struct err *e)
{
    static const int products[] = {1, 4, 6, 9, 12, 16};
    static const char *const names[] = {"constant", "Schlick 1e-3"};
    struct bench_time t;
    char text[80];
    for (int s = 0; s < 2; s++) {
        j->fresnel = (struct fresnel){s == 1, .04};
        j->how = (struct env_how){.tolerance = 1e-3, .detail_rad = M_PI / j->env.map.h};
        snprintf(text, sizeof text, "1024 nodes, %s, cold", names[s]);
        if (!measure(r, j, cold, "exact", text, &t, e))
            return false;
        const struct off off = error(j, false, whole);
        snprintf(text, sizeof text, "exact, %s: worst value of truth.csv", names[s]);
        bench_figure(r, text, 100 * off.worst, "%");
        if (!s)
            *c = (struct compared){t.wall_s, error(j, false, near).l2, 0, 0, 0};
        snprintf(text, sizeof text, "1024 nodes, %s, a new turn", names[s]);
        if (!measure(r, j, new_turn, "exact", text, &t, e))
            return false;
        snprintf(text, sizeof text, "1024 nodes, %s, light kept", names[s]);
        if (!env_light_init(&j->light, &j->kernel, &j->env, &j->frame, 0, 0, e) ||
            !measure(r, j, new_table, "exact", text, &t, e))
            return false;
        env_light_finish(&j->light);
    }
    for (int k = 0; k < 6; k++) {
        j->how.products = products[k];
        snprintf(text, sizeof text, "1024 nodes, Schlick, %d product%s", products[k],
                 products[k] > 1 ? "s" : "");
        if (!measure(r, j, cold, "products", text, &t, e))
            return false;
    }
    j->fresnel.schlick = false;
    j->how.products = 0;
    return true;
}

// The reference table is one product; seen along axes 30 degrees off it needs many, and sample and
// directions turned the other way make it the same case.
static bool turned_rows(struct bench_report *r, const struct job *j, struct err *e)
{
    static const int ranks[] = {1, 3, 11, 21};
    const double angle = M_PI / 6, angles[2] = {angle, angle + M_PI / 2};
    struct job t = {.env = j->env, .separable = {1536, 256, true}, .n = j->n};
    struct aligned al;
    char text[80];
    bool ok = aligned_init(&al, &j->lut, angles, 0, e);
    if (!ok)
        return false;
    const double c = cos(angle), s = sin(angle);
    const struct frame *f = &j->frame;
    t.frame = (struct frame){v3_add(v3_scale(c, f->t), v3_scale(s, f->b)),
                             v3_add(v3_scale(-s, f->t), v3_scale(c, f->b)), f->n};
    for (int k = 0; k < j->n; k++) {
        const double *v = j->truth[k], o[2] = {c * v[0] + s * v[1], c * v[1] - s * v[0]};
        memcpy(t.truth[k], v, sizeof t.truth[k]);
        memcpy(t.truth[k], o, sizeof o);
    }
    for (int k = 0; k < (bench_quick(r) ? 2 : 4) && ok; k++) {
        struct bench_time time;
        factors_finish(&t.factors);
        ok = factor(&t.factors, &al.t, ranks[k], false, false, e) &&
             bench_measure(blurred, &t, &time, e);
        snprintf(text, sizeof text, "%d wide, table turned 30 deg, rank %d", t.separable.width,
                 ranks[k]);
        if (ok)
            rows_of(r, &t, "separable", text, time, true);
    }
    aligned_finish(&al);
    factors_finish(&t.factors);
    image_finish(&t.out);
    return ok;
}

static bool separable_rows(struct bench_report *r, struct job *j, struct compared *c, struct err *e)
{
    struct bench_time t;
    char text[80];
    if (!factor(&j->factors, &j->lut, 1, false, false, e))
        return false;
    for (int four = 0; four < 2; four++) {
        j->separable = (struct separable){bench_quick(r) ? 1536 : 3070, 256, four};
        if (!bench_measure(blurred, j, &t, e))
            return false;
        if (!four)
            c->two_passes_s = t.wall_s;
        snprintf(text, sizeof text, "%d wide, 256 taps, rank 1, %s passes", j->separable.width,
                 four ? "four" : "two");
        rows_of(r, j, "separable", text, t, true);
    }
    c->rank1_s = t.wall_s;
    c->rank1_near = error(j, true, near).l2;
    return turned_rows(r, j, e);
}

static void figures(struct bench_report *r, const struct compared *c, double direct_s)
{
    char text[120];
    snprintf(text, sizeof text, "direct (%d directions, times the nodes of the disk) / exact, cold",
             JUDGED);
    bench_figure(r, text, direct_s / JUDGED * M_PI / 4 * NODES * NODES / c->exact_s, "times");
    bench_figure(r, "separable rank 1, four passes / exact, cold", c->rank1_s / c->exact_s,
                 "times");
    bench_figure(r, "separable rank 1, two passes / exact, cold", c->two_passes_s / c->exact_s,
                 "times");
    bench_figure(r, "error of separable rank 1 / of exact, within 30 deg",
                 c->rank1_near / c->exact_near, "times");
}

static bool run(struct bench_report *r, struct err *e)
{
    if (!bench_shared("reference/env/truth.csv")) {
        bench_note(r, "reference data absent: no environment to filter");
        return true;
    }
    struct job j = {0};
    struct bench_time t = {0};
    struct compared c = {0};
    const bool ok = read_case(&j, e) && exact_rows(r, &j, &c, e) && separable_rows(r, &j, &c, e) &&
                    bench_measure(judged, &j, &t, e) && bench_frames(r, &j.lut, &j.env, e) &&
                    bench_one_core(r, e) && bench_leading(r, &j.lut, e);
    if (ok)
        figures(r, &c, t.wall_s);
    image_finish(&j.out);
    env_kernel_finish(&j.kernel);
    env_light_finish(&j.light);
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
