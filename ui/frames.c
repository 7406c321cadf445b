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
    }
    free(f->code);
    free(f->px);
    free(f->path);
    free(f->time_s);
    meta_finish(&f->meta);
    *f = (struct frames){0};
}

// Counts of a sensor's mosaic above the black level of their site.
static void remove_black(struct image *im)
{
    const struct meta_item *black = meta_find(&im->meta, "nacre.black");
    if (!black || black->n != 4)
        return;
    for (int j = 0; j < im->h; j++)
        for (int i = 0; i < im->w; i++)
            im->px[(size_t)j * (size_t)im->w + (size_t)i] -= (float)black->num[j % 2 * 2 + i % 2];
}

static double largest_of(const double *v, int n)
{
    double top = v[0];
    for (int k = 1; k < n; k++)
        top = fmax(top, v[k]);
    return top;
}

// Where the samples of a file end: a sensor's white level, full scale of 16 bits, else unknown.
static double file_saturation(const struct image *im)
{
    const struct meta_item *black = meta_find(&im->meta, "nacre.black");
    double white, encoded;
    if (meta_num(&im->meta, "nacre.white", &white))
        return white - (black && black->n ? largest_of(black->num, black->n) : 0);
    if (meta_num(&im->meta, "nacre.encoded", &encoded))
        return 1 - 0.5 / 65535;
    return INFINITY;
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

static bool take(struct frames *f, struct image *im, struct err *e)
{
    const int k = f->n;
    const char *path = f->path[k];
    double encoded = 0;
    const bool is_code = meta_num(&im->meta, "nacre.encoded", &encoded) && encoded > 0;
    if (!keep_colours(im, path, e) || !image_check_finite(im, path, e))
        return false;
    if (!k) {
        f->w = im->w;
        f->h = im->h;
        f->nc = im->nc;
        f->saturation = file_saturation(im);
        meta_copy(&f->meta, &im->meta);
    }
    if (im->w != f->w || im->h != f->h)
        return err_set(e, ERR_DATA, "%s: is %d x %d pixels, but %s is %d x %d", path, im->w, im->h,
                       f->path[0], f->w, f->h);
    if (im->nc != f->nc || (k && is_code != (f->code[0] != NULL)))
        return err_set(e, ERR_DATA, "%s: is of another kind than %s (channels or bits)", path,
                       f->path[0]);
    remove_black(im);
    f->n++;
    if (!meta_num(&im->meta, "expTime", &f->time_s[k]))
        f->time_s[k] = NAN;
    f->saturation = fmin(f->saturation, file_saturation(im));
    const size_t n = (size_t)im->w * (size_t)im->h * (size_t)im->nc;
    if (!is_code) {
        f->px[k] = im->px;
        im->px = NULL;
        return true;
    }
    f->printed_times = true;
    f->code[k] = sample_alloc(n, 1, path, e);
    for (size_t i = 0; f->code[k] && i < n; i++)
        f->code[k][i] = (uint8_t)lrintf(im->px[i] * 255);
    return f->code[k] != NULL;
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

bool frames_read(struct frames *f, int n, char **path, struct err *e)
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
        f->path[k] = path[k];
        ok = image_read(&im, path[k], e) && take(f, &im, e);
        image_finish(&im);
        progress_step(&p, 1);
    }
    progress_end(&p);
    if (ok && f->px[0] && isinf(f->saturation))
        f->saturation = plateau(f);
    if (!ok)
        frames_finish(f);
    return ok;
}
