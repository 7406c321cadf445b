// dng.c - DNG by libtiff, on a buffer in memory.
#define _GNU_SOURCE
#include "core/dng.h"
#include "core/mem.h"
#include "core/tiff_buffer.h"
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum { DNG_LINEAR_RAW = 34892, DNG_D65 = 21 }; // DNG 1.4, PhotometricInterpretation; EXIF light

static bool set_image(TIFF *t, const struct dng *d)
{
    return TIFFSetField(t, TIFFTAG_SUBFILETYPE, 0) &&
           TIFFSetField(t, TIFFTAG_IMAGEWIDTH, (uint32_t)d->w) &&
           TIFFSetField(t, TIFFTAG_IMAGELENGTH, (uint32_t)d->h) &&
           TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, 16) &&
           TIFFSetField(t, TIFFTAG_SAMPLESPERPIXEL, 1) &&
           TIFFSetField(t, TIFFTAG_ROWSPERSTRIP, (uint32_t)d->h) &&
           TIFFSetField(t, TIFFTAG_COMPRESSION, COMPRESSION_NONE) &&
           TIFFSetField(t, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) &&
           TIFFSetField(t, TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT) &&
           TIFFSetField(t, TIFFTAG_PHOTOMETRIC,
                        d->pattern == DNG_MONO ? DNG_LINEAR_RAW : PHOTOMETRIC_CFA);
}

static bool set_mosaic(TIFF *t, enum dng_pattern pattern)
{
    static const unsigned char cells[][4] = {
        [DNG_RGGB] = {0, 1, 1, 2},
        [DNG_GRBG] = {1, 0, 2, 1},
        [DNG_GBRG] = {1, 2, 0, 1},
        [DNG_BGGR] = {2, 1, 1, 0},
    };
    static const uint16_t dim[2] = {2, 2};
    // XYZ to linear sRGB: a rendering default for viewers; measured colour does not come from it.
    static const float matrix[9] = {3.2406F, -1.5372F, -0.4986F, -0.9689F, 1.8758F,
                                    0.0415F, 0.0557F,  -0.2040F, 1.0570F};
    static const float neutral[3] = {1, 1, 1};
    return pattern == DNG_MONO || (TIFFSetField(t, TIFFTAG_CFAREPEATPATTERNDIM, dim) &&
                                   TIFFSetField(t, TIFFTAG_CFAPATTERN, 4, cells[pattern]) &&
                                   TIFFSetField(t, TIFFTAG_COLORMATRIX1, 9, matrix) &&
                                   TIFFSetField(t, TIFFTAG_ASSHOTNEUTRAL, 3, neutral) &&
                                   TIFFSetField(t, TIFFTAG_CALIBRATIONILLUMINANT1, DNG_D65));
}

static void utc_text(int64_t utc_s, char text[20])
{
    const time_t seconds = (time_t)utc_s;
    struct tm tm;
    if (!gmtime_r(&seconds, &tm) || !strftime(text, 20, "%Y:%m:%d %H:%M:%S", &tm))
        *text = 0;
}

static bool set_about(TIFF *t, const struct dng *d)
{
    static const unsigned char version[4] = {1, 4, 0, 0}, backward[4] = {1, 1, 0, 0};
    const float black = (float)d->black;
    const uint32_t white = (uint32_t)d->white;
    const char *camera = *d->camera ? d->camera : "nacre";
    char date[20] = "";
    if (d->utc_s)
        utc_text(d->utc_s, date);
    return TIFFSetField(t, TIFFTAG_DNGVERSION, version) &&
           TIFFSetField(t, TIFFTAG_DNGBACKWARDVERSION, backward) &&
           TIFFSetField(t, TIFFTAG_UNIQUECAMERAMODEL, camera) &&
           TIFFSetField(t, TIFFTAG_MAKE, "nacre") && TIFFSetField(t, TIFFTAG_MODEL, camera) &&
           TIFFSetField(t, TIFFTAG_SOFTWARE, "nacre " NACRE_VERSION) &&
           (!*date || TIFFSetField(t, TIFFTAG_DATETIME, date)) &&
           TIFFSetField(t, TIFFTAG_BLACKLEVEL, 1, &black) &&
           TIFFSetField(t, TIFFTAG_WHITELEVEL, 1, &white);
}

// EXIF lives in a directory of its own, which the first one points to.
static bool write_exif(TIFF *t, const struct dng *d)
{
    const uint16_t iso = (uint16_t)(d->gain > 0 && d->gain < 655 ? 100 * d->gain + 0.5 : 65535);
    char date[20] = "";
    uint64_t at = 0;
    if (d->utc_s)
        utc_text(d->utc_s, date);
    return TIFFWriteDirectory(t) && !TIFFCreateEXIFDirectory(t) &&
           (d->exposure_s <= 0 || TIFFSetField(t, EXIFTAG_EXPOSURETIME, d->exposure_s)) &&
           TIFFSetField(t, EXIFTAG_ISOSPEEDRATINGS, 1, &iso) &&
           (!*date || TIFFSetField(t, EXIFTAG_DATETIMEORIGINAL, date)) &&
           TIFFWriteCustomDirectory(t, &at) && TIFFSetDirectory(t, 0) &&
           TIFFSetField(t, TIFFTAG_EXIFIFD, at) && TIFFRewriteDirectory(t);
}

bool dng_encode(const struct dng *d, void **bytes, size_t *size, struct err *e)
{
    if (d->w < 1 || d->h < 1 || d->w > 65535 || d->h > 65535 || d->white < 1 || d->white > 65535)
        return err_set(e, ERR_DATA, "cannot make a DNG of %d x %d with white %d", d->w, d->h,
                       d->white);
    const size_t samples = (size_t)d->w * (size_t)d->h * 2;
    struct tiff_buffer b = {.room = samples + 4096};
    b.at = sample_alloc(b.room, 1, "a DNG", e);
    if (!b.at)
        return false;
    TIFF *t = tiff_buffer_open(&b, "wl");
    bool ok = t && set_image(t, d) && set_mosaic(t, d->pattern) && set_about(t, d) &&
              TIFFWriteRawStrip(t, 0, d->raw, (tsize_t)samples) == (tsize_t)samples &&
              write_exif(t, d);
    if (t)
        TIFFClose(t);
    if (!ok) {
        free(b.at);
        return err_set(e, ERR_FILE, "cannot make a DNG of %d x %d: no memory", d->w, d->h);
    }
    *bytes = b.at;
    *size = b.size;
    return true;
}

static bool get_mosaic(TIFF *t, uint16_t photometric, enum dng_pattern *pattern)
{
    uint16_t n;
    const unsigned char *cell;
    *pattern = DNG_MONO;
    if (photometric == DNG_LINEAR_RAW)
        return true;
    if (photometric != PHOTOMETRIC_CFA || !TIFFGetField(t, TIFFTAG_CFAPATTERN, &n, &cell) || n != 4)
        return false;
    *pattern = cell[0] == 0   ? DNG_RGGB
               : cell[0] == 2 ? DNG_BGGR
               : cell[1] == 0 ? DNG_GRBG
                              : DNG_GBRG;
    return true;
}

static void get_about(TIFF *t, struct dng *d)
{
    uint16_t n, *iso;
    float *black;
    uint32_t *white;
    char *text;
    uint64_t exif;
    if (TIFFGetField(t, TIFFTAG_BLACKLEVEL, &n, &black) && n)
        d->black = (double)black[0];
    d->white = TIFFGetField(t, TIFFTAG_WHITELEVEL, &n, &white) && n ? (int)white[0] : 65535;
    if (TIFFGetField(t, TIFFTAG_UNIQUECAMERAMODEL, &text))
        snprintf(d->camera, sizeof d->camera, "%s", text);
    struct tm tm = {0};
    if (TIFFGetField(t, TIFFTAG_DATETIME, &text) && strptime(text, "%Y:%m:%d %H:%M:%S", &tm))
        d->utc_s = timegm(&tm);
    d->gain = 1;
    if (TIFFGetField(t, TIFFTAG_EXIFIFD, &exif) && TIFFReadEXIFDirectory(t, exif)) {
        union {
            float f;
            double d;
        } seconds;
        const TIFFField *field = TIFFFieldWithTag(t, EXIFTAG_EXPOSURETIME);
        if (TIFFGetField(t, EXIFTAG_EXPOSURETIME, &seconds)) // a float or a double, by version
            d->exposure_s = TIFFFieldSetGetSize(field) == 4 ? (double)seconds.f : seconds.d;
        if (TIFFGetField(t, EXIFTAG_ISOSPEEDRATINGS, &n, &iso) && n)
            d->gain = iso[0] / 100.0;
    }
}

static bool decode(struct dng *d, struct tiff_buffer *b, const char *path, struct err *e)
{
    TIFF *t = tiff_buffer_open(b, "rc"); // c: strips as they are in the file
    if (!t)
        return err_set(e, ERR_DATA, "%s: not a DNG", path);
    uint32_t w = 0, h = 0;
    uint16_t bits = 0, samples = 1, photometric = 0, compression = 0;
    struct dng got = {0};
    TIFFGetField(t, TIFFTAG_IMAGEWIDTH, &w);
    TIFFGetField(t, TIFFTAG_IMAGELENGTH, &h);
    TIFFGetField(t, TIFFTAG_BITSPERSAMPLE, &bits);
    TIFFGetField(t, TIFFTAG_SAMPLESPERPIXEL, &samples);
    TIFFGetField(t, TIFFTAG_PHOTOMETRIC, &photometric);
    TIFFGetField(t, TIFFTAG_COMPRESSION, &compression);
    bool ok = w && h && w <= 65535 && h <= 65535 && bits == 16 && samples == 1 &&
              compression == COMPRESSION_NONE && TIFFNumberOfStrips(t) == 1 &&
              get_mosaic(t, photometric, &got.pattern);
    const size_t size = (size_t)w * h * 2;
    if (!ok)
        err_set(e, ERR_DATA, "%s: not a DNG that nacre wrote (16 bit, one sample, one strip)",
                path);
    else if (size > b->size)
        ok = err_set(e, ERR_DATA, "%s: cut short", path);
    ok = ok && (got.raw = sample_alloc(size / 2, 2, path, e));
    if (ok && TIFFReadRawStrip(t, 0, got.raw, (tsize_t)size) != (tsize_t)size)
        ok = err_set(e, ERR_DATA, "%s: cut short", path);
    if (ok) {
        got.w = (int)w;
        got.h = (int)h;
        get_about(t, &got);
        *d = got;
    } else {
        free(got.raw);
    }
    TIFFClose(t);
    return ok;
}

bool dng_read(struct dng *d, const char *path, struct err *e)
{
    const int fd = open(path, O_RDONLY | O_CLOEXEC);
    struct stat st;
    if (fd < 0 || fstat(fd, &st)) {
        err_errno(e, "%s", path);
        if (fd >= 0)
            close(fd);
        return false;
    }
    struct tiff_buffer b = {.size = (size_t)st.st_size, .fixed = true};
    void *at = b.size ? mmap(NULL, b.size, PROT_READ, MAP_PRIVATE, fd, 0) : MAP_FAILED;
    close(fd);
    if (at == MAP_FAILED)
        return err_set(e, ERR_DATA, "%s: not a DNG", path);
    b.at = at;
    const bool ok = decode(d, &b, path, e);
    munmap(at, b.size);
    return ok;
}

void dng_finish(struct dng *d)
{
    free(d->raw);
    *d = (struct dng){0};
}
