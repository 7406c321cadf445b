// height_picture.c - heights in pictures: .exr and .pfm in metres, .tif and .png times --z-scale.
//
// .exr keeps the node spacing ("nacre.dx_m", "nacre.dy_m"); .pfm, .tif and .png cannot.
#define _GNU_SOURCE
#include "core/codec.h"
#include "core/hcodec.h"
#include "core/imgfile.h"
#include "core/log.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool is_metric(const char *path)
{
    return !strcmp(path_ext(path), ".exr") || !strcmp(path_ext(path), ".pfm");
}

static int height_channel(const struct image *im)
{
    static const char *const names[] = {"height", "Z", "Y"};
    for (int k = 0; k < 3 && im->nc > 1; k++)
        if (image_channel_index(im, names[k]) >= 0 && image_channel_index(im, "X") < 0)
            return image_channel_index(im, names[k]);
    return im->nc == 1 ? 0 : -1;
}

static bool take(struct hfield *hf, const struct image *im, const char *path,
                 const struct hfield_hints *hints, struct err *e)
{
    const bool scaled = hints && hints->z_scale_m > 0;
    double encoded = 0, dx = NAN, dy = NAN;
    meta_num(&im->meta, "nacre.encoded", &encoded);
    const int c = height_channel(im);
    if (c < 0)
        return err_set(e, ERR_DATA, "%d channels: a height picture has one", im->nc);
    if (encoded > 0)
        return err_set(e, ERR_DATA, "8-bit samples: a height picture needs 16");
    if (!scaled && !is_metric(path))
        return err_set(e, ERR_DATA,
                       "the file states no height unit: give --z-scale, the height of "
                       "white (such as 0.5um)");
    meta_num(&im->meta, "nacre.dx_m", &dx);
    meta_num(&im->meta, "nacre.dy_m", &dy);
    if (!hfield_spacing(hints, dx, dy, &dx, &dy, e) || !hfield_init(hf, im->w, im->h, dx, dy, e))
        return false;
    const double scale_m = scaled ? hints->z_scale_m : 1;
    for (size_t k = 0; k < (size_t)im->w * (size_t)im->h; k++)
        hf->z[k] = (float)(scale_m * (double)im->px[k * (size_t)im->nc + (size_t)c]);
    meta_copy(&hf->meta, &im->meta);
    static const char *const used[] = {"channels", "nacre.dx_m", "nacre.dy_m", "nacre.encoded"};
    for (size_t k = 0; k < sizeof used / sizeof *used; k++)
        meta_drop(&hf->meta, used[k]);
    return true;
}

// Messages of image_read() name the file already; those of take() do not, as the caller expects.
bool height_picture_read(struct hfield *hf, const char *path, const struct hfield_hints *hints,
                         struct err *e)
{
    struct image im = {0};
    const char *ext = path_ext(path);
    const bool read = !strcmp(ext, ".exr")   ? exr_read(&im, path, e)
                      : !strcmp(ext, ".pfm") ? pfm_read(&im, path, e)
                                             : picture_read(&im, path, e);
    const bool ok = read && take(hf, &im, path, hints, e);
    image_finish(&im);
    return ok;
}

// Samples of 0..1 for 16 bits: white is z_scale above the lowest node.
static bool to_unit(struct image *im, const struct hfield *hf, double z_scale_m, struct err *e)
{
    double lo = 0, hi = 0;
    const long missing = hfield_missing(hf);
    if (missing)
        return err_set(e, ERR_DATA,
                       "%ld missing nodes, which a 16-bit picture cannot hold: "
                       "write .gsf, .x3p or .exr",
                       missing);
    hfield_range(hf, &lo, &hi);
    lo = lo < 0 ? lo : 0;
    if (hi - lo > z_scale_m)
        return err_set(e, ERR_DATA, "heights span %g m, more than --z-scale %g m", hi - lo,
                       z_scale_m);
    if (lo < 0)
        log_note("black is %g m: heights are shifted up by %g m", lo, -lo);
    for (size_t k = 0; k < (size_t)im->w * (size_t)im->h; k++)
        im->px[k] = (float)(((double)hf->z[k] - lo) / z_scale_m);
    return true;
}

bool height_picture_write(const struct hfield *hf, const char *path,
                          const struct hfield_hints *hints, struct err *e)
{
    const bool scaled = hints && hints->z_scale_m > 0, is_exr = !strcmp(path_ext(path), ".exr");
    if (!scaled && !is_metric(path))
        return err_set(e, ERR_DATA, "give --z-scale, the height of white (such as 0.5um)");
    struct image im;
    if (!image_init(&im, hf->nx, hf->ny, 1, e))
        return false;
    const size_t n = (size_t)im.w * (size_t)im.h;
    bool ok = true;
    if (is_metric(path))
        memcpy(im.px, hf->z, n * sizeof *im.px);
    else
        ok = to_unit(&im, hf, hints->z_scale_m, e);
    meta_copy(&im.meta, &hf->meta);
    meta_set_text(&im.meta, "channels", is_exr ? "height" : "Y");
    meta_set_num(&im.meta, "nacre.dx_m", hf->dx_m);
    meta_set_num(&im.meta, "nacre.dy_m", hf->dy_m);
    ok = ok && (is_exr ? exr_write : is_metric(path) ? pfm_write : linear16_write)(&im, path, e);
    image_finish(&im);
    return ok;
}
