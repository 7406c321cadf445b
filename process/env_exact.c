// env_exact.c - light on the grid, products in frequency, the map over o.
#define _GNU_SOURCE
#include "process/env_exact.h"
#include "core/mem.h"
#include "process/bspline.h"
#include "process/fft.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Power at each node of the mirrored grid (-i_t, -i_b): LANE values, of which the first three are
// the sums of power R, G, B, the next three those of power times i_n.
enum { LANE = 8, STRIPS = 16, ROWS = 16 };

static void add_part(const struct env_grid *g, const struct env_part *p, int from, int to,
                     double *light)
{
    double wx[4], wy[4];
    const double x = g->half - p->t / g->step, y = g->half - p->b / g->step;
    const int i = (int)x, j = (int)y; // both > 0
    if (j + 3 <= from || j > to)
        return;
    bspline_weights(x - i, wx);
    bspline_weights(y - j, wy);
    double v[LANE] = {0};
    for (int c = 0; c < 3; c++) {
        v[c] = p->power[c];
        v[c + 3] = p->power[c] * p->n;
    }
    for (int q = 0; q < 4; q++) {
        if (j + q - 1 < from || j + q - 1 >= to)
            continue;
        double *node = light + ((size_t)(j + q - 1) * (size_t)g->side + (size_t)(i - 1)) * LANE;
        for (int r = 0; r < 4; r++, node += LANE)
            for (int c = 0; c < LANE; c++)
                node[c] += wy[q] * wx[r] * v[c];
    }
}

// Whatever the number of threads, each node sums its parts in the order of the map: a thread owns
// a strip of nodes and reads all parts.
static bool gather_light(const struct env_grid *g, const struct environment *env,
                         const struct frame *f, double *light, struct err *e)
{
    const int h = env->map.h, cut = (int)fmax(1, ceil(M_PI / h / g->step));
    struct env_parts parts;
    if (!env_parts_init(&parts, env, f, cut, e))
        return false;
    const size_t room = env_parts_room(&parts);
    struct env_part *part = sample_alloc(room * ROWS, sizeof *part, "light", e);
    if (!part) {
        env_parts_finish(&parts);
        return false;
    }
    for (int row = 0; row < h; row += ROWS) {
        const int rows = h - row < ROWS ? h - row : ROWS;
        int count[ROWS];
#pragma omp parallel for schedule(dynamic)
        for (int r = 0; r < rows; r++)
            count[r] = env_parts_row(&parts, row + r, part + room * (size_t)r);
#pragma omp parallel for schedule(dynamic)
        for (int s = 0; s < STRIPS; s++)
            for (int r = 0; r < rows; r++)
                for (int k = 0; k < count[r]; k++)
                    add_part(g, part + room * (size_t)r + k, g->side * s / STRIPS,
                             g->side * (s + 1) / STRIPS, light);
    }
    free(part);
    env_parts_finish(&parts);
    const size_t line = (size_t)g->side * LANE;
#pragma omp parallel for
    for (int j = 0; j < g->side; j++)
        bspline_fit_vectors(light + (size_t)j * line, g->side, LANE, LANE);
#pragma omp parallel for
    for (int i = 0; i < g->side; i += STRIPS)
        bspline_fit_vectors(light + (size_t)i * LANE, g->side, line,
                            (size_t)(g->side - i < STRIPS ? g->side - i : STRIPS) * LANE);
    return true;
}

// Power times i_n^k of one channel, transformed. i_n^2 = 1 - i_t^2 - i_b^2 is a polynomial, so it
// is taken at the nodes (also just outside the disk); an odd power needs one i_n of the parts.
static void transform_light(const struct env_grid *g, const struct fft *fft, const double *light,
                            int c, int k, double *spec)
{
    const size_t line = 2 * ((size_t)g->period / 2 + 1);
    memset(spec, 0, (size_t)g->period * line * sizeof *spec);
    for (int j = 0; j < g->side; j++) {
        const double b = (j - g->half) * g->step;
        const double *from = light + (size_t)j * (size_t)g->side * LANE + (k % 2 ? 3 : 0) + c;
        double *to = spec + (size_t)j * line;
        for (int i = 0; i < g->side; i++) {
            const double t = (i - g->half) * g->step, n2 = 1 - t * t - b * b;
            double x = from[(size_t)i * LANE];
            for (int p = 0; p < k / 2; p++)
                x *= n2;
            to[i] = x;
        }
    }
    fft_run(fft, spec, spec);
}

static double binomial(int n, int k)
{
    return k == 0 ? 1 : binomial(n - 1, k - 1) * n / k;
}

// w^k = (i_n + o_n)^k: what is multiplied with o_n^p is the sum over k of
// (k over p) kernel_k light_{k-p}. Replaces light_p; line by line, so that all fit in cache.
static void multiply(const struct env_kernel *k, int c, double *const *light)
{
    const int degree = k->zonal.degree, half = k->grid.period / 2 + 1;
    const size_t line = 2 * (size_t)half;
#pragma omp parallel for schedule(static)
    for (int j = 0; j < k->grid.period; j++) {
        double *sum = xcalloc((size_t)(degree + 1) * line, sizeof *sum);
        for (int p = 0; p <= degree; p++)
            for (int d = p; d <= degree; d++) {
                if (!k->spec[c][d])
                    continue;
                const double *a = k->spec[c][d] + (size_t)j * line;
                const double *b = light[d - p] + (size_t)j * line, weight = binomial(d, p);
                double *to = sum + (size_t)p * line;
                for (int i = 0; i < half; i++) {
                    to[2 * i] += weight * (a[2 * i] * b[2 * i] - a[2 * i + 1] * b[2 * i + 1]);
                    to[2 * i + 1] += weight * (a[2 * i] * b[2 * i + 1] + a[2 * i + 1] * b[2 * i]);
                }
            }
        for (int p = 0; p <= degree; p++)
            memcpy(light[p] + (size_t)j * line, sum + (size_t)p * line, line * sizeof *sum);
        free(sum);
    }
}

// Where the nodes of the map lie on the grid: four weights each.
struct look {
    int first;
    double w[4];
};

static void look_at(const struct env_grid *g, double cosine, struct look *l)
{
    const double x = cosine / g->step + g->half;
    l->first = (int)x - 1;
    bspline_weights(x - (int)x, l->w);
}

// One row of the map: sum over p of o_n^p plane_p, over o_n.
static void map_row(const struct env_kernel *k, double *const *plane, const struct look *look,
                    int n, int j, int c, double *mid, float *px)
{
    const struct env_grid *g = &k->grid;
    const size_t line = 2 * ((size_t)g->period / 2 + 1);
    const double ob = env_map_cosine(j, n);
    for (int p = 0; p <= k->zonal.degree; p++)
        for (int i = 0; i < g->side; i++) {
            const double *from = plane[p] + (size_t)look[j].first * line + i;
            const double *w = look[j].w;
            mid[p * g->side + i] =
                w[0] * from[0] + w[1] * from[line] + w[2] * from[2 * line] + w[3] * from[3 * line];
        }
    for (int i = 0; i < n; i++) {
        const double ot = env_map_cosine(i, n), on2 = 1 - ot * ot - ob * ob;
        if (on2 <= 0)
            continue;
        const double on = sqrt(on2), *w = look[i].w;
        double sum = 0;
        for (int p = k->zonal.degree; p >= 0; p--) {
            const double *from = mid + p * g->side + look[i].first;
            sum = sum * on + w[0] * from[0] + w[1] * from[1] + w[2] * from[2] + w[3] * from[3];
        }
        px[3 * i + c] = (float)(k->not_negative ? fmax(0, sum / on) : sum / on);
    }
}

static void read_map(const struct env_kernel *k, double *const *plane, int n, int c,
                     struct image *out)
{
    struct look *look = xcalloc((size_t)n, sizeof *look);
    for (int i = 0; i < n; i++)
        look_at(&k->grid, env_map_cosine(i, n), &look[i]);
#pragma omp parallel
    {
        double *mid = xcalloc((size_t)(k->zonal.degree + 1) * (size_t)k->grid.side, sizeof *mid);
#pragma omp for schedule(dynamic, 16)
        for (int j = 0; j < n; j++)
            map_row(k, plane, look, n, j, c, mid, out->px + (size_t)j * (size_t)n * 3);
        free(mid);
    }
    free(look);
}

bool env_exact(const struct env_kernel *k, const struct environment *env, const struct frame *f,
               int n, struct image *out, struct err *e)
{
    const struct env_grid *g = &k->grid;
    const int planes = k->zonal.degree + 1;
    const size_t size = (size_t)g->period * 2 * ((size_t)g->period / 2 + 1);
    double *light = sample_alloc((size_t)g->side * (size_t)g->side * LANE, sizeof *light,
                                 "light on the grid", e);
    struct fft *forward = fft_new(FFT_R2C, FFT_DOUBLE, g->period, g->period, 1, true, e);
    struct fft *backward = fft_new(FFT_C2R, FFT_DOUBLE, g->period, g->period, 1, true, e);
    double *plane[ZONAL_MOST + 1] = {0};
    bool ok = light && forward && backward && gather_light(g, env, f, light, e);
    for (int p = 0; p < planes && ok; p++)
        ok = (plane[p] = sample_alloc(size, sizeof **plane, "light on the grid", e));
    ok = ok && image_init(out, n, n, 3, e);
    for (int c = 0; c < 3 && ok; c++) {
#pragma omp parallel for schedule(dynamic)
        for (int p = 0; p < planes; p++)
            transform_light(g, forward, light, c, p, plane[p]);
        multiply(k, c, plane);
#pragma omp parallel for schedule(dynamic)
        for (int p = 0; p < planes; p++)
            fft_run(backward, plane[p], plane[p]);
        read_map(k, plane, n, c, out);
    }
    for (int p = 0; p < planes; p++)
        free(plane[p]);
    fft_free(forward);
    fft_free(backward);
    free(light);
    return ok;
}
