// tables_pass.c - one run over all nodes of a table.
#define _GNU_SOURCE
#include "process/tables_pass.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

static bool spec_check(const struct tables_spec *s, struct err *e)
{
    if (!table_nodes_check(s->n ? s->n : 2, s->range, s->power, e))
        return false;
    if (!(s->w_min >= 0 && s->w_min < s->w_max && s->w_max <= 2))
        return err_set(e, ERR_DATA, "bad range of w %g,%g: must rise and lie in 0 to 2", s->w_min,
                       s->w_max);
    if (s->count < 0 || s->count > TABLES_MAX)
        return err_set(e, ERR_DATA, "bad count %d: must be 1 to %d tables", s->count, TABLES_MAX);
    if (!s->n && !(s->tolerance > 0))
        return err_set(e, ERR_DATA, "a size chosen by the error needs a tolerance");
    if (!s->count && !(s->tolerance >= 1e-6 && s->tolerance < 1))
        return err_set(e, ERR_DATA, "bad tolerance %g: must be 1e-6 to 1", s->tolerance);
    if (s->repeat[0] < 1 || s->repeat[1] < 1)
        return err_set(e, ERR_DATA, "bad repeat %d,%d: must be 1 or more", s->repeat[0],
                       s->repeat[1]);
    return true;
}

bool tables_pass_init(struct tables_pass *p, const struct tables_spec *s, const struct hfield *hf,
                      struct err *e)
{
    struct tables_pass got = {.spec = s};
    if (!spec_check(s, e) || !patch_init(&got.patch, hf, s->window, s->coherence_m, e))
        return false;
    if (!spectral_init(&got.light, s->light, s->step_m, e)) {
        patch_finish(&got.patch);
        return false;
    }
    *p = got;
    return true;
}

bool tables_pass_nodes(struct tables_pass *p, struct err *e)
{
    const struct tables_spec *s = p->spec;
    if (!table_nodes_check(s->n, s->range, s->power, e))
        return false;
    const struct table nodes = {.n = s->n, .range = s->range, .power = s->power};
    p->first = s->n / 2;
    p->node = xcalloc((size_t)s->n, sizeof *p->node);
    for (int i = 0; i < s->n; i++)
        p->node[i] = table_node(&nodes, i);
    return true;
}

void tables_pass_finish(struct tables_pass *p)
{
    if (!p)
        return;
    patch_finish(&p->patch);
    spectral_finish(&p->light);
    free(p->node);
    *p = (struct tables_pass){0};
}

int tables_pass_bundles(const struct tables_pass *p)
{
    return (p->spec->n - p->first - 1) / DIFFRACTION_BUNDLE + 1;
}

struct relay {
    int n, first;
    tables_take *take;
    void *ctx;
};

static void relay(void *ctx, int iu, const void *plus, const void *minus)
{
    const struct relay *r = ctx;
    const int bundle = iu / DIFFRACTION_BUNDLE, i = r->first + iu;
    r->take(r->ctx, bundle, i, plus, false);
    if (r->n - 1 - i != i)
        r->take(r->ctx, bundle, r->n - 1 - i, minus, true);
}

static struct diffraction grid_of(const struct tables_pass *p, size_t memory)
{
    return (struct diffraction){.patch = &p->patch,
                                .light = &p->light,
                                .u = p->node + p->first,
                                .v = p->node,
                                .nu = p->spec->n - p->first,
                                .nv = p->spec->n,
                                .repeat = {p->spec->repeat[0], p->spec->repeat[1]},
                                .absolute = p->spec->absolute,
                                .memory = memory};
}

bool tables_pass_run(const struct tables_pass *p, const struct diffraction_use *use, size_t memory,
                     tables_take *take, void *ctx, struct err *e)
{
    struct relay r = {.n = p->spec->n, .first = p->first, .take = take, .ctx = ctx};
    const struct diffraction d = grid_of(p, memory);
    return diffraction_run(&d, use, relay, &r, e);
}

double tables_pass_scale(const struct tables_pass *p, int l)
{
    const struct diffraction d = grid_of(p, 0);
    return diffraction_scale(&d, p->light.lambda_m[l]);
}

enum {
    CHEAP = 32, // w samples that are taken without asking
    PROBES = 7, // columns looked at otherwise
};

struct probe {
    const double *chebyshev; // [n][n]
    int n, nv, stride;
    double *energy; // [PROBES][n] of the Chebyshev coefficients
};

static void probe_column(void *ctx, int iu, const void *plus, const void *minus)
{
    (void)minus;
    const struct probe *b = ctx;
    for (int k = 0; k < 3 * b->nv; k++) {
        const float *x = (const float *)plus + (size_t)k * (size_t)b->stride;
        for (int m = 0; m < b->n; m++) {
            double c = 0;
            for (int i = 0; i < b->n; i++)
                c += b->chebyshev[m * b->n + i] * x[i];
            b->energy[iu * b->n + m] += c * c;
        }
    }
}

// The least degree beyond which less than 1e-6 (relative L2) of the Chebyshev series is left.
static int degree_of(const struct probe *b)
{
    double all = 0, rest = 0;
    for (int k = 0; k < PROBES * b->n; k++)
        all += b->energy[k];
    int n = b->n;
    while (n > CHEAP) {
        for (int iu = 0; iu < PROBES; iu++)
            rest += b->energy[iu * b->n + n - 1];
        if (rest > 1e-12 * all)
            break;
        n--;
    }
    return n;
}

static bool probe(const struct tables_pass *p, int bound, int *n, struct err *e)
{
    struct wnodes q;
    wnodes_init(&q, bound, p->spec->w_min, p->spec->w_max);
    double *c = xcalloc((size_t)bound * (size_t)bound, sizeof *c);
    double *energy = xcalloc((size_t)bound * PROBES, sizeof *energy);
    wnodes_chebyshev(&q, c);
    double u[PROBES];
    for (int k = 0; k < PROBES; k++)
        u[k] = p->node[p->first + (p->spec->n - 1 - p->first) * k / (PROBES - 1)];
    struct diffraction d = grid_of(p, p->spec->memory);
    d.u = u;
    d.nu = PROBES;
    struct diffraction_use *use = at_w_new(&p->patch, &p->light, q.w, bound, e);
    struct probe b = {.chebyshev = c, .n = bound, .nv = d.nv, .energy = energy};
    b.stride = at_w_stride(bound);
    const bool ok = use && diffraction_run(&d, use, probe_column, &b, e);
    if (ok)
        *n = degree_of(&b);
    at_w_free(use);
    free(c);
    free(energy);
    wnodes_finish(&q);
    return ok;
}

bool tables_wnodes(const struct tables_pass *p, int least, struct wnodes *q, struct err *e)
{
    // |S|^2 is made of exp(i 2 pi w (h - h') / lambda): its Chebyshev series in w has Bessel
    // coefficients of this argument, at most.
    const double z = 3.14159265358979323846 * 2 * p->patch.half_m / p->light.lambda_m[0] *
                     (p->spec->w_max - p->spec->w_min);
    int n = 2;
    while (n < z || fabs(jn(n, z)) > 1e-7)
        n++;
    if (n > CHEAP && !probe(p, n, &n, e))
        return false;
    wnodes_init(q, n > least ? n : least, p->spec->w_min, p->spec->w_max);
    return true;
}
