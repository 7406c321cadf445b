// frames.c - reading a bracket: every check that one frame alone cannot fail.
#define _GNU_SOURCE
#include "ui/frames.h"
#include "calib/bracket.h"
#include "core/imgfile.h"
#include "core/log.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

void frames_finish(struct frames *f)
{
    for (int k = 0; k < f->n; k++) {
        free(f->code ? f->code[k] : NULL);
        free(f->px ? f->px[k] : NULL);
        free(f->path[k]);
    }
    free(f->code);
    free(f->px);
    free(f->path);
    free(f->time_s);
    meta_finish(&f->meta);
    *f = (struct frames){0};
}

double file_white(const struct image *im)
{
    double white, encoded;
    if (meta_num(&im->meta, "nacre.white", &white))
        return white;
    return meta_num(&im->meta, "nacre.encoded", &encoded) ? 1 - 0.5 / 65535 : INFINITY;
}

// Only one channel or R, G, B are frames; alpha and others are left out.
static bool keep_colours(struct image *im, const char *path, struct err *e)
{
    static const char *const rgb[] = {"R", "G", "B"};
    int from[3];
    if (im->nc == 1)
        return true;
    for (int c = 0; c < 3; c++)
        if ((from[c] = image_channel_index(im, rgb[c])) < 0)
            return err_set(e, ERR_DATA, "%s: has %d channels, but not R, G and B", path, im->nc);
    const size_t n = (size_t)im->w * (size_t)im->h, nc = (size_t)im->nc;
    for (size_t k = 0; k < n && nc != 3; k++) {
        const float v[3] = {im->px[k * nc + (size_t)from[0]], im->px[k * nc + (size_t)from[1]],
                            im->px[k * nc + (size_t)from[2]]};
        memcpy(im->px + 3 * k, v, sizeof v);
    }
    im->nc = 3;
    return true;
}

// One frame; `path` becomes the frames' own.
static bool take(struct frames *f, struct image *im, const char *path, struct err *e)
{
    const int k = f->n;
    double encoded = 0;
    const bool is_code = meta_num(&im->meta, "nacre.encoded", &encoded) && encoded > 0;
    if (!keep_colours(im, path, e) || !image_check_finite(im, path, e))
        return false;
    if (!k) {
        f->w = im->w;
        f->h = im->h;
        f->nc = im->nc;
        f->white = file_white(im);
        meta_copy(&f->meta, &im->meta);
        record_init(&f->now, "", "", NAN, "");
        record_from_image(&f->now, im);
    }
    if (im->w != f->w || im->h != f->h)
        return err_set(e, ERR_DATA, "%s: is %d x %d pixels, but %s is %d x %d", path, im->w, im->h,
                       f->path[0], f->w, f->h);
    if (im->nc != f->nc || (k && is_code != (f->code[0] != NULL)))
        return err_set(e, ERR_DATA, "%s: is of another kind than %s (channels or bits)", path,
                       f->path[0]);
    const size_t n = (size_t)im->w * (size_t)im->h * (size_t)im->nc;
    uint8_t *code = is_code ? sample_alloc(n, 1, path, e) : NULL;
    if (is_code && !code)
        return false;
    for (size_t i = 0; code && i < n; i++)
        code[i] = (uint8_t)lrintf(im->px[i] * 255);
    f->path[k] = xstrdup(path);
    f->code[k] = code;
    f->px[k] = is_code ? NULL : im->px;
    if (!is_code)
        im->px = NULL;
    f->printed_times |= is_code;
    f->white = fmin(f->white, file_white(im));
    if (!meta_num(&im->meta, "expTime", &f->time_s[k]))
        f->time_s[k] = NAN;
    f->n++;
    return true;
}

// Files without a stated white level: when the two longest exposures end at the very same sample,
// or one ends in a plateau, that is where they saturate.
static double plateau(const struct frames *f)
{
    const size_t n = (size_t)f->w * (size_t)f->h * (size_t)f->nc;
    float top = 0;
    int frames = 0;
    long count = 0;
    for (int k = 0; k < f->n; k++) {
        float here = 0;
        long same = 0;
        for (size_t i = 0; i < n; i++) {
            same = f->px[k][i] > here ? 1 : same + (f->px[k][i] == here);
            here = fmaxf(here, f->px[k][i]);
        }
        frames = here > top ? 1 : frames + (here == top);
        count = here > top ? same : count + (here == top ? same : 0);
        top = fmaxf(top, here);
    }
    return frames > 1 || count > 8 ? (double)top : INFINITY;
}

bool frames_read(struct frames *f, int n, char *const *path, struct err *e)
{
    if (n < 2)
        return err_set(e, ERR_DATA, "%s: one frame is not a bracket: give two or more", path[0]);
    if (n > BRACKET_MAX)
        return err_set(e, ERR_DATA, "%d frames are too many: at most %d", n, BRACKET_MAX);
    struct progress p;
    *f = (struct frames){.path = xcalloc((size_t)n, sizeof *f->path),
                         .time_s = xcalloc((size_t)n, sizeof *f->time_s),
                         .code = xcalloc((size_t)n, sizeof *f->code),
                         .px = xcalloc((size_t)n, sizeof *f->px)};
    progress_start(&p, "reading", n);
    bool ok = true;
    for (int k = 0; ok && k < n; k++) {
        struct image im = {0};
        ok = image_read(&im, path[k], e) && take(f, &im, path[k], e);
        image_finish(&im);
        progress_step(&p, 1);
    }
    progress_end(&p);
    if (ok && f->px[0] && isinf(f->white))
        f->white = plateau(f);
    if (!ok)
        frames_finish(f);
    return ok;
}

bool frames_dark_fits(const struct frames *f, const struct dark *d, const char *name, struct err *e)
{
    struct record now = f->now;
    now.aperture = now.focus_per_m = now.distance_m = NAN; // the lens is no part of it
    *now.lens = 0;
    if (f->nc != 1)
        return err_set(e, ERR_DATA,
                       "%s: a dark is for the counts of a sensor, %s is a picture of %d "
                       "channels",
                       name, f->path[0], f->nc);
    return record_fits(&d->head, name, &now, e);
}

// Charge of a saturated pixel spills into its neighbours: in that frame they count as saturated
// too.
static void mask_spills(struct frames *f)
{
    const int w = f->w, h = f->h;
    const float top = (float)f->saturation;
    for (int k = 0; k < f->n && f->nc == 1; k++) {
        float *px = f->px[k];
        for (int j = 0; j < h; j++)
            for (int i = 0; i < w; i++) {
                float *p = px + (size_t)j * (size_t)w + (size_t)i;
                if (*p < top || isinf(*p))
                    continue;
                if (i > 0 && p[-1] < top)
                    p[-1] = INFINITY;
                if (i < w - 1 && p[1] < top)
                    p[1] = INFINITY;
                if (j > 0 && p[-w] < top)
                    p[-w] = INFINITY;
                if (j < h - 1 && p[w] < top)
                    p[w] = INFINITY;
            }
    }
}

bool frames_remove_black(struct frames *f, const struct dark *d, const char *name, struct err *e)
{
    const struct meta_item *item = meta_find(&f->meta, "nacre.black");
    const size_t n = (size_t)f->w * (size_t)f->h * (size_t)f->nc;
    double level[4] = {0}, most = 0;
    if (d && !frames_dark_fits(f, d, name, e))
        return false;
    for (int k = 0; k < 4 && item && item->n == 4; k++)
        level[k] = item->num[k];
    for (int k = 0; k < f->n; k++)
        for (size_t i = 0; i < n; i++) {
            const size_t pixel = i / (size_t)f->nc, row = pixel / (size_t)f->w;
            const double black =
                d ? dark_at(d, pixel, f->time_s[k]) : level[row % 2 * 2 + pixel % (size_t)f->w % 2];
            f->px[k][i] -= (float)black;
            if (!d || !d->hot[pixel])
                most = fmax(most, black);
        }
    f->saturation = f->white - most;
    if (meta_find(&f->meta, "nacre.white"))
        mask_spills(f);
    f->read_extra = d ? dark_variance(d) : 0;
    return true;
}
