// raw.c - camera raw and DNG through LibRaw: the counts of the sensor's mosaic as they are.
//
// The visible part of the sensor, one channel, black level still inside. meta: "nacre.bayer" is the
// 2 x 2 cell by rows ("RGGB"; "Y" for a sensor without filters), "nacre.black" its four black
// levels, "nacre.white" the count where pixels saturate.
#define _GNU_SOURCE
#include "core/codec.h"
#include "core/infile.h"
#include <libraw/libraw.h>
#include <math.h>
#include <string.h>
#include <time.h>

static void no_talk(void *data, const char *file, int offset)
{
    (void)data;
    (void)file;
    (void)offset; // the same failure comes back as a code
}

static void take_exposure(struct meta *m, const libraw_data_t *r)
{
    const libraw_imgother_t *o = &r->other;
    if (o->shutter > 0 && isfinite(o->shutter))
        meta_set_num(m, "expTime", (double)o->shutter);
    if (o->iso_speed > 0 && isfinite(o->iso_speed))
        meta_set_num(m, "isoSpeed", (double)o->iso_speed);
    if (o->aperture > 0 && isfinite(o->aperture))
        meta_set_num(m, "aperture", (double)o->aperture);
    struct tm tm;
    char date[32];
    if (o->timestamp > 0 && localtime_r(&o->timestamp, &tm) &&
        strftime(date, sizeof date, "%Y:%m:%d %H:%M:%S", &tm))
        meta_set_text(m, "capDate", date);
    if (*r->idata.model)
        meta_set_text(m, "cameraModel", r->idata.model);
}

static void take_mosaic(struct meta *m, libraw_data_t *r)
{
    char cell[5] = "Y";
    double black[4];
    for (int k = 0; k < 4; k++) {
        const int c = r->idata.filters ? libraw_COLOR(r, k / 2, k % 2) : 0;
        if (r->idata.filters)
            cell[k] = r->idata.cdesc[c];
        const unsigned *cb = r->color.cblack; // [0..3] by colour, [4],[5] a pattern's size, then it
        const unsigned pattern =
            cb[4] && cb[5] ? cb[6 + (unsigned)(k / 2) % cb[4] * cb[5] + (unsigned)(k % 2) % cb[5]]
                           : 0;
        black[k] = (double)r->color.black + cb[c] + pattern;
    }
    meta_set_text(m, "nacre.bayer", cell);
    meta_set_nums(m, "nacre.black", black, 4);
    meta_set_num(m, "nacre.white", r->color.maximum);
}

static bool read_mosaic(libraw_data_t *r, int64_t size, struct image *im, struct err *e)
{
    const libraw_image_sizes_t *s = &r->sizes;
    if (r->idata.filters && r->idata.filters < 1000)
        return err_set(e, ERR_DATA, "a mosaic that is not a 2 x 2 cell (Bayer): not supported");
    if (!infile_claim(size, (double)s->raw_width * s->raw_height, e))
        return false;
    const int code = libraw_unpack(r);
    if (code)
        return err_set(e, ERR_DATA, "damaged or cut short: %s", libraw_strerror(code));
    const uint16_t *raw = r->rawdata.raw_image;
    if (!raw || s->left_margin + s->width > s->raw_width ||
        s->top_margin + s->height > s->raw_height)
        return err_set(e, ERR_DATA, "no integer mosaic inside: must be one sample a pixel");
    if (!image_init(im, s->width, s->height, 1, e))
        return false;
    const size_t pitch = s->raw_pitch / 2;
    for (int j = 0; j < im->h; j++) {
        const uint16_t *from = raw + (size_t)(j + s->top_margin) * pitch + s->left_margin;
        for (int i = 0; i < im->w; i++)
            im->px[(size_t)j * (size_t)im->w + (size_t)i] = from[i];
    }
    meta_set_text(&im->meta, "channels", "Y");
    take_mosaic(&im->meta, r);
    take_exposure(&im->meta, r);
    return true;
}

bool raw_read(struct image *im, const char *path, struct err *e)
{
    struct infile in = {0};
    if (!infile_open(&in, path, e))
        return false;
    const int64_t size = in.size;
    infile_close(&in);
    libraw_data_t *r = libraw_init(0);
    if (!r)
        return err_set(e, ERR_FILE, "no memory for LibRaw");
    libraw_set_dataerror_handler(r, no_talk, NULL);
    const int code = libraw_open_file(r, path);
    const bool ok = code ? err_set(e, ERR_DATA, "not a camera raw file: %s", libraw_strerror(code))
                         : read_mosaic(r, size, im, e);
    libraw_close(r);
    return ok;
}
