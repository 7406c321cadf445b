// env_terms.c - sums of products by powers of w = i_n + o_n.
#define _GNU_SOURCE
#include "process/env_terms.h"
#include "core/mem.h"
#include <stdlib.h>
#include <string.h>

static double binomial(int n, int k)
{
    return k == 0 ? 1 : binomial(n - 1, k - 1) * n / k;
}

// n^k, with n^2 = 1 - t^2 - b^2.
struct direction_poly direction_poly_power(int k)
{
    struct direction_poly p = {.degree = k / 2 * 2};
    const int m = k / 2;
    for (int i = 0; i <= m; i++)
        for (int j = 0; i + j <= m; j++) {
            const double sign = (i + j) % 2 ? -1 : 1;
            const double c = sign * binomial(m, i + j) * binomial(i + j, i);
            (k % 2 ? p.odd : p.even)[2 * i][2 * j] = c;
        }
    return p;
}

void direction_poly_row(const struct direction_poly *p, double b, double *even, double *odd)
{
    for (int i = 0; i <= p->degree; i++) {
        even[i] = odd[i] = 0;
        for (int j = p->degree - i; j >= 0; j--) {
            even[i] = even[i] * b + p->even[i][j];
            odd[i] = odd[i] * b + p->odd[i][j];
        }
    }
}

bool env_terms_polynomial(struct env_terms *t, const struct table *table, const struct fresnel *f,
                          double tolerance, struct err *e)
{
    *t = (struct env_terms){0};
    if (!zonal_fit(&t->zonal, table, f, tolerance, e))
        return false;
    const int count = t->zonal.degree + 1;
    t->n_pre = t->n_kernel = t->n_post = count;
    t->error = t->zonal.error;
    t->pre = xcalloc((size_t)count, sizeof *t->pre);
    t->post = xcalloc((size_t)count, sizeof *t->post);
    t->term = xcalloc((size_t)(count * (count + 1) / 2), sizeof *t->term);
    for (int p = 0; p < count; p++) {
        t->pre[p] = t->post[p] = direction_poly_power(p);
        for (int k = p; k < count; k++)
            if (zonal_uses(&t->zonal, k))
                t->term[t->n++] = (struct env_term){k - p, k, p, binomial(k, p)};
    }
    return true;
}

void env_terms_finish(struct env_terms *t)
{
    if (!t)
        return;
    free(t->pre);
    free(t->post);
    free(t->term);
    zonal_finish(&t->zonal);
    *t = (struct env_terms){0};
}
