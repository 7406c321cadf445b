// lut_preview.c - the same engine, on fewer nodes and with a looser tolerance first.
#include "process/lut_preview.h"
#include <math.h>

void lut_preview_frame(struct lut_preview *p, const struct lut_pattern *pattern)
{
    p->request.pattern = pattern;
    p->level = 0;
}

bool lut_preview_done(const struct lut_preview *p)
{
    return p->level == LUT_PREVIEW_LEVELS;
}

bool lut_preview_next(struct lut_preview *p, struct table *t, struct err *e)
{
    struct lut_request r = p->request;
    const int finer = LUT_PREVIEW_LEVELS - 1 - p->level;
    struct lut_report report;
    r.n = r.n >> finer < 2 ? 2 : r.n >> finer;
    if (finer) { // ten times looser a level: fewer rays and radii
        r.method = LUT_EXACT;
        r.tolerance = fmin(0.1, r.tolerance * pow(10, finer));
    }
    if (!lut_build(&r, t, &report, e))
        return false;
    p->level++;
    return true;
}
