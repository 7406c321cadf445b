// lut_exact.c - the table by correlation along the logarithm of the radius (logpolar.h).
#define _GNU_SOURCE
#include "core/mem.h"
#include "process/lut_kernel.h"
#include <stdlib.h>

bool lut_exact(const struct lut_request *r, const struct lp_kernel *k, struct table *t,
               struct lut_report *report, struct err *e)
{
    const struct lut_pattern *p = r->pattern;
    const struct lp_picture picture = {p->px, p->w, p->h, p->cx, p->cy, p->variance};
    const double part = 0.2 * r->tolerance; // ray spacing, steps of the results: a share each
    double *x = lut_node_px(t, p);
    const struct lp_nodes nodes = {.n = t->n, .x = x};
    const bool ok = lp_correlate(&picture, k, &nodes, lp_density(&picture, part), part, t->tab,
                                 &report->skipped, e);
    free(x);
    return ok;
}
