// growth.c - merge what is there, then one level of the table a job.
#define _GNU_SOURCE
#include "ui/growth.h"
#include "core/log.h"
#include "process/exposure.h"
#include "process/mosaic.h"
#include "ui/pitch.h"
#include <math.h>
#include <string.h>

static const double f0 = 0.2; // of glass; the shape does not depend on it

static bool merge(struct frames *f, struct image *out, struct hdr_noise *noise, struct err *e)
{
    struct hdr_counts counts;
    struct hdr_frames h = {.n = f->n,
                           .w = f->w,
                           .h = f->h,
                           .nc = f->nc,
                           .px = (const float *const *)f->px,
                           .time_s = f->time_s,
                           .saturation = f->saturation};
    *noise = h.noise = exposure_noise(&h);
    return hdr_merge(&h, HDR_POISSON, out, &counts, e);
}

// The channel that the filter's light falls into.
static int channel_of(const struct image *im, double lambda_m)
{
    const int c = lambda_m > 590e-9 ? 0 : lambda_m > 490e-9 ? 1 : 2;
    return im->nc < 7 ? 0 : c;
}

static bool spread(const struct frames *f, struct image *merged, struct err *e)
{
    const char *cell = meta_text(&f->meta, "nacre.bayer");
    struct image out;
    if (!cell || strlen(cell) < 4) // a grey sensor
        return true;
    if (!mosaic_spread(merged, cell, &out, e))
        return false;
    image_finish(merged);
    *merged = out;
    return true;
}

static bool make_pattern(struct growth *g, struct err *e)
{
    const struct session_choice choice = {.group = g->order.group, .first = g->order.frames};
    struct frames f = {0};
    struct dark dark = {0};
    struct image merged = {0};
    struct lut_pattern p = {0};
    bool ok = session_frames_read(&f, &dark, g->order.folder, &choice, e);
    if (!ok)
        return false;
    ok = frames_remove_black(&f, dark.frames ? &dark : NULL, g->order.folder, e) &&
         merge(&f, &merged, &g->noise, e) && spread(&f, &merged, e);
    g->lambda_m = f.lambda_m > 0 ? f.lambda_m : 530e-9;
    ok = ok && lut_pattern_init(&p, &merged, channel_of(&merged, g->lambda_m),
                                f.brdf_scale > 0 ? f.brdf_scale : 1, e);
    if (ok && !lut_pattern_center(&p, e)) {
        lut_pattern_finish(&p);
        ok = false;
    }
    if (ok) {
        p.h_per_px = g->order.h_per_px;
        g->cx = p.cx;
        g->cy = p.cy;
        lut_pattern_finish(&g->pattern);
        g->pattern = p;
        g->pitch_m = pitch_of_pattern(&p, g->lambda_m);
    }
    image_finish(&merged);
    dark_finish(&dark);
    frames_finish(&f);
    return ok;
}

// As far as the photograph's frame lets every wavelength see.
static double range_of(const struct growth *g)
{
    const struct lut_pattern *p = &g->pattern;
    const double left = fmin(p->cx, p->w - 1 - p->cx), top = fmin(p->cy, p->h - 1 - p->cy);
    const double reach = fmin(left, top) * p->h_per_px;
    return fmin(2, reach * CIE_FIRST_NM * 1e-9 / g->lambda_m);
}

static bool begin(struct growth *g, struct err *e)
{
    if (!g->light.n && !illuminant_get(&g->light, "D65", e))
        return false;
    if (!make_pattern(g, e))
        return false;
    g->preview.request = (struct lut_request){.lambda_m = g->lambda_m,
                                              .light = &g->light,
                                              .f0 = f0,
                                              .exponent = 2,
                                              .n = g->order.size,
                                              .range = range_of(g),
                                              .power = 1,
                                              .is_rgb = true,
                                              .method = LUT_AUTO,
                                              .tolerance = 1e-3};
    lut_preview_frame(&g->preview, &g->pattern);
    return true;
}

void growth_run(void *job)
{
    struct growth *g = job;
    const double start_s = now_s();
    struct table t = {0};
    g->ok = (!g->fresh || begin(g, &g->e)) && lut_preview_next(&g->preview, &t, &g->e);
    g->fresh = false;
    if (g->ok) {
        meta_set_num(&t.meta, "nacre.f0", f0);
        table_finish(&g->table);
        g->table = t;
        g->level = g->preview.level;
    } else {
        g->preview.level = LUT_PREVIEW_LEVELS;
    }
    g->seconds = now_s() - start_s;
}

bool growth_is_done(const struct growth *g)
{
    return !g->fresh && lut_preview_done(&g->preview);
}

void growth_finish(struct growth *g)
{
    table_finish(&g->table);
    lut_pattern_finish(&g->pattern);
    spectrum_finish(&g->light);
    *g = (struct growth){0};
}
