// diffraction.c - the grid of (u, v): which transforms it needs, in parts that fit in memory.
#include "process/diffraction.h"
#include "core/mem.h"
#include "process/moments.h"
#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

struct tap { // how one frequency is read
    int first;
    float weight[TAPS];
};

struct job {
    const struct diffraction *d;
    const struct diffraction_use *use;
    struct moments m;
    struct tap *row; // [wavelengths][nv] for the sign of u as given
    float *gain;     // [wavelengths][nv][3] colour weight times the array factor along y
    bool *row_used;  // [wavelengths][y.kept]
};

// |sum of n copies a period apart|^2 / n^2, n-fold phase difference per copy 2 pi f (f in cycles
// per period): sin(pi n f) / (n sin(pi f)), whose limit at whole f is +-1. Folding f to the nearest
// whole number first keeps all digits beside the zeros of the denominator.
static double array_factor(int n, double f)
{
    const double pi = 3.14159265358979323846, x = f - rint(f);
    if (fabs(x) * n < 1e-8)
        return 1;
    const double a = sin(pi * n * x) / (n * sin(pi * x));
    return a * a;
}

// Frequency in cycles per node. A negative fx is read at -f, where the moment is the conjugate.
static double fold(double u, double step_m, double lambda_m)
{
    return taps_fold(u * step_m / lambda_m);
}

double diffraction_scale(const struct diffraction *d, double lambda_m)
{
    const double area = patch_area(d->patch) * d->repeat[0] * d->repeat[1];
    return d->absolute ? area / (lambda_m * lambda_m) : 1;
}

static bool make_rows(struct job *job, struct err *e)
{
    const struct diffraction *d = job->d;
    const struct patch *p = d->patch;
    const size_t nv = (size_t)d->nv, nl = (size_t)d->light->n;
    bins_init(&job->m.y, p->ny);
    job->row = sample_alloc(nl * 2 * nv, sizeof *job->row, "table rows", e);
    job->gain = job->row ? sample_alloc(nl * nv, 3 * sizeof *job->gain, "table rows", e) : NULL;
    if (!job->gain)
        return false;
    for (size_t l = 0; l < nl; l++) {
        const double lambda_m = d->light->lambda_m[l];
        const double scale = diffraction_scale(d, lambda_m);
        for (size_t j = 0; j < nv; j++) {
            const double f = fold(d->v[j], p->dy_m, lambda_m);
            const double factor =
                array_factor(d->repeat[1], d->v[j] * p->dy_m * p->ny / lambda_m) * scale;
            for (int side = 0; side < 2; side++) { // as it is, and at -f
                struct tap *t = job->row + (l * 2 + (size_t)side) * nv + j;
                t->first = taps_at(job->m.y.fine, side ? -f : f, t->weight);
                bins_need(&job->m.y, side ? -f : f);
            }
            for (int c = 0; c < 3; c++)
                job->gain[(l * nv + j) * 3 + (size_t)c] = (float)(d->light->weight[l][c] * factor);
        }
    }
    bins_close(&job->m.y);
    const size_t kept = (size_t)job->m.y.kept;
    job->row_used = sample_alloc(nl * 2, kept, "table rows", e);
    if (!job->row_used)
        return false;
    for (size_t k = 0; k < nl * 2 * nv; k++) {
        job->row[k].first = bins_slot(&job->m.y, job->row[k].first);
        memset(job->row_used + k / nv * kept + job->row[k].first, 1, TAPS);
    }
    return true;
}

// Eight columns of transforms to one at fx: the long loop of everything, plain and vertical.
__attribute__((target_clones("avx512f", "avx2", "default"))) static void
blend(const float *restrict from, size_t stride, const float weight[TAPS], float *restrict to,
      size_t n)
{
    const float a0 = weight[0], a1 = weight[1], a2 = weight[2], a3 = weight[3], a4 = weight[4],
                a5 = weight[5], a6 = weight[6], a7 = weight[7];
    for (size_t k = 0; k < n; k++) {
        const float *f = from + k;
        to[k] =
            ((a0 * f[0] + a1 * f[stride]) + (a2 * f[2 * stride] + a3 * f[3 * stride])) +
            ((a4 * f[4 * stride] + a5 * f[5 * stride]) + (a6 * f[6 * stride] + a7 * f[7 * stride]));
    }
}

struct scratch {   // of one thread
    float *column; // [y.kept][2][count] transforms at fx
    float *moment; // [nv][2][count] at (fx, fy)
    float *weight; // [nv][3]
    char *plus, *minus;
};

static void run_column(const struct job *job, int iu, const struct scratch *s)
{
    const struct diffraction *d = job->d;
    const struct moments *m = &job->m;
    const size_t nv = (size_t)d->nv, kept = (size_t)m->y.kept, cell = 2 * (size_t)m->count;
    memset(s->plus, 0, nv * job->use->cell);
    memset(s->minus, 0, nv * job->use->cell);
    for (int l = 0; l < d->light->n; l++) {
        const double lambda_m = d->light->lambda_m[l];
        const double f = fold(d->u[iu], d->patch->dx_m, lambda_m);
        const bool mirrored = f < 0;
        float wx[TAPS];
        const int col = bins_slot(&m->x, taps_at(m->x.fine, fabs(f), wx));
        const size_t side = (size_t)l * 2 + mirrored;
        const bool *used = job->row_used + side * kept;
        for (size_t r = 0; r < kept;) {
            size_t end = r;
            while (end < kept && used[end])
                end++;
            if (end > r)
                blend(m->value + ((size_t)col * kept + r) * cell, kept * cell, wx,
                      s->column + r * cell, (end - r) * cell);
            r = end + 1;
        }
        const struct tap *row = job->row + side * nv;
        const float *gain = job->gain + (size_t)l * nv * 3;
        const float along_x =
            (float)array_factor(d->repeat[0], d->u[iu] * d->patch->dx_m * d->patch->nx / lambda_m);
        for (size_t j = 0; j < nv; j++) {
            blend(s->column + (size_t)row[j].first * cell, cell, row[j].weight,
                  s->moment + j * cell, cell);
            for (size_t c = 0; c < 3; c++)
                s->weight[j * 3 + c] = gain[j * 3 + c] * along_x;
        }
        // conj M at -f: what was (u, v) is (-u, -v)
        job->use->add(job->use, l, d->nv, s->moment, s->weight, mirrored ? s->minus : s->plus,
                      mirrored ? s->plus : s->minus);
    }
}

static size_t padded(size_t bytes)
{
    return (bytes + 63) / 64 * 64;
}

// Columns [first, end) of the grid, whose transforms fit in memory together.
static bool run_part(struct job *job, int first, int end, diffraction_sink *sink, void *ctx,
                     struct err *e)
{
    const struct diffraction *d = job->d;
    if (!moments_fill(&job->m, d->patch, job->use->count, e))
        return false;
    const size_t cell = 2 * sizeof(float) * (size_t)job->m.count, nv = (size_t)d->nv;
    const size_t column = padded((size_t)job->m.y.kept * cell), moment = padded(nv * cell);
    const size_t weight = padded(nv * 3 * sizeof(float)), cells = padded(nv * job->use->cell);
    const size_t each = column + moment + weight + 2 * cells;
    char *all = sample_alloc((size_t)omp_get_max_threads(), each, "table columns", e);
    if (!all)
        return false;
#pragma omp parallel
    {
        char *mine = all + each * (size_t)omp_get_thread_num();
        const struct scratch s = {
            .column = (float *)mine,
            .moment = (float *)(mine + column),
            .weight = (float *)(mine + column + moment),
            .plus = mine + column + moment + weight,
            .minus = mine + column + moment + weight + cells,
        };
#pragma omp for schedule(dynamic)
        for (int bundle = first / DIFFRACTION_BUNDLE; bundle <= (end - 1) / DIFFRACTION_BUNDLE;
             bundle++)
            for (int k = 0; k < DIFFRACTION_BUNDLE; k++) {
                const int iu = bundle * DIFFRACTION_BUNDLE + k;
                if (iu >= first && iu < end) {
                    run_column(job, iu, &s);
                    sink(ctx, iu, s.plus, s.minus);
                }
            }
    }
    free(all);
    return true;
}

// Marks what column iu reads along x; returns how many bins are new.
static int need_column(struct bins *x, const struct diffraction *d, int iu)
{
    int more = 0;
    for (int l = 0; l < d->light->n; l++)
        more += bins_need(x, fabs(fold(d->u[iu], d->patch->dx_m, d->light->lambda_m[l])));
    return more;
}

bool diffraction_run(const struct diffraction *d, const struct diffraction_use *use,
                     diffraction_sink *sink, void *ctx, struct err *e)
{
    struct job job = {.d = d, .use = use};
    bool ok = make_rows(&job, e);
    for (int first = 0, end; ok && first < d->nu; first = end) {
        struct bins fit;
        bins_init(&job.m.x, d->patch->nx);
        for (end = first; end < d->nu; end++) { // as many columns as fit
            bins_copy(&fit, &job.m.x);
            need_column(&fit, d, end);
            const size_t bytes = moments_bytes(d->patch, use->count, fit.kept, job.m.y.kept);
            if (bytes > d->memory && end > first) {
                bins_finish(&fit);
                break;
            }
            bins_finish(&job.m.x);
            job.m.x = fit;
            if (bytes > d->memory)
                ok = err_set(e, ERR_DATA,
                             "one column of the table needs %.3g GB for its transforms, the memory "
                             "given is %.3g GB",
                             (double)bytes * 1e-9, (double)d->memory * 1e-9);
            if (!ok)
                break;
        }
        bins_close(&job.m.x);
        ok = ok && run_part(&job, first, end, sink, ctx, e);
        bins_finish(&job.m.x);
    }
    free(job.row);
    free(job.gain);
    free(job.row_used);
    moments_finish(&job.m);
    return ok;
}
