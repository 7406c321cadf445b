// diffraction.c - the grid of (u, v) from transforms, in parts that fit in memory.
//
// Columns are done in groups whose cells fit, and a group's transforms in strips of fx that fit:
// each strip is made once and serves every column and wavelength that reads it. A column takes its
// wavelengths in the order of fx, so its sums are the same bytes however the strips are cut.
#include "process/diffraction.h"
#include "core/log.h"
#include "core/mem.h"
#include "process/diffraction_rows.h"
#include <limits.h>
#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

struct read { // one wavelength of one column
    double f; // 0 .. 0.5 cycles per node along x
    int first, l;
    bool
        mirrored; // f was negative: the transforms are read at (-fx, -fy), where they are conjugate
};

struct job {
    const struct diffraction *d;
    const struct diffraction_use *use;
    struct diffraction_rows rows;
    struct moments m;
    struct read *read;   // [nu][wavelengths], each column's in the order of fx
    int *done;           // [nu] of them
    char *cells;         // of the group: [columns][plus, minus][nv]
    size_t side;         // bytes of [nv] cells, a multiple of 64
    struct progress bar; // counts reads
};

static size_t padded(size_t bytes)
{
    return (bytes + 63) / 64 * 64;
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
};

static void add_read(const struct job *job, int iu, const struct read *read, char *cells,
                     const struct scratch *s)
{
    const struct diffraction *d = job->d;
    const struct moments *m = &job->m;
    const size_t nv = (size_t)d->nv, kept = (size_t)m->y.kept, cell = 2 * (size_t)m->count;
    const size_t list = (size_t)read->l * 2 + read->mirrored;
    const size_t slot = (size_t)bins_slot(&m->x, read->first);
    float wx[TAPS];
    taps_weights(m->x.fine, read->f, wx);
    const bool *used = job->rows.used + list * kept;
    for (size_t r = 0, end; r < kept; r = end + 1) {
        for (end = r; end < kept && used[end];)
            end++;
        blend(m->value + (slot * kept + r) * cell, kept * cell, wx, s->column + r * cell,
              (end - r) * cell);
    }
    const struct row_tap *row = job->rows.tap + list * nv;
    const float *gain = job->rows.gain + (size_t)read->l * nv * 3;
    const double cycles = d->u[iu] * d->patch->dx_m / d->light->lambda_m[read->l];
    const float along_x = (float)array_factor(d->repeat[0], cycles * d->patch->nx);
    for (size_t j = 0; j < nv; j++) {
        blend(s->column + (size_t)row[j].slot * cell, cell, row[j].weight, s->moment + j * cell,
              cell);
        for (size_t c = 0; c < 3; c++)
            s->weight[j * 3 + c] = gain[j * 3 + c] * along_x;
    }
    // conj M: what was (u, v) is (-u, -v)
    job->use->add(job->use, read->l, d->nv, s->moment, s->weight,
                  cells + (read->mirrored ? job->side : 0),
                  cells + (read->mirrored ? 0 : job->side));
}

// All reads of columns [first, end) whose first bin is at most `last`.
static bool run_strip(struct job *job, int first, int end, int last, struct err *e)
{
    const struct diffraction *d = job->d;
    if (!moments_fill(&job->m, d->patch, job->use->count, e))
        return false;
    const size_t cell = 2 * sizeof(float) * (size_t)job->m.count;
    const size_t column = padded((size_t)job->m.y.kept * cell);
    const size_t moment = padded((size_t)d->nv * cell);
    const size_t each = column + moment + padded((size_t)d->nv * 3 * sizeof(float));
    char *all = sample_alloc((size_t)omp_get_max_threads(), each, "table columns", e);
    if (!all)
        return false;
#pragma omp parallel for schedule(dynamic)
    for (int iu = first; iu < end; iu++) {
        char *mine = all + each * (size_t)omp_get_thread_num();
        const struct scratch s = {.column = (float *)mine,
                                  .moment = (float *)(mine + column),
                                  .weight = (float *)(mine + column + moment)};
        const struct read *read = job->read + (size_t)iu * (size_t)d->light->n;
        const int before = job->done[iu];
        while (job->done[iu] < d->light->n && read[job->done[iu]].first <= last)
            add_read(job, iu, read + job->done[iu]++,
                     job->cells + (size_t)(iu - first) * 2 * job->side, &s);
        progress_step(&job->bar, job->done[iu] - before);
    }
    free(all);
    return true;
}

// Marks the bins of as many reads as fit, in the order of fx; returns the last first bin among
// them, INT_MIN when nothing is left to do, INT_MAX when not even one read fits.
static int next_strip(struct job *job, int first, int end)
{
    const struct diffraction *d = job->d;
    const int nl = d->light->n;
    int *at = xcalloc((size_t)(end - first), sizeof *at), last = INT_MIN;
    memcpy(at, job->done + first, (size_t)(end - first) * sizeof *at);
    for (;;) {
        int next = INT_MAX;
        for (int iu = first; iu < end; iu++) {
            const struct read *read = job->read + (size_t)iu * (size_t)nl;
            while (at[iu - first] < nl && read[at[iu - first]].first <= last)
                at[iu - first]++;
            if (at[iu - first] < nl && read[at[iu - first]].first < next)
                next = read[at[iu - first]].first;
        }
        const size_t bytes =
            moments_bytes(d->patch, job->use->count, job->m.x.kept + TAPS, job->m.y.kept);
        if (next == INT_MAX || bytes > d->memory) {
            free(at);
            return next < INT_MAX && last == INT_MIN ? INT_MAX : last;
        }
        bins_need(&job->m.x, next);
        last = next;
    }
}

static bool run_group(struct job *job, int first, int end, struct err *e)
{
    const struct diffraction *d = job->d;
    for (;;) {
        bins_init(&job->m.x, d->patch->nx);
        const int last = next_strip(job, first, end);
        bool ok = last != INT_MAX;
        if (!ok)
            err_set(e, ERR_DATA,
                    "a strip of the transforms needs %.3g GB, the memory given is %.3g GB",
                    1e-9 * (double)moments_bytes(d->patch, job->use->count, TAPS, job->m.y.kept),
                    1e-9 * (double)d->memory);
        bins_close(&job->m.x);
        ok = ok && (last == INT_MIN || run_strip(job, first, end, last, e));
        bins_finish(&job->m.x);
        if (!ok || last == INT_MIN)
            return ok;
    }
}

static int by_fx(const void *a, const void *b)
{
    const struct read *x = a, *y = b;
    return x->first != y->first ? x->first - y->first : x->l - y->l;
}

static bool list_reads(struct job *job, struct err *e)
{
    const struct diffraction *d = job->d;
    const size_t nl = (size_t)d->light->n;
    bins_init(&job->m.x, d->patch->nx);
    const int fine = job->m.x.fine;
    bins_finish(&job->m.x);
    job->done = xcalloc((size_t)d->nu, sizeof *job->done);
    job->read = sample_alloc((size_t)d->nu * nl, sizeof *job->read, "table columns", e);
    for (int iu = 0; job->read && iu < d->nu; iu++) {
        struct read *read = job->read + (size_t)iu * nl;
        for (size_t l = 0; l < nl; l++) {
            const double f = taps_fold(d->u[iu] * d->patch->dx_m / d->light->lambda_m[l]);
            read[l] = (struct read){.f = fabs(f), .l = (int)l, .mirrored = f < 0};
            read[l].first = taps_first(fine, fabs(f));
        }
        qsort(read, nl, sizeof *read, by_fx);
    }
    return job->read;
}

static void sink_group(const struct job *job, int first, int end, diffraction_sink *sink, void *ctx)
{
#pragma omp parallel for schedule(dynamic)
    for (int bundle = first / DIFFRACTION_BUNDLE; bundle <= (end - 1) / DIFFRACTION_BUNDLE;
         bundle++)
        for (int k = 0; k < DIFFRACTION_BUNDLE; k++) {
            const int iu = bundle * DIFFRACTION_BUNDLE + k;
            const char *cells = job->cells + (size_t)(iu - first) * 2 * job->side;
            if (iu >= first && iu < end)
                sink(ctx, iu, cells, cells + job->side);
        }
}

bool diffraction_run(const struct diffraction *d, const struct diffraction_use *use,
                     diffraction_sink *sink, void *ctx, struct err *e)
{
    struct job job = {.d = d, .use = use, .side = padded((size_t)d->nv * use->cell)};
    struct diffraction within = *d;
    const size_t fit = d->memory / 4 / (2 * job.side);
    const int group = fit < 1 ? 1 : fit < (size_t)d->nu ? (int)fit : d->nu;
    within.memory = d->memory - d->memory / 4;
    job.d = &within;
    bins_init(&job.m.y, d->patch->ny);
    bool ok = list_reads(&job, e) && diffraction_rows_init(&job.rows, d, &job.m.y, e);
    job.cells = ok ? sample_alloc((size_t)group * 2, job.side, "table columns", e) : NULL;
    ok = job.cells;
    progress_start(&job.bar, "diffracting", (long)d->nu * d->light->n);
    for (int first = 0; ok && first < d->nu; first += group) {
        const int end = first + group < d->nu ? first + group : d->nu;
        memset(job.cells, 0, (size_t)group * 2 * job.side);
        ok = run_group(&job, first, end, e);
        if (ok)
            sink_group(&job, first, end, sink, ctx);
    }
    progress_end(&job.bar);
    free(job.read);
    free(job.done);
    free(job.cells);
    diffraction_rows_finish(&job.rows);
    moments_finish(&job.m);
    return ok;
}
