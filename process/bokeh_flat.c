// bokeh_flat.c - cutting out a bokeh's disc and dividing it by its light.
#include "process/bokeh_flat.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

bool flat_divide(struct flat *f, const float *pattern, struct err *e)
{
    struct disc_light light;
    if (!disc_light_fit(&light, &f->disc, f->raw, pattern, f->w, f->h, e))
        return false;
    if (f->level > 0)
        disc_light_relate(&light, f->level);
    disc_flatten(&light, f->raw, f->w, f->h, f->px);
    return true;
}

bool flat_init(struct flat *f, const float *picture, int w, int h, const struct disc *d,
               double level, double margin_px, struct err *e)
{
    const int reach = (int)ceil(d->radius_px + margin_px);
    const int left = (int)fmax(0, floor(d->cx_px) - reach),
              top = (int)fmax(0, floor(d->cy_px) - reach);
    const int right = (int)fmin(w, ceil(d->cx_px) + reach + 1),
              bottom = (int)fmin(h, ceil(d->cy_px) + reach + 1);
    *f = (struct flat){.w = right - left, .h = bottom - top, .left = left, .top = top};
    f->disc = (struct disc){d->cx_px - left, d->cy_px - top, d->radius_px, d->residual_px};
    f->level = level;
    const size_t n = (size_t)f->w * (size_t)f->h;
    f->raw = sample_alloc(n, sizeof *f->raw, "picture", e);
    f->px = f->raw ? sample_alloc(n, sizeof *f->px, "picture", e) : NULL;
    for (int j = 0; f->px && j < f->h; j++)
        memcpy(f->raw + (size_t)j * (size_t)f->w, picture + (size_t)(top + j) * (size_t)w + left,
               (size_t)f->w * sizeof *picture);
    return f->px && flat_divide(f, NULL, e);
}

void flat_finish(struct flat *f)
{
    free(f->raw);
    free(f->px);
    *f = (struct flat){0};
}
