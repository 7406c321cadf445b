// tables_taylor.c - tables in powers of w, and what is wrong with them.
#define _GNU_SOURCE
#include "process/tables_taylor.h"
#include "core/mem.h"
#include <complex.h>
#include <math.h>
#include <stdlib.h>

static const double tau = 6.28318530717958647693;

double taylor_remainder(double y, int order)
{
    double r = 1; // times 2^power: terms on the way may be larger than any double
    int power = 0;
    for (int k = 1; k <= order + 1; k++) {
        int p;
        r = frexp(r * (y / k), &p);
        power += p;
    }
    return ldexp(r, power);
}

int taylor_order(double y, double remainder)
{
    const double wanted = log(remainder);
    double at = log(y); // of the remainder
    int order = 0;
    while (at > wanted)
        at += log(y / (++order + 1));
    return order;
}

struct taylor { // a use of diffraction.h; the cell is double xyz[3][terms]
    struct diffraction_use base;
    int order, terms, evens;
    double *matrix; // [wavelengths][order + 1][order + 1]: s_n = sum of it over k times M_k
};

// x^n = sum over k of c[n][k] T_k(x), all of it positive: from x T_k = (T_k+1 + T_k-1) / 2.
static double *powers(int order)
{
    const int n1 = order + 1;
    double *c = xcalloc((size_t)(n1 * n1), sizeof *c);
    c[0] = 1;
    for (int n = 1; n <= order; n++)
        for (int k = 0; k < n; k++) {
            const double share = c[(n - 1) * n1 + k];
            c[n * n1 + k + 1] += k ? 0.5 * share : share;
            if (k)
                c[n * n1 + k - 1] += 0.5 * share;
        }
    return c;
}

// S = sum of w^n s_n (n even) + i w^n s_n (n odd), so |S|^2 at (u, v) and (-u, -v) differ only in
// the sign of the odd powers.
static void add(const struct diffraction_use *use, int l, int nv, const float *moment,
                const float *weight, void *plus, void *minus)
{
    const struct taylor *t = (const struct taylor *)use;
    const int n1 = t->order + 1, terms = t->terms;
    const double *matrix = t->matrix + (size_t)l * (size_t)(n1 * n1);
    double complex s[TABLES_MAX / 2 + 2];
    for (int j = 0; j < nv; j++) {
        const float *re = moment + (size_t)j * 2 * (size_t)n1, *im = re + n1;
        for (int n = 0; n < n1; n++) {
            s[n] = 0;
            for (int k = n % 2; k <= n; k += 2) {
                const int slot = k % 2 ? t->evens + k / 2 : k / 2;
                s[n] += matrix[n * n1 + k] * (re[slot] + (double)im[slot] * I);
            }
        }
        double *to = (double *)plus + (size_t)j * 3 * (size_t)terms,
               *back = (double *)minus + (size_t)j * 3 * (size_t)terms;
        for (int power = 0; power < terms; power++) {
            double sum = 0;
            for (int n = power < n1 ? 0 : power - n1 + 1; n <= power && n < n1; n++) {
                const double complex product = s[n] * conj(s[power - n]);
                if (power % 2 == 0)
                    sum += creal(product);
                else // even times i odd, or the other way round
                    sum += n % 2 ? -cimag(product) : cimag(product);
            }
            for (int c = 0; c < 3; c++) {
                to[c * terms + power] += weight[3 * j + c] * sum;
                back[c * terms + power] += weight[3 * j + c] * (power % 2 ? -sum : sum);
            }
        }
    }
}

static struct taylor *taylor_new(const struct tables_pass *p, int terms)
{
    struct taylor *t = xcalloc(1, sizeof *t);
    t->order = terms / 2;
    t->terms = terms;
    const int n1 = t->order + 1;
    t->evens = (n1 + 1) / 2;
    t->base = (struct diffraction_use){
        .count = n1, .cell = 3 * (size_t)terms * sizeof(double), .add = add};
    t->matrix = xcalloc((size_t)p->light.n * (size_t)(n1 * n1), sizeof *t->matrix);
    double *c = powers(t->order);
    for (int l = 0; l < p->light.n; l++) {
        const double z = tau * p->patch.half_m / p->light.lambda_m[l];
        double factor = 1;
        for (int n = 0; n < n1; n++) {
            for (int k = 0; k < n1; k++)
                t->matrix[(l * n1 + n) * n1 + k] = (n / 2 % 2 ? -factor : factor) * c[n * n1 + k];
            factor *= z / (n + 1);
        }
    }
    free(c);
    return t;
}

static void taylor_free(struct taylor *t)
{
    free(t->matrix);
    free(t);
}

struct sums { // over nodes, per sample in w
    double energy, rounding, bound, error[TABLES_MAX + 1];
};

struct check {
    struct table *t;
    const struct wnodes *q;
    const struct tables_pass *p;
    double weight[3]; // of all wavelengths together
    int stride;
    struct sums *sum; // [bundles][nw]
};

static float *table_cell(struct table *t, int m, int i, int j)
{
    const size_t n = (size_t)t->n;
    return t->tab + (((size_t)m * n + (size_t)j) * n + (size_t)i) * 3;
}

// Stores the tables, and what storing them in float32 does to their sum.
static void take_terms(void *ctx, int bundle, int i, const void *cells, bool reversed)
{
    const struct check *k = ctx;
    const int n = k->t->n, terms = k->t->count;
    for (int j = 0; j < n; j++) {
        const double *xyz =
            (const double *)cells + (size_t)(reversed ? n - 1 - j : j) * 3 * (size_t)terms;
        for (int c = 0; c < 3; c++) {
            for (int m = 0; m < terms; m++)
                table_cell(k->t, m, i, j)[c] = (float)xyz[c * terms + m];
            for (int w = 0; w < k->q->n; w++) {
                double lost = 0, power = 1;
                for (int m = 0; m < terms; m++, power *= k->q->w[w])
                    lost += power * (table_cell(k->t, m, i, j)[c] - xyz[c * terms + m]);
                k->sum[bundle * k->q->n + w].rounding += lost * lost;
            }
        }
    }
}

// Compares the tables with |S|^2 itself. |S_N|^2 differs from it by no more than r (2 |S| + r);
// over the spectrum, by Cauchy and Schwarz, 2 r sqrt(weight XYZ) + weight r^2.
static void take_error(void *ctx, int bundle, int i, const void *cells, bool reversed)
{
    const struct check *k = ctx;
    const int n = k->t->n, terms = k->t->count;
    const double y = tau * k->p->patch.half_m / k->p->light.lambda_m[0];
    for (int w = 0; w < k->q->n; w++) {
        struct sums *s = k->sum + bundle * k->q->n + w;
        const double at_w = k->q->w[w], r = taylor_remainder(y * at_w, (terms - 1) / 2);
        for (int j = 0; j < n; j++) {
            const float *xyz =
                (const float *)cells + (size_t)(reversed ? n - 1 - j : j) * 3 * (size_t)k->stride;
            for (int c = 0; c < 3; c++) {
                const double want = xyz[c * k->stride + w], weight = k->weight[c];
                const double allowed = 2 * r * sqrt(weight * fmax(0, want)) + weight * r * r;
                double got = 0, power = 1;
                s->energy += want * want;
                s->bound += allowed * allowed;
                s->error[0] += want * want;
                for (int m = 0; m < terms; m++, power *= at_w) {
                    got += power * table_cell(k->t, m, i, j)[c];
                    s->error[m + 1] += (got - want) * (got - want);
                }
            }
        }
    }
}

static void report(const struct check *k, int bundles)
{
    struct sums all = {0};
    double worst[TABLES_MAX + 1] = {0};
    for (int w = 0; w < k->q->n; w++) {
        struct sums at = {0};
        for (int b = 0; b < bundles; b++) {
            const struct sums *s = k->sum + b * k->q->n + w;
            at.energy += s->energy;
            at.rounding += s->rounding;
            at.bound += s->bound;
            for (int m = 0; m <= k->t->count; m++)
                at.error[m] += s->error[m];
        }
        const double share = k->q->weight[w];
        all.energy += share * at.energy;
        all.rounding += share * at.rounding;
        all.bound += share * at.bound;
        for (int m = 0; m <= k->t->count; m++) {
            all.error[m] += share * at.error[m];
            if (at.energy > 0)
                worst[m] = fmax(worst[m], sqrt(at.error[m] / at.energy));
        }
    }
    const double scale = all.energy > 0 ? 1 / all.energy : 0;
    for (int m = 0; m <= k->t->count; m++)
        all.error[m] = sqrt(all.error[m] * scale);
    struct meta *meta = &k->t->meta;
    meta_set_nums(meta, "nacre.error_l2", all.error + 1, k->t->count);
    meta_set_nums(meta, "nacre.error_l2_worst_w", worst + 1, k->t->count);
    meta_set_num(meta, "nacre.taylor_bound", sqrt(all.bound * scale));
    meta_set_num(meta, "nacre.taylor_rounding", sqrt(all.rounding * scale));
}

static bool make_terms(struct check *k, int terms, struct err *e)
{
    struct taylor *taylor = taylor_new(k->p, terms);
    const bool ok = tables_pass_run(k->p, &taylor->base, k->p->spec->memory, take_terms, k, e);
    taylor_free(taylor);
    return ok;
}

static bool measure(struct check *k, struct err *e)
{
    struct diffraction_use *use = at_w_new(&k->p->patch, &k->p->light, k->q->w, k->q->n, e);
    const bool ok = use && tables_pass_run(k->p, use, k->p->spec->memory, take_error, k, e);
    at_w_free(use);
    return ok;
}

bool taylor_make(struct table *t, const struct tables_pass *p, struct err *e)
{
    const struct tables_spec *s = p->spec;
    const double y = tau * p->patch.half_m * s->w_max / p->light.lambda_m[0];
    const double wanted = s->tolerance > 0 ? s->tolerance : 1e-3;
    const int needed = taylor_order(y, wanted), terms = s->count ? s->count : 2 * needed + 1;
    if (terms > TABLES_MAX)
        return err_set(e, ERR_DATA,
                       "a Taylor series needs order %d, %d tables, for phases of %.3g rad; at most "
                       "%d are made: choose the basis pod or chebyshev",
                       needed, terms, y, TABLES_MAX);
    struct wnodes q;
    if (!tables_wnodes(p, 2, &q, e) || !table_init(t, s->n, s->range, s->power, terms, e))
        return false;
    t->basis = TABLE_TAYLOR;
    t->w_min = s->w_min;
    t->w_max = s->w_max;
    const int bundles = tables_pass_bundles(p);
    struct check k = {.t = t, .q = &q, .p = p, .stride = at_w_stride(q.n)};
    k.sum = sample_alloc((size_t)(bundles * q.n), sizeof *k.sum, "error sums", e);
    for (int l = 0; l < p->light.n; l++)
        for (int c = 0; c < 3; c++)
            k.weight[c] += p->light.weight[l][c] * tables_pass_scale(p, l);
    const bool ok = k.sum && make_terms(&k, terms, e) && measure(&k, e);
    if (ok) {
        meta_set_num(&t->meta, "nacre.taylor_order", terms / 2);
        meta_set_num(&t->meta, "nacre.taylor_y", y);
        meta_set_num(&t->meta, "nacre.taylor_remainder", taylor_remainder(y, (terms - 1) / 2));
        meta_set_num(&t->meta, "nacre.taylor_order_needed", needed);
        report(&k, bundles);
    }
    free(k.sum);
    wnodes_finish(&q);
    return ok;
}
