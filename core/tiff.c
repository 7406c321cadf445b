// tiff.c - TIFF pictures by libtiff.
#include "core/mem.h"
#include "core/raster.h"
#include "core/tiff_buffer.h"
#include <stdlib.h>
#include <string.h>

struct layout {
    uint32_t w, h;
    uint32_t block_w, block_h; // a tile, or a strip
    uint16_t nc, bits, format, photometric, planar;
};

static void get_layout(TIFF *t, struct layout *l)
{
    *l = (struct layout){0};
    TIFFGetField(t, TIFFTAG_IMAGEWIDTH, &l->w);
    TIFFGetField(t, TIFFTAG_IMAGELENGTH, &l->h);
    TIFFGetFieldDefaulted(t, TIFFTAG_SAMPLESPERPIXEL, &l->nc);
    TIFFGetFieldDefaulted(t, TIFFTAG_BITSPERSAMPLE, &l->bits);
    TIFFGetFieldDefaulted(t, TIFFTAG_SAMPLEFORMAT, &l->format);
    TIFFGetFieldDefaulted(t, TIFFTAG_PLANARCONFIG, &l->planar);
    TIFFGetField(t, TIFFTAG_PHOTOMETRIC, &l->photometric);
    l->block_w = l->w;
    if (TIFFIsTiled(t)) {
        TIFFGetField(t, TIFFTAG_TILEWIDTH, &l->block_w);
        TIFFGetField(t, TIFFTAG_TILELENGTH, &l->block_h);
    } else {
        TIFFGetFieldDefaulted(t, TIFFTAG_ROWSPERSTRIP, &l->block_h);
        l->block_h = l->block_h < l->h ? l->block_h : l->h;
    }
}

// Samples that are numbers as they stand: 8 or 16 bits or float, grey or RGB.
static bool is_plain(const struct layout *l)
{
    const bool is_number = l->format == SAMPLEFORMAT_IEEEFP
                               ? l->bits == 32
                               : l->format == SAMPLEFORMAT_UINT && (l->bits == 8 || l->bits == 16);
    return is_number &&
           (l->photometric == PHOTOMETRIC_MINISBLACK || l->photometric == PHOTOMETRIC_MINISWHITE ||
            l->photometric == PHOTOMETRIC_RGB);
}

// One block into its place; `nc` channels from channel c on stand in it.
static void put_block(struct image *im, const struct layout *l, const uint8_t *block, uint32_t i0,
                      uint32_t j0, int c, int nc, float *row)
{
    const uint32_t w = l->w - i0 < l->block_w ? l->w - i0 : l->block_w,
                   h = l->h - j0 < l->block_h ? l->h - j0 : l->block_h;
    const size_t n = (size_t)w * (size_t)nc, sample_bytes = l->bits / 8,
                 pitch = (size_t)l->block_w * (size_t)nc * sample_bytes;
    for (uint32_t j = 0; j < h; j++) {
        if (l->bits == 32)
            memcpy(row, block + j * pitch, n * 4);
        else
            raster_row(row, block + j * pitch, n, (int)sample_bytes);
        float *to = im->px + (((size_t)j0 + j) * l->w + i0) * l->nc + c;
        for (size_t k = 0; k < n; k++) {
            const float v = l->photometric == PHOTOMETRIC_MINISWHITE ? 1 - row[k] : row[k];
            to[k / (size_t)nc * l->nc + k % (size_t)nc] = v;
        }
    }
}

static bool read_plain(TIFF *t, const struct layout *l, struct image *im, struct err *e)
{
    const bool is_tiled = TIFFIsTiled(t);
    const int nc = l->planar == PLANARCONFIG_SEPARATE ? 1 : l->nc; // of a block
    const tmsize_t size = is_tiled ? TIFFTileSize(t) : TIFFStripSize(t);
    if (size <= 0 || !l->block_w || !l->block_h ||
        (size_t)size != (size_t)l->block_w * l->block_h * (size_t)nc * (l->bits / 8))
        return raster_damaged(e);
    uint8_t *block = sample_alloc((size_t)size, 1, "a TIFF", e);
    float *row = block ? sample_alloc((size_t)l->block_w * (size_t)nc, 4, "a TIFF", e) : NULL;
    bool ok = row && image_init(im, (int)l->w, (int)l->h, l->nc, e);
    uint32_t k = 0;
    for (int c = 0; ok && c < l->nc; c += nc)
        for (uint32_t j = 0; ok && j < l->h; j += l->block_h)
            for (uint32_t i = 0; ok && i < l->w; i += l->block_w, k++) {
                const uint32_t rows = l->h - j < l->block_h ? l->h - j : l->block_h;
                const tmsize_t want = is_tiled ? size : size / (tmsize_t)l->block_h * rows;
                const tmsize_t got = is_tiled ? TIFFReadEncodedTile(t, k, block, size)
                                              : TIFFReadEncodedStrip(t, k, block, want);
                ok = got == want || raster_damaged(e);
                if (ok)
                    put_block(im, l, block, i, j, c, nc, row);
            }
    free(row);
    free(block);
    meta_set_num(&im->meta, "nacre.encoded", l->bits == 8);
    return ok;
}

// Palettes, few bits, YCbCr: as libtiff shows them, in 8 bits.
static bool read_shown(TIFF *t, const struct layout *l, struct image *im, struct err *e)
{
    char why[1024];
    if (l->bits > 8 || !TIFFRGBAImageOK(t, why))
        return err_set(e, ERR_DATA, "samples must be 8 or 16 bit unsigned, or 32-bit float");
    uint32_t *px = sample_alloc((size_t)l->w * l->h, 4, "a TIFF", e);
    bool ok = px && image_init(im, (int)l->w, (int)l->h, 3, e);
    if (ok && !TIFFReadRGBAImageOriented(t, l->w, l->h, px, ORIENTATION_TOPLEFT, 1))
        ok = raster_damaged(e);
    for (size_t k = 0; ok && k < (size_t)l->w * l->h; k++)
        raster_row(im->px + 3 * k,
                   (uint8_t[]){(uint8_t)TIFFGetR(px[k]), (uint8_t)TIFFGetG(px[k]),
                               (uint8_t)TIFFGetB(px[k])},
                   3, 1);
    free(px);
    meta_set_num(&im->meta, "nacre.encoded", 1);
    return ok;
}

bool tiff_decode(struct image *im, const uint8_t *data, size_t n, struct err *e)
{
    struct tiff_buffer b = {.at = (uint8_t *)data, .size = n, .fixed = true};
    TIFF *t = tiff_buffer_open(&b, "r");
    if (!t)
        return raster_damaged(e);
    struct layout l;
    get_layout(t, &l);
    bool ok = true;
    if (l.nc != 1 && l.nc != 3 && l.nc != 4)
        ok = err_set(e, ERR_DATA, "%d channels: must be 1, 3 or 4", l.nc);
    ok = ok && (is_plain(&l) ? read_plain(t, &l, im, e) : read_shown(t, &l, im, e));
    TIFFClose(t);
    return ok;
}

bool tiff_encode(const struct raster *r, FILE *f)
{
    const tmsize_t row = (tmsize_t)r->w * r->nc * r->sample_bytes;
    struct tiff_buffer b = {0};
    TIFF *t = tiff_buffer_open(&b, "wl");
    bool ok = t && TIFFSetField(t, TIFFTAG_IMAGEWIDTH, (uint32_t)r->w) &&
              TIFFSetField(t, TIFFTAG_IMAGELENGTH, (uint32_t)r->h) &&
              TIFFSetField(t, TIFFTAG_SAMPLESPERPIXEL, r->nc) &&
              TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, 8 * r->sample_bytes) &&
              TIFFSetField(t, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) &&
              TIFFSetField(t, TIFFTAG_PHOTOMETRIC,
                           r->nc == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB) &&
              TIFFSetField(t, TIFFTAG_COMPRESSION, COMPRESSION_LZW) &&
              TIFFSetField(t, TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL) &&
              TIFFSetField(t, TIFFTAG_ROWSPERSTRIP, TIFFDefaultStripSize(t, 0));
    for (int j = 0; ok && j < r->h; j++)
        ok = TIFFWriteScanline(t, (uint8_t *)r->px + j * row, (uint32_t)j, 0) == 1;
    ok = ok && TIFFFlush(t);
    if (t)
        TIFFClose(t);
    ok = ok && fwrite(b.at, 1, b.size, f) == b.size;
    free(b.at);
    return ok;
}
