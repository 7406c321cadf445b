// linear.c - the sRGB curve off 8-bit pictures.
#include "ui/linear.h"
#include "calib/response_file.h"
#include "core/log.h"
#include "core/spectrum.h"
#include <math.h>
#include <stddef.h>
#include <string.h>

void make_linear(struct image *im, const char *path)
{
    double encoded = 0;
    if (!meta_num(&im->meta, "nacre.encoded", &encoded) || !(encoded > 0))
        return;
    const size_t n = (size_t)im->w * (size_t)im->h * (size_t)im->nc;
    for (size_t k = 0; k < n; k++)
        if (im->nc != 4 || k % 4 != 3)
            im->px[k] = (float)srgb_decode((double)im->px[k]);
    meta_set_num(&im->meta, "nacre.encoded", 0);
    if (path)
        log_note("%s: 8-bit samples taken as sRGB and made linear", path);
}

static bool by_record(struct image *im, const char *path, const char *record, struct err *e)
{
    struct response r;
    struct record rec, now;
    double encoded = 0;
    record_init(&now, "response", "", NAN, "");
    record_from_image(&now, im);
    now.w = now.h = 0; // a curve holds at any resolution, through any lens
    now.aperture = now.focus_per_m = now.distance_m = NAN;
    *now.lens = 0;
    if (!response_read(&r, &rec, record, e) || !record_fits(&rec, record, &now, e))
        return false;
    if (!meta_num(&im->meta, "nacre.encoded", &encoded) || !(encoded > 0))
        return err_set(e, ERR_DATA, "%s: not of 8 bits: a response record does not apply", path);
    if (r.nc != im->nc)
        return err_set(e, ERR_DATA, "%s: %d channels, the record %s has %d", path, im->nc, record,
                       r.nc);
    const double scale = srgb_decode(RESPONSE_MIDDLE / 255.0); // the record's X is 1 there
    const size_t n = (size_t)im->w * (size_t)im->h * (size_t)im->nc;
    for (size_t k = 0; k < n; k++) {
        const int code = (int)lround(255 * fmin(1, fmax(0, (double)im->px[k])));
        im->px[k] = (float)(scale * exp(r.log_x[k % (size_t)im->nc][code]));
    }
    meta_set_num(&im->meta, "nacre.encoded", 0);
    return true;
}

bool make_linear_by(struct image *im, const char *path, const char *response, struct err *e)
{
    if (!response || !strcmp(response, "auto"))
        make_linear(im, path);
    else if (!strcmp(response, "srgb"))
        make_linear(im, NULL);
    else if (!strcmp(response, "linear"))
        meta_set_num(&im->meta, "nacre.encoded", 0);
    else
        return by_record(im, path, response, e);
    return true;
}
