// tables.c - tables with curves in w that are linear in the samples: POD and Chebyshev.
//
// First run: the Gram matrix over w of all nodes, and the samples too when memory holds them. It
// gives curves and errors, so the number of tables is known before one is made. Then the samples
// are projected, or the second run makes them again.
#include "process/tables.h"
#include "core/mem.h"
#include "process/tables_between.h"
#include "process/tables_pass.h"
#include "process/tables_taylor.h"
#include "process/wbasis.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CURVE_SAMPLES = 4097 }; // of a POD curve: linear between them, far below float rounding

struct work {
    struct table *t;
    int n, nw, stride;
    double *gram;          // [bundles][nw][nw], upper half
    float *sample;         // [n columns][n rows][3][nw], NULL when memory does not hold it
    const double *project; // [count][nw]
};

static const float *cell_of(const struct work *k, const void *cells, int j, bool reversed)
{
    const int row = reversed ? k->n - 1 - j : j;
    return (const float *)cells + (size_t)row * 3 * (size_t)k->stride;
}

static void project_cell(const struct work *k, int i, int j, const float *xyz, size_t stride)
{
    const size_t n2 = (size_t)k->n * (size_t)k->n;
    for (int m = 0; m < k->t->count; m++) {
        float *to = k->t->tab + ((size_t)m * n2 + (size_t)j * (size_t)k->n + (size_t)i) * 3;
        for (size_t c = 0; c < 3; c++) {
            double sum = 0;
            for (int w = 0; w < k->nw; w++)
                sum += k->project[m * k->nw + w] * xyz[c * stride + (size_t)w];
            to[c] = (float)sum;
        }
    }
}

static void take_gram(void *ctx, int bundle, int i, const void *cells, bool reversed)
{
    const struct work *k = ctx;
    const int nw = k->nw;
    double *gram = k->gram + (size_t)bundle * (size_t)nw * (size_t)nw;
    for (int j = 0; j < k->n; j++) {
        const float *xyz = cell_of(k, cells, j, reversed);
        for (int c = 0; c < 3; c++) {
            const float *x = xyz + c * k->stride;
            for (int a = 0; a < nw; a++)
                for (int b = a; b < nw; b++)
                    gram[a * nw + b] += (double)x[a] * x[b];
            if (k->sample)
                memcpy(k->sample +
                           (((size_t)i * (size_t)k->n + (size_t)j) * 3 + (size_t)c) * (size_t)nw,
                       x, (size_t)nw * sizeof *x);
        }
    }
}

static void take_project(void *ctx, int bundle, int i, const void *cells, bool reversed)
{
    (void)bundle;
    const struct work *k = ctx;
    for (int j = 0; j < k->n; j++)
        project_cell(k, i, j, cell_of(k, cells, j, reversed), (size_t)k->stride);
}

static void project_samples(const struct work *k)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < k->n; j++)
        for (int i = 0; i < k->n; i++)
            project_cell(k, i, j,
                         k->sample + ((size_t)i * (size_t)k->n + (size_t)j) * 3 * (size_t)k->nw,
                         (size_t)k->nw);
}

static void sum_bundles(double *gram, int bundles, int nw)
{
    const size_t n2 = (size_t)nw * (size_t)nw;
    for (int b = 1; b < bundles; b++)
        for (size_t k = 0; k < n2; k++)
            gram[k] += gram[(size_t)b * n2 + k];
    for (int a = 0; a < nw; a++)
        for (int b = 0; b < a; b++)
            gram[a * nw + b] = gram[b * nw + a];
}

static bool set_curves(struct table *t, const struct wbasis *b, const struct wnodes *q,
                       struct err *e)
{
    t->nw = CURVE_SAMPLES;
    t->curve = sample_alloc((size_t)t->count * CURVE_SAMPLES, sizeof *t->curve, "curves", e);
    if (!t->curve)
        return false;
    double *row = xcalloc((size_t)q->n, sizeof *row);
    for (int s = 0; s < CURVE_SAMPLES; s++) {
        wnodes_at(q, q->lo + (q->hi - q->lo) * s / (CURVE_SAMPLES - 1), row);
        for (int m = 0; m < t->count; m++)
            for (int k = 0; k < q->n; k++)
                t->curve[m * CURVE_SAMPLES + s] += row[k] * b->curve[m * q->n + k];
    }
    free(row);
    return true;
}

static int choose(const struct tables_spec *s, const struct wbasis *b, struct err *e)
{
    if (s->count)
        return s->count;
    const int count = wbasis_count(b, s->tolerance);
    if (!count)
        err_set(e, ERR_DATA,
                "%d tables leave an error of %.2g, above the tolerance %g: choose a smaller range "
                "of w or a larger tolerance",
                b->max, b->error[b->max], s->tolerance);
    return count;
}

static bool make_linear(struct table *t, const struct tables_pass *p, struct err *e)
{
    const struct tables_spec *s = p->spec;
    struct wnodes q = {0};
    struct wbasis basis = {0};
    struct work k = {.t = t, .n = s->n};
    bool ok = tables_wnodes(p, s->count, &q, e);
    struct diffraction_use *use = ok ? at_w_new(&p->patch, &p->light, q.w, q.n, e) : NULL;
    k.nw = q.n;
    k.stride = at_w_stride(q.n);
    const size_t nw2 = (size_t)q.n * (size_t)q.n, nodes = (size_t)s->n * (size_t)s->n * 3;
    const size_t keep = nodes * (size_t)q.n * sizeof(float);
    const bool once = keep <= s->memory / 2;
    const size_t memory = once ? s->memory - keep : s->memory;
    if (ok && once)
        k.sample = sample_alloc(nodes, (size_t)q.n * sizeof(float), "samples over w", e);
    if (use && (k.sample || !once))
        k.gram = sample_alloc((size_t)tables_pass_bundles(p), nw2 * sizeof *k.gram, "Gram", e);
    ok = k.gram && tables_pass_run(p, use, memory, take_gram, &k, e);
    if (ok) {
        sum_bundles(k.gram, tables_pass_bundles(p), q.n);
        const int max = q.n < TABLES_MAX ? q.n : TABLES_MAX;
        ok = (s->basis == TABLE_POD ? wbasis_pod : wbasis_chebyshev)(&basis, &q, k.gram, max, e);
    }
    const int count = ok ? choose(s, &basis, e) : 0;
    ok = count && table_init(t, s->n, s->range, s->power, count, e);
    if (ok) {
        t->basis = s->basis;
        t->w_min = s->w_min;
        t->w_max = s->w_max;
        k.project = basis.project;
        if (k.sample)
            project_samples(&k);
        else
            ok = tables_pass_run(p, use, memory, take_project, &k, e);
        ok = ok && (s->basis != TABLE_POD || set_curves(t, &basis, &q, e));
        meta_set_nums(&t->meta, "nacre.error_l2", basis.error + 1, count);
        meta_set_nums(&t->meta, "nacre.error_l2_worst_w", basis.worst_w + 1, count);
        meta_set_num(&t->meta, "nacre.w_samples", q.n);
    }
    at_w_free(use);
    free(k.gram);
    free(k.sample);
    wbasis_finish(&basis);
    wnodes_finish(&q);
    return ok;
}

static void set_meta(struct table *t, const struct tables_pass *p)
{
    const struct tables_spec *s = p->spec;
    meta_set_text(&t->meta, "nacre.observer", "CIE 1931 2 deg");
    meta_set_text(&t->meta, "nacre.model", "heights");
    meta_set_text(&t->meta, "nacre.scale", s->absolute ? "absolute" : "mirror");
    meta_set_text(&t->meta, "nacre.window", s->window == WINDOW_FLAT ? "flat" : "gauss");
    meta_set_num(&t->meta, "nacre.coherence_m", s->coherence_m);
    meta_set_num(&t->meta, "nacre.lambda_step_m", s->step_m);
    meta_set_num(&t->meta, "nacre.h_range_m", 2 * p->patch.half_m);
    meta_set_nums(&t->meta, "nacre.pixel_m", (double[]){p->patch.dx_m, p->patch.dy_m}, 2);
    meta_set_nums(&t->meta, "nacre.nyquist_u",
                  (double[]){0.5 * p->light.lambda_m[0] / p->patch.dx_m,
                             0.5 * p->light.lambda_m[0] / p->patch.dy_m},
                  2);
    meta_set_nums(&t->meta, "nacre.repeat", (double[]){s->repeat[0], s->repeat[1]}, 2);
}

// Nodes enough for bilinear look-up, as far as the memory for the tables allows.
static bool choose_size(struct tables_spec *s, const struct tables_pass *p, struct err *e)
{
    const int guess = s->count ? s->count : 6;
    const double bytes = 3.0 * sizeof(float) * guess, error = 0.8 * s->tolerance;
    const int most = (int)fmin(IMAGE_MAX_SIDE, sqrt((double)s->memory / bytes));
    if (!tables_size(p, error, most, &s->n, &s->power, e))
        return false;
    return s->n <= most ||
           err_set(e, ERR_DATA,
                   "an error of %g between nodes too takes about %d nodes at power %d, some %.2g "
                   "GB: give that memory, or choose a smaller range or a larger tolerance",
                   s->tolerance, s->n, s->power, bytes * s->n * s->n * 1e-9);
}

static bool make_any(struct table *t, const struct tables_pass *p, struct err *e)
{
    struct between b;
    if (!(p->spec->basis == TABLE_TAYLOR ? taylor_make : make_linear)(t, p, e) ||
        !tables_between(p, t->n, t->power, &b, e))
        return false;
    set_meta(t, p);
    meta_set_num(&t->meta, "nacre.error_between", b.all);
    meta_set_num(&t->meta, "nacre.error_between_away", b.away);
    meta_set_num(&t->meta, "nacre.light_away", b.light_away);
    return true;
}

bool tables_make(struct table *t, const struct tables_spec *spec, const struct hfield *hf,
                 struct err *e)
{
    struct tables_spec s = *spec;
    struct tables_pass p = {0};
    struct table got = {0};
    if (!tables_pass_init(&p, &s, hf, e))
        return false;
    bool ok = s.n > 0 || choose_size(&s, &p, e);
    if (ok && !spec->n && !s.count)
        s.tolerance *= 0.5; // with 0.8 between nodes: 0.94 in all
    ok = ok && tables_pass_nodes(&p, e) && make_any(&got, &p, e);
    if (ok)
        *t = got;
    else
        table_finish(&got);
    tables_pass_finish(&p);
    return ok;
}
