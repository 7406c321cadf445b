// image.c - pictures of linear samples.
#define _GNU_SOURCE
#include "core/image.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

bool image_init(struct image *im, int w, int h, int nc, struct err *e)
{
    if (w < 1 || h < 1 || w > IMAGE_MAX_SIDE || h > IMAGE_MAX_SIDE)
        return err_set(e, ERR_DATA, "bad size %d x %d: each side must be 1 to %d pixels", w, h,
                       IMAGE_MAX_SIDE);
    if (nc < 1 || nc > IMAGE_MAX_CHANNELS)
        return err_set(e, ERR_DATA, "bad channel count %d: must be 1 to %d", nc,
                       IMAGE_MAX_CHANNELS);
    float *px = sample_alloc((size_t)w * (size_t)h * (size_t)nc, sizeof *px, "image", e);
    if (!px)
        return false;
    *im = (struct image){.w = w, .h = h, .nc = nc, .px = px};
    return true;
}

void image_finish(struct image *im)
{
    if (!im)
        return;
    free(im->px);
    meta_finish(&im->meta);
    *im = (struct image){0};
}

static const char *channel_names(const struct image *im)
{
    const char *names = meta_text(&im->meta, "channels");
    return names ? names : im->nc == 1 ? "Y" : im->nc == 4 ? "R,G,B,A" : "R,G,B";
}

int image_channel_index(const struct image *im, const char *name)
{
    const size_t len = strlen(name);
    int c = 0;
    for (const char *s = channel_names(im); c < im->nc; c++) {
        const char *end = strchrnul(s, ',');
        if ((size_t)(end - s) == len && !strncasecmp(s, name, len))
            return c;
        if (!*end)
            break;
        s = end + 1;
    }
    return -1;
}

bool image_channel(const struct image *im, int c, struct image *out, struct err *e)
{
    if (c < 0 || c >= im->nc)
        return err_set(e, ERR_DATA, "no channel %d: the image has %d", c, im->nc);
    struct image one;
    if (!image_init(&one, im->w, im->h, 1, e))
        return false;
    const size_t n = (size_t)im->w * (size_t)im->h;
    for (size_t k = 0; k < n; k++)
        one.px[k] = im->px[k * (size_t)im->nc + (size_t)c];
    meta_copy(&one.meta, &im->meta);
    meta_drop(&one.meta, "channels");
    *out = one;
    return true;
}

struct flaws image_flaws(const struct image *im)
{
    struct flaws f = {0};
    const size_t row = (size_t)im->w * (size_t)im->nc, n = row * (size_t)im->h;
    for (size_t k = 0; k < n; k++)
        if (!isfinite(im->px[k]) && !f.n++)
            f = (struct flaws){1, (int)(k % row) / im->nc, (int)(k / row), (int)(k % row) % im->nc};
    return f;
}
