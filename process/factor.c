// factor.c - a diffraction table as a few products of one-dimensional filters.
#define _GNU_SOURCE
#include "process/factor.h"
#include "core/mem.h"
#include "process/factor_lines.h"
#include "process/svd.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *const factor_kind_names[] = {"composition", "sum", "one-dimensional", NULL};

static const double apart_rad = M_PI / 3; // R17: of the two main directions

static bool alloc(struct factors *f, struct err *e)
{
    f->error = xcalloc((size_t)f->rank * 4, sizeof *f->error);
    for (int k = 0; k < 2; k++) {
        f->f[k] = sample_alloc((size_t)f->rank * (size_t)f->n * 3, sizeof **f->f, "factors", e);
        if (!f->f[k])
            return false;
    }
    return true;
}

// One channel: rows are v or b (left singular vectors), columns u or a.
static bool factor_channel(struct factors *f, const struct table *t, int c, double *all,
                           double *left, struct err *e)
{
    const int n = t->n, r = f->rank;
    const size_t nodes = (size_t)n * (size_t)n;
    float *s2 = sample_alloc(nodes, sizeof *s2, "factors", e);
    float *u = sample_alloc((size_t)n * (size_t)r, sizeof *u, "factors", e);
    float *vt = sample_alloc((size_t)n * (size_t)r, sizeof *vt, "factors", e);
    float *s = xcalloc((size_t)r, sizeof *s);
    bool ok = s2 && u && vt;
    *all = 0;
    for (size_t k = 0; k < nodes && ok; k++) {
        s2[k] = t->tab[3 * k + (size_t)c];
        *all += (double)s2[k] * (double)s2[k];
    }
    double rest = 0;
    ok = ok && svd_leading(n, n, s2, r, u, s, vt, &rest, e);
    rest *= rest;
    for (int k = r - 1; k >= 0 && ok; k--) {
        left[k] = rest;
        rest += (double)s[k] * (double)s[k];
        // The sign of a pair is free: positive on the whole, so that filters look like lobes.
        double sum = 0;
        for (int i = 0; i < n; i++)
            sum += (double)u[i * r + k];
        const float root = copysignf(sqrtf(s[k]), (float)sum);
        for (int i = 0; i < n; i++) {
            f->f[0][((size_t)k * (size_t)n + (size_t)i) * 3 + (size_t)c] =
                root * vt[(size_t)k * (size_t)n + (size_t)i];
            f->f[1][((size_t)k * (size_t)n + (size_t)i) * 3 + (size_t)c] = root * u[i * r + k];
        }
    }
    free(s2);
    free(u);
    free(vt);
    free(s);
    return ok;
}

static bool compose(struct factors *f, const struct table *t, struct err *e)
{
    double *left = xcalloc(3 * (size_t)f->rank, sizeof *left), all[4] = {0};
    bool ok = true;
#pragma omp parallel for schedule(dynamic)
    for (int c = 0; c < 3; c++) {
        struct err mine = {0};
        if (!factor_channel(f, t, c, &all[c], left + c * f->rank, &mine)) {
#pragma omp critical
            {
                ok = false;
                *e = mine;
            }
        }
    }
    all[3] = all[0] + all[1] + all[2];
    for (int k = 0; k < f->rank; k++) {
        double sum = 0;
        for (int c = 0; c < 4; c++) {
            const double x = c < 3 ? left[c * f->rank + k] : sum;
            sum += x;
            f->error[4 * k + c] = all[c] > 0 ? sqrt(x / all[c]) : 0;
        }
    }
    free(left);
    return ok;
}

// The error of the last rank as it is after the way back from the axes to the table.
static bool error_after_return(struct factors *f, struct aligned *al, const struct table *t,
                               struct err *e)
{
    const size_t n = (size_t)f->n;
    for (size_t j = 0; j < n; j++)
        for (size_t x = 0; x < 3 * n; x++) {
            float sum = 0;
            for (size_t k = 0; k < (size_t)f->rank; k++)
                sum += f->f[1][(k * n + j) * 3 + x % 3] * f->f[0][k * n * 3 + x];
            al->t.tab[j * n * 3 + x] = sum;
        }
    struct table back = {0};
    if (!aligned_back(al, t, &back, e))
        return false;
    double wrong[4] = {0}, all[4] = {0};
    for (size_t k = 0; k < 3 * (size_t)t->n * (size_t)t->n; k++) {
        const double s = (double)t->tab[k], d = s - (double)back.tab[k];
        wrong[k % 3] += d * d;
        all[k % 3] += s * s;
        wrong[3] += d * d;
        all[3] += s * s;
    }
    for (int c = 0; c < 4; c++)
        f->error[4 * (f->rank - 1) + c] = all[c] > 0 ? sqrt(wrong[c] / all[c]) : 0;
    table_finish(&back);
    return true;
}

static bool factor_composition(struct factors *f, const struct table *t, struct aligned *al,
                               bool align, struct err *e)
{
    const struct table *from = align ? &al->t : t;
    f->n = from->n;
    f->range = from->range;
    f->power = from->power;
    if (align)
        memcpy(f->axis, al->axis, sizeof f->axis);
    return alloc(f, e) && compose(f, from, e) && (!align || error_after_return(f, al, t, e));
}

bool factor(struct factors *f, const struct table *t, int rank, bool align, bool detect,
            struct err *e)
{
    if (t->basis != TABLE_PLAIN)
        return err_set(e, ERR_DATA, "%d tables over w: only a plain table has factors", t->count);
    if (rank < 1 || rank > t->n)
        return err_set(e, ERR_DATA, "bad rank %d: must be 1 to %d, the table's nodes a side", rank,
                       t->n);
    struct factors out = {.rank = rank, .axis = {{1, 0}, {0, 1}}};
    struct aligned al = {0};
    double angle[2];
    factor_directions(t, apart_rad, angle);
    bool ok = aligned_init(&al, t, angle, 0, e);
    if (ok && detect)
        out.kind = aligned_kind(&al);
    if (ok)
        ok = out.kind == FACTOR_COMPOSITION ? factor_composition(&out, t, &al, align, e)
                                            : factor_lines(&out, t, angle, e);
    aligned_finish(&al);
    if (!ok) {
        factors_finish(&out);
        return false;
    }
    meta_copy(&out.meta, &t->meta);
    *f = out;
    return true;
}

void factors_finish(struct factors *f)
{
    if (!f)
        return;
    free(f->f[0]);
    free(f->f[1]);
    free(f->error);
    meta_finish(&f->meta);
    *f = (struct factors){0};
}
