// wbasis.c - curves in w from the Gram matrix of a table.
#include "process/wbasis.h"
#include "core/mem.h"
#include "process/svd.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static void start(struct wbasis *b, int nw, int max)
{
    const size_t n = (size_t)nw, m = (size_t)max;
    *b = (struct wbasis){.nw = nw, .max = max};
    b->project = xcalloc(m * n, sizeof *b->project);
    b->curve = xcalloc(m * n, sizeof *b->curve);
    b->error = xcalloc(m + 1, sizeof *b->error);
    b->worst_w = xcalloc(m + 1, sizeof *b->worst_w);
}

void wbasis_finish(struct wbasis *b)
{
    if (!b)
        return;
    free(b->project);
    free(b->curve);
    free(b->error);
    free(b->worst_w);
    *b = (struct wbasis){0};
}

// Error with 0..max tables. The residual is R X with R = 1 - sum of curve project^T; taking one
// more table (b, p) from R changes D = R G R^T by two rank-one terms.
static void measure(struct wbasis *b, const struct wnodes *q, const double *gram)
{
    const int n = b->nw;
    const size_t bytes = (size_t)n * (size_t)n * sizeof(double);
    double *d = xcalloc(1, bytes), *r = xcalloc(1, bytes), *gp = xcalloc((size_t)n, sizeof *gp),
           *c = xcalloc((size_t)n, sizeof *c);
    memcpy(d, gram, bytes);
    for (int k = 0; k < n; k++)
        r[k * n + k] = 1;
    for (int m = 0; m <= b->max; m++) {
        double all = 0, left = 0, worst = 0;
        for (int k = 0; k < n; k++) {
            const double energy = gram[k * n + k], rest = fmax(0, d[k * n + k]);
            all += q->weight[k] * energy;
            left += q->weight[k] * rest;
            if (energy > 0)
                worst = fmax(worst, rest / energy);
        }
        b->error[m] = all > 0 ? sqrt(left / all) : 0;
        b->worst_w[m] = sqrt(worst);
        if (m == b->max)
            break;
        const double *p = b->project + m * n, *curve = b->curve + m * n;
        double pgp = 0;
        for (int k = 0; k < n; k++) {
            gp[k] = 0;
            for (int i = 0; i < n; i++)
                gp[k] += gram[k * n + i] * p[i];
            pgp += p[k] * gp[k];
        }
        for (int k = 0; k < n; k++) {
            c[k] = 0;
            for (int i = 0; i < n; i++)
                c[k] += r[k * n + i] * gp[i];
        }
        for (int k = 0; k < n; k++)
            for (int i = 0; i < n; i++) {
                d[k * n + i] += -c[k] * curve[i] - curve[k] * c[i] + curve[k] * pgp * curve[i];
                r[k * n + i] -= curve[k] * p[i];
            }
    }
    free(d);
    free(r);
    free(gp);
    free(c);
}

bool wbasis_pod(struct wbasis *b, const struct wnodes *q, const double *gram, int max,
                struct err *e)
{
    const int n = q->n;
    const size_t n2 = (size_t)n * (size_t)n;
    double *a = xcalloc(n2, sizeof *a), *u = xcalloc(n2, sizeof *u), *vt = xcalloc(n2, sizeof *vt),
           *s = xcalloc((size_t)n, sizeof *s);
    for (int k = 0; k < n; k++)
        for (int i = 0; i < n; i++)
            a[k * n + i] = sqrt(q->weight[k] * q->weight[i]) * gram[k * n + i];
    const bool ok = svd(n, n, a, u, s, vt, e);
    if (ok) {
        start(b, n, max < n ? max : n);
        for (int m = 0; m < b->max; m++) {
            double top = 0; // singular vectors have no sign of their own: their peak is positive
            for (int k = 0; k < n; k++)
                if (fabs(u[k * n + m]) > fabs(top) * (1 + 1e-9))
                    top = u[k * n + m];
            for (int k = 0; k < n; k++) {
                const double root = sqrt(q->weight[k]), v = copysign(1, top) * u[k * n + m];
                b->curve[m * n + k] = v / root;
                b->project[m * n + k] = v * root;
            }
        }
        measure(b, q, gram);
    }
    free(a);
    free(u);
    free(vt);
    free(s);
    return ok;
}

bool wbasis_chebyshev(struct wbasis *b, const struct wnodes *q, const double *gram, int max,
                      struct err *e)
{
    const int n = q->n;
    for (int k = 0; k < n * n; k++)
        if (!isfinite(gram[k]))
            return err_set(e, ERR_DATA, "the table holds NaN");
    double *c = xcalloc((size_t)n * (size_t)n, sizeof *c);
    wnodes_chebyshev(q, c);
    start(b, n, max < n ? max : n);
    for (int m = 0; m < b->max; m++)
        for (int k = 0; k < n; k++) {
            const double x = (2 * q->w[k] - q->lo - q->hi) / (q->hi - q->lo);
            b->curve[m * n + k] = cos(m * acos(x));
            b->project[m * n + k] = c[m * n + k];
        }
    free(c);
    measure(b, q, gram);
    return true;
}

int wbasis_count(const struct wbasis *b, double tolerance)
{
    int least = 1;
    while (least <= b->max && b->error[least] > tolerance)
        least++;
    if (least > b->max)
        return 0;
    return least < b->max && b->worst_w[least] > tolerance ? least + 1 : least;
}
