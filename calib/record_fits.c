// record_fits.c - does a record hold for what it is used on? The one place that refuses it.
#define _GNU_SOURCE
#include "calib/record.h"
#include <math.h>
#include <string.h>
#include <time.h>

static bool same_text(const char *path, const char *what, const char *a, const char *b,
                      struct err *e)
{
    return !*a || !*b || !strcmp(a, b) ||
           err_set(e, ERR_DATA, "%s: made with %s '%s', but this is '%s'", path, what, a, b);
}

static bool same_number(const char *path, const char *what, double a, double b, struct err *e)
{
    return isnan(a) || isnan(b) || fabs(a - b) <= 0.01 * fmax(fabs(a), fabs(b)) ||
           err_set(e, ERR_DATA, "%s: made with %s %.4g, but this is %.4g", path, what, a, b);
}

// Days since 1970 of an ISO 8601 date, NAN where it is none.
static double days_of(const char *date)
{
    struct tm tm = {0};
    if (sscanf(date, "%4d-%2d-%2dT%2d:%2d:%2d", &tm.tm_year, &tm.tm_mon, &tm.tm_mday, &tm.tm_hour,
               &tm.tm_min, &tm.tm_sec) < 3)
        return NAN;
    tm.tm_year -= 1900;
    tm.tm_mon -= 1;
    return (double)timegm(&tm) / 86400;
}

static bool is_fresh(const struct record *r, const char *path, const struct record *now,
                     struct err *e)
{
    const double age = days_of(now->date) - days_of(r->date);
    return !(age > r->valid_days) ||
           err_set(e, ERR_DATA,
                   "%s: made on %.10s and valid for %g days, but this is of %.10s: calibrate again",
                   path, r->date, r->valid_days, now->date);
}

bool record_fits(const struct record *r, const char *path, const struct record *now, struct err *e)
{
    if (!same_text(path, "camera", r->device, now->device, e) ||
        !same_text(path, "lens", r->lens, now->lens, e) ||
        !same_number(path, "ISO", r->iso, now->iso, e) ||
        !same_number(path, "aperture f/", r->aperture, now->aperture, e) ||
        !same_number(path, "focus", r->focus_per_m, now->focus_per_m, e) ||
        !same_number(path, "distance", r->distance_m, now->distance_m, e))
        return false;
    if (r->w && now->w && (r->w != now->w || r->h != now->h))
        return err_set(e, ERR_DATA, "%s: made at %d x %d pixels, but this is %d x %d", path, r->w,
                       r->h, now->w, now->h);
    return is_fresh(r, path, now, e);
}

bool record_fits_image(const struct record *r, const char *path, const struct image *photo,
                       struct err *e)
{
    struct record now;
    record_init(&now, r->kind, "", NAN, "");
    record_from_image(&now, photo);
    return record_fits(r, path, &now, e);
}

bool record_image_fits(const struct image *made, const char *path, const char *kind,
                       const struct image *photo, struct err *e)
{
    struct record r;
    if (!meta_text(&made->meta, "nacre.calib.kind"))
        return true;
    return record_from_meta(&r, &made->meta, path, kind, e) &&
           record_fits_image(&r, path, photo, e);
}
