// png.c - PNG by libpng.
#include "core/mem.h"
#include "core/raster.h"
#include <png.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

struct bytes {
    const uint8_t *at;
    size_t left;
};

static void take(png_structp png, png_bytep to, size_t n)
{
    struct bytes *b = png_get_io_ptr(png);
    if (n > b->left)
        png_error(png, "cut short");
    memcpy(to, b->at, n);
    b->at += n;
    b->left -= n;
}

static void quiet(png_structp png, png_const_charp text)
{
    (void)png;
    (void)text;
}

static _Noreturn void give_up(png_structp png, png_const_charp text)
{
    (void)text;
    png_longjmp(png, 1);
}

// Palettes become colours, grey with alpha becomes colour with alpha; 16 bits in our byte order.
static bool read_rows(png_structp png, png_infop info, struct image *im, uint8_t **rows,
                      struct err *e)
{
    png_read_info(png, info);
    const int kind = png_get_color_type(png, info);
    png_set_expand(png);
    png_set_interlace_handling(png);
    if (kind == PNG_COLOR_TYPE_GRAY_ALPHA ||
        (kind == PNG_COLOR_TYPE_GRAY && png_get_valid(png, info, PNG_INFO_tRNS)))
        png_set_gray_to_rgb(png);
    if (png_get_bit_depth(png, info) == 16)
        png_set_swap(png);
    png_read_update_info(png, info);
    const int w = (int)png_get_image_width(png, info), h = (int)png_get_image_height(png, info),
              nc = png_get_channels(png, info), sample_bytes = png_get_bit_depth(png, info) / 8;
    const size_t row = png_get_rowbytes(png, info);
    if (!image_init(im, w, h, nc, e) || !(*rows = sample_alloc((size_t)h, row, "a PNG", e)))
        return false;
    for (int pass = png_get_interlace_type(png, info) == PNG_INTERLACE_ADAM7 ? 7 : 1; pass > 0;
         pass--)
        for (int j = 0; j < h; j++)
            png_read_row(png, *rows + (size_t)j * row, NULL);
    png_read_end(png, NULL); // its checksum
    const size_t n = (size_t)w * (size_t)nc;
    for (int j = 0; j < h; j++)
        raster_row(im->px + (size_t)j * n, *rows + (size_t)j * row, n, sample_bytes);
    meta_set_num(&im->meta, "nacre.encoded", sample_bytes == 1);
    return true;
}

bool png_decode(struct image *im, const uint8_t *data, size_t n, struct err *e)
{
    struct bytes b = {data, n};
    uint8_t *rows[1] = {NULL};
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, NULL, give_up, quiet);
    png_infop info = png ? png_create_info_struct(png) : NULL;
    volatile bool ok = false;
    if (!info)
        err_set(e, ERR_FILE, "no memory for a PNG");
    else if (setjmp(png_jmpbuf(png)))
        ok = raster_damaged(e);
    else {
        png_set_user_limits(png, IMAGE_MAX_SIDE, IMAGE_MAX_SIDE);
        png_set_crc_action(png, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
        png_set_read_fn(png, &b, take);
        ok = read_rows(png, info, im, rows, e);
    }
    free(*rows);
    png_destroy_read_struct(&png, &info, NULL);
    return ok;
}

bool png_encode(const struct raster *r, FILE *f)
{
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, give_up, quiet);
    png_infop info = png ? png_create_info_struct(png) : NULL;
    volatile bool ok = false;
    if (info && !setjmp(png_jmpbuf(png))) {
        png_init_io(png, f);
        png_set_IHDR(png, info, (png_uint_32)r->w, (png_uint_32)r->h, 8 * r->sample_bytes,
                     r->nc == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                     PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
        png_write_info(png, info);
        if (r->sample_bytes == 2)
            png_set_swap(png);
        const size_t row = (size_t)r->w * (size_t)(r->nc * r->sample_bytes);
        for (int j = 0; j < r->h; j++)
            png_write_row(png, (const uint8_t *)r->px + (size_t)j * row);
        png_write_end(png, NULL);
        ok = true;
    }
    png_destroy_write_struct(&png, &info);
    return ok;
}
