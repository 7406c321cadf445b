// exif.c - exposure data in JPEG files, through libexif.
#include "core/codec.h"
#include <libexif/exif-data.h>
#include <math.h>
#include <string.h>

static void take_number(struct meta *m, const char *key, ExifData *d, ExifTag tag)
{
    const ExifEntry *en = exif_content_get_entry(d->ifd[EXIF_IFD_EXIF], tag);
    if (!en || en->components < 1 || !en->data)
        return;
    const ExifByteOrder order = exif_data_get_byte_order(d);
    double v = NAN;
    if (en->format == EXIF_FORMAT_RATIONAL && en->size >= 8) {
        const ExifRational r = exif_get_rational(en->data, order);
        v = (double)r.numerator / (double)r.denominator;
    } else if (en->format == EXIF_FORMAT_SHORT && en->size >= 2) {
        v = exif_get_short(en->data, order);
    } else if (en->format == EXIF_FORMAT_LONG && en->size >= 4) {
        v = exif_get_long(en->data, order);
    }
    if (v > 0 && isfinite(v))
        meta_set_num(m, key, v);
}

static void take_text(struct meta *m, const char *key, ExifData *d, ExifIfd ifd, ExifTag tag)
{
    const ExifEntry *en = exif_content_get_entry(d->ifd[ifd], tag);
    if (!en || en->format != EXIF_FORMAT_ASCII || !en->data || !en->size)
        return;
    char text[256];
    const size_t n = en->size < sizeof text ? en->size : sizeof text - 1;
    memcpy(text, en->data, n);
    text[n] = 0;
    if (*text)
        meta_set_text(m, key, text);
}

void exif_read(struct meta *m, const char *path)
{
    ExifData *d = exif_data_new_from_file(path);
    if (!d)
        return;
    take_number(m, "expTime", d, EXIF_TAG_EXPOSURE_TIME);
    take_number(m, "isoSpeed", d, EXIF_TAG_ISO_SPEED_RATINGS);
    take_number(m, "aperture", d, EXIF_TAG_FNUMBER);
    take_text(m, "capDate", d, EXIF_IFD_EXIF, EXIF_TAG_DATE_TIME_ORIGINAL);
    take_text(m, "cameraModel", d, EXIF_IFD_0, EXIF_TAG_MODEL);
    exif_data_unref(d);
}
