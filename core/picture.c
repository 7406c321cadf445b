// picture.c - PNG, JPEG and TIFF: judged here, decoded by the library of each.
//
// Decoders take memory by the header's word and fill the missing half of a cut JPEG with grey, so
// what the file is, its size and its end are looked at before one of them is asked.
#define _GNU_SOURCE
#include "core/codec.h"
#include "core/imgfile.h"
#include "core/infile.h"
#include "core/mem.h"
#include "core/raster.h"
#include "core/spectrum.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct bytes {
    const unsigned char *at;
    size_t n;
    bool big; // byte order of u16 and u32
};

static unsigned u16(const struct bytes *b, size_t at)
{
    const unsigned char *p = b->at + at;
    return b->big ? (unsigned)p[0] << 8 | p[1] : (unsigned)p[1] << 8 | p[0];
}

static unsigned u32(const struct bytes *b, size_t at)
{
    return b->big ? u16(b, at) << 16 | u16(b, at + 2) : u16(b, at + 2) << 16 | u16(b, at);
}

struct shape {
    double w, h, nc;
    bool is_whole;
};

// Chunks up to IEND: length, type, data, CRC.
static bool png_shape(struct bytes b, struct shape *s)
{
    b.big = true;
    if (b.n < 33 || memcmp(b.at + 12, "IHDR", 4))
        return false;
    *s = (struct shape){u32(&b, 16), u32(&b, 20), (b.at[25] & 2 ? 3 : 1) + (b.at[25] >> 2 & 1)};
    size_t at = 8;
    while (!s->is_whole && b.n - at >= 12) {
        const size_t len = u32(&b, at);
        if (len > b.n - at - 12)
            break;
        s->is_whole = !memcmp(b.at + at + 4, "IEND", 4);
        at += len + 12;
    }
    return true;
}

// Segments up to the end marker; behind a start of scan come coded bytes without markers.
static bool jpeg_shape(struct bytes b, struct shape *s)
{
    b.big = true;
    *s = (struct shape){0};
    size_t at = 2;
    while (at + 4 <= b.n || (at + 2 <= b.n && b.at[at + 1] == 0xd9)) {
        if (b.at[at] != 0xff)
            return s->w > 0;
        const unsigned marker = b.at[at + 1];
        s->is_whole = marker == 0xd9;
        if (s->is_whole)
            break;
        if (marker == 0xff) { // padding
            at++;
            continue;
        }
        const size_t len = u16(&b, at + 2);
        const bool is_frame =
            marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
        if (is_frame && at + 10 <= b.n)
            *s = (struct shape){u16(&b, at + 7), u16(&b, at + 5), b.at[at + 9]};
        at += 2 + len;
        if (marker == 0xda) // coded bytes: ff 00 is data, ff d0..d7 are restarts
            while (at + 1 < b.n && !(b.at[at] == 0xff && b.at[at + 1] &&
                                     (b.at[at + 1] < 0xd0 || b.at[at + 1] > 0xd7)))
                at++;
    }
    return s->w > 0;
}

// The first directory's ImageWidth (256), ImageLength (257) and SamplesPerPixel (277).
static bool tiff_shape(struct bytes b, struct shape *s)
{
    b.big = b.at[0] == 'M';
    if (b.n < 8 || u16(&b, 2) != 42)
        return false;
    const size_t dir = u32(&b, 4);
    *s = (struct shape){.nc = 1};
    if (dir > b.n || b.n - dir < 2)
        return true; // cut short
    const size_t count = u16(&b, dir);
    s->is_whole = b.n - dir >= 2 + 12 * count;
    for (size_t k = 0; k < count && s->is_whole; k++) {
        const size_t at = dir + 2 + 12 * k;
        const unsigned tag = u16(&b, at);
        const double value = u16(&b, at + 2) == 3 ? u16(&b, at + 8) : u32(&b, at + 8);
        double *to = tag == 256 ? &s->w : tag == 257 ? &s->h : tag == 277 ? &s->nc : NULL;
        if (to)
            *to = value;
    }
    return true;
}

static bool decode(struct image *im, struct bytes b, struct err *e)
{
    static const struct {
        const char *name, *magic;
        size_t len;
        bool (*shape)(struct bytes b, struct shape *s);
        bool (*decode)(struct image *im, const uint8_t *data, size_t n, struct err *e);
    } kinds[] = {
        {"PNG", "\x89PNG\r\n\x1a\n", 8, png_shape, png_decode},
        {"JPEG", "\xff\xd8\xff", 3, jpeg_shape, jpeg_decode},
        {"TIFF", "II*\0", 4, tiff_shape, tiff_decode},
        {"TIFF", "MM\0*", 4, tiff_shape, tiff_decode},
    };
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        struct shape s;
        if (b.n < kinds[k].len || memcmp(b.at, kinds[k].magic, kinds[k].len))
            continue;
        if (!kinds[k].shape(b, &s) || !s.is_whole)
            return err_set(e, ERR_DATA, "damaged or cut short: this %s picture has no end",
                           kinds[k].name);
        if (!(s.w >= 1 && s.h >= 1 && s.w <= IMAGE_MAX_SIDE && s.h <= IMAGE_MAX_SIDE))
            return err_set(e, ERR_DATA, "bad size %.0f x %.0f: each side must be 1 to %d pixels",
                           s.w, s.h, IMAGE_MAX_SIDE);
        return infile_claim((int64_t)b.n, s.w * s.h * s.nc, e) && kinds[k].decode(im, b.at, b.n, e);
    }
    return err_set(e, ERR_DATA, "not a PNG, JPEG or TIFF picture%s",
                   b.n ? "" : ": the file is empty");
}

bool picture_read(struct image *im, const char *path, struct err *e)
{
    size_t size = 0;
    char *data = infile_slurp(path, (int64_t)1 << 32, &size, e);
    if (!data)
        return false;
    const bool ok = decode(im, (struct bytes){(unsigned char *)data, size, false}, e);
    free(data);
    if (!ok)
        return false;
    meta_set_text(&im->meta, "channels", im->nc == 1 ? "Y" : im->nc == 3 ? "R,G,B" : "R,G,B,A");
    exif_read(&im->meta, path);
    return true;
}

void raster_row(float *to, const void *from, size_t n, int sample_bytes)
{
    for (size_t k = 0; k < n; k++)
        to[k] = sample_bytes == 1 ? ((const uint8_t *)from)[k] * (1 / 255.F)
                                  : ((const uint16_t *)from)[k] * (1 / 65535.F);
}

bool raster_damaged(struct err *e)
{
    return err_set(e, ERR_DATA, "damaged or cut short: it cannot be decoded");
}

static bool encode(const struct raster *r, const char *path, struct err *e)
{
    const char *ext = path_ext(path);
    FILE *f = fopen(path, "wbe");
    if (!f)
        return err_errno(e, "cannot write");
    const bool is_png = !strcmp(ext, ".png"), is_tiff = !strncmp(ext, ".tif", 4);
    bool ok = is_png ? png_encode(r, f) : is_tiff ? tiff_encode(r, f) : jpeg_encode(r, f);
    ok = fclose(f) == 0 && ok;
    return ok || err_set(e, ERR_FILE, "cannot write");
}

// Which channels to show, as grey (1), as RGB or as XYZ (3).
static int shown(const struct image *im, int c[3], bool *is_xyz)
{
    static const char *const sets[][3] = {{"R", "G", "B"}, {"X", "Y", "Z"}};
    for (int s = 0; s < 2; s++) {
        for (int k = 0; k < 3; k++)
            c[k] = image_channel_index(im, sets[s][k]);
        *is_xyz = s == 1;
        if (c[0] >= 0 && c[1] >= 0 && c[2] >= 0)
            return 3;
    }
    *is_xyz = false;
    c[0] = im->nc == 1 ? 0 : image_channel_index(im, "Y");
    return c[0] >= 0 ? 1 : 0;
}

// px[h][w][nc] of 1 or 2 bytes; NaN is shown as 0.
static bool write_samples(const struct image *im, const char *path, int sample_bytes, struct err *e)
{
    int from[3];
    bool is_xyz;
    const int nc = shown(im, from, &is_xyz);
    if (!nc)
        return err_set(e, ERR_DATA,
                       "%d channels that are neither R,G,B nor X,Y,Z nor Y: write .exr", im->nc);
    const size_t n = (size_t)im->w * (size_t)im->h;
    void *out = sample_alloc(n * (size_t)nc, (size_t)sample_bytes, "picture", e);
    if (!out)
        return false;
    for (size_t k = 0; k < n; k++) {
        double v[3] = {0};
        for (int c = 0; c < nc; c++)
            v[c] = (double)im->px[k * (size_t)im->nc + (size_t)from[c]];
        if (is_xyz)
            xyz_to_rgb(v, v);
        for (int c = 0; c < nc; c++) {
            const size_t at = k * (size_t)nc + (size_t)c;
            const double x = v[c] > 0 ? fmin(v[c], 1) : 0;
            if (sample_bytes == 1)
                ((uint8_t *)out)[at] = (uint8_t)lround(255 * srgb_encode(x));
            else
                ((uint16_t *)out)[at] = (uint16_t)lround(65535 * x);
        }
    }
    const bool ok = encode(&(struct raster){out, im->w, im->h, nc, sample_bytes}, path, e);
    free(out);
    return ok;
}

bool display_write(const struct image *im, const char *path, struct err *e)
{
    return write_samples(im, path, 1, e);
}

bool linear16_write(const struct image *im, const char *path, struct err *e)
{
    return write_samples(im, path, 2, e);
}
