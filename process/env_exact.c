// env_exact.c - products in frequency, and the map over o.
#define _GNU_SOURCE
#include "process/env_exact.h"
#include "core/mem.h"
#include "process/bspline.h"
#include "process/fft.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// plane[p] = sum over the terms with post function p of weight kernel light; line by line, so that
// all of it fits in cache.
static void multiply(const struct env_kernel *k, const struct env_light *l, int c,
                     double *const *plane)
{
    const int half = k->grid.period / 2 + 1;
    const size_t line = 2 * (size_t)half;
#pragma omp parallel for schedule(static)
    for (int j = 0; j < k->grid.period; j++) {
        for (int p = 0; p < k->terms.n_post; p++)
            memset(plane[p] + (size_t)j * line, 0, line * sizeof **plane);
        for (int q = 0; q < k->terms.n; q++) {
            const struct env_term *term = &k->terms.term[q];
            const double *a = k->spec[c][term->kernel] + (size_t)j * line;
            const double *b = l->spec[c][term->pre] + (size_t)j * line, weight = term->weight;
            double *to = plane[term->post] + (size_t)j * line;
            for (int i = 0; i < half; i++) {
                to[2 * i] += weight * (a[2 * i] * b[2 * i] - a[2 * i + 1] * b[2 * i + 1]);
                to[2 * i + 1] += weight * (a[2 * i] * b[2 * i + 1] + a[2 * i + 1] * b[2 * i]);
            }
        }
    }
}

// Where the nodes of the map lie on the grid: four weights each; first < 0 outside the window.
struct look {
    int first;
    double w[4];
};

static void look_at(const struct env_light *l, double first_node, double cosine, double middle,
                    struct look *look)
{
    const double x = (cosine - first_node) / l->grid.step;
    look->first = fabs(cosine - middle) <= .5 * l->grid.span + 1e-9 ? (int)x - 1 : -1;
    bspline_weights(x - (int)x, look->w);
}

struct reading {
    const struct env_kernel *k;
    const struct env_light *l;
    int n, c;
    const struct look *t, *b; // [n]
    double *const *plane;
    struct image *out;
};

// One row of the map: sum over p of post_p(o) plane_p(o), over o_n.
static void map_row(const struct reading *r, int j, double *mid, double *even, double *odd)
{
    const int side = r->l->grid.side, posts = r->k->terms.n_post;
    const size_t line = 2 * ((size_t)r->l->grid.period / 2 + 1);
    const double ob = env_map_cosine(j, r->n), *w = r->b[j].w;
    for (int p = 0; p < posts; p++) {
        direction_poly_row(&r->k->terms.post[p], ob, even + p * (POLY_MOST + 1),
                           odd + p * (POLY_MOST + 1));
        const double *from = r->plane[p] + (size_t)r->b[j].first * line;
        for (int i = 0; i < side; i++)
            mid[p * side + i] = w[0] * from[i] + w[1] * from[(size_t)i + line] +
                                w[2] * from[(size_t)i + 2 * line] +
                                w[3] * from[(size_t)i + 3 * line];
    }
    float *px = r->out->px + (size_t)j * (size_t)r->n * 3 + r->c;
    for (int i = 0; i < r->n; i++) {
        const double ot = env_map_cosine(i, r->n), on2 = 1 - ot * ot - ob * ob;
        if (on2 <= 0 || r->t[i].first < 0)
            continue;
        const double on = sqrt(on2);
        double sum = 0;
        for (int p = 0; p < posts; p++) {
            const double *from = mid + p * side + r->t[i].first, *v = r->t[i].w;
            const double *ev = even + p * (POLY_MOST + 1), *od = odd + p * (POLY_MOST + 1);
            double post = 0;
            for (int q = r->k->terms.post[p].degree; q >= 0; q--)
                post = post * ot + ev[q] + on * od[q];
            sum += post * (v[0] * from[0] + v[1] * from[1] + v[2] * from[2] + v[3] * from[3]);
        }
        px[3 * i] = (float)(r->k->not_negative ? fmax(0, sum / on) : sum / on);
    }
}

static void read_map(const struct reading *r)
{
    const int posts = r->k->terms.n_post;
#pragma omp parallel
    {
        double *mid = xcalloc((size_t)posts * (size_t)r->l->grid.side, sizeof *mid);
        double *polys = xcalloc((size_t)posts * 2 * (POLY_MOST + 1), sizeof *polys);
#pragma omp for schedule(dynamic, 16)
        for (int j = 0; j < r->n; j++)
            if (r->b[j].first >= 0)
                map_row(r, j, mid, polys, polys + posts * (POLY_MOST + 1));
        free(mid);
        free(polys);
    }
}

static bool filter(struct reading *r, double *const *plane, struct err *e)
{
    const int period = r->l->grid.period;
    struct fft *back = fft_new(FFT_C2R, FFT_DOUBLE, period, period, 1, true, e);
    if (!back)
        return false;
    for (r->c = 0; r->c < 3; r->c++) {
        multiply(r->k, r->l, r->c, plane);
#pragma omp parallel for schedule(dynamic)
        for (int p = 0; p < r->k->terms.n_post; p++)
            fft_run(back, plane[p], plane[p]);
        read_map(r);
    }
    fft_free(back);
    return true;
}

bool env_exact_map(const struct env_kernel *k, const struct env_light *l, int n, struct image *out,
                   struct err *e)
{
    const size_t period = (size_t)l->grid.period, size = period * 2 * (period / 2 + 1);
    double *plane[TERMS_MOST] = {0};
    struct look *look = xcalloc(2 * (size_t)n, sizeof *look);
    for (int i = 0; i < n; i++) {
        look_at(l, l->t0, env_map_cosine(i, n), l->t, &look[i]);
        look_at(l, l->b0, env_map_cosine(i, n), l->b, &look[n + i]);
    }
    bool ok = true;
    for (int p = 0; p < k->terms.n_post && ok; p++)
        ok = (plane[p] = sample_alloc(size, sizeof **plane, "light on the grid", e));
    struct reading r = {k, l, n, 0, look, look + n, plane, out};
    ok = ok && image_init(out, n, n, 3, e);
    if (ok && !filter(&r, plane, e)) {
        image_finish(out);
        ok = false;
    }
    for (int p = 0; p < k->terms.n_post; p++)
        free(plane[p]);
    free(look);
    return ok;
}

bool env_exact(const struct env_kernel *k, const struct environment *env, const struct frame *f,
               int n, struct image *out, struct err *e)
{
    struct env_light l;
    const bool ok = env_light_init(&l, k, env, f, 0, 0, e) && env_exact_map(k, &l, n, out, e);
    env_light_finish(&l);
    return ok;
}
