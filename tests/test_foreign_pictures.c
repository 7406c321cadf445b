// test_foreign_pictures.c - TIFF and PNG as other programs lay them out.
#include "tests/test.h"

#include "core/imgfile.h"
#include "tests/run.h"
#include <png.h>
#include <tiffio.h>

enum { W = 37, H = 23 };

// What is written: value of channel c at (i, j), in steps of 1 / (2^bits - 1).
static unsigned step_at(int i, int j, int c, int bits)
{
    const unsigned v = (unsigned)(i * 131 + j * 977 + c * 4099);
    return v % (1U << bits);
}

struct kind {
    const char *mode;
    int bits, nc, planar, photometric, tile;
};

static void set_tags(TIFF *t, const struct kind *k)
{
    TIFFSetField(t, TIFFTAG_IMAGEWIDTH, W);
    TIFFSetField(t, TIFFTAG_IMAGELENGTH, H);
    TIFFSetField(t, TIFFTAG_SAMPLESPERPIXEL, k->nc);
    TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, k->bits);
    TIFFSetField(t, TIFFTAG_PLANARCONFIG, k->planar);
    TIFFSetField(t, TIFFTAG_PHOTOMETRIC, k->photometric);
    TIFFSetField(t, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
    if (k->bits == 32)
        TIFFSetField(t, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
    if (k->tile) {
        TIFFSetField(t, TIFFTAG_TILEWIDTH, k->tile);
        TIFFSetField(t, TIFFTAG_TILELENGTH, k->tile);
    } else {
        TIFFSetField(t, TIFFTAG_ROWSPERSTRIP, 5); // the last strip is shorter
    }
}

static void put_sample(void *at, int k, unsigned step, int bits)
{
    if (bits == 8)
        ((uint8_t *)at)[k] = (uint8_t)step;
    else if (bits == 16)
        ((uint16_t *)at)[k] = (uint16_t)step;
    else
        ((float *)at)[k] = (float)step * 0.5F - 3;
}

// Tile by tile or strip by strip, as libtiff takes them.
static void write_tiff(const char *path, const struct kind *k)
{
    TIFF *t = TIFFOpen(path, k->mode);
    assert_non_null(t);
    set_tags(t, k);
    const int nc = k->planar == PLANARCONFIG_SEPARATE ? 1 : k->nc, w = k->tile ? k->tile : W,
              h = k->tile ? k->tile : 5, bytes = w * h * nc * k->bits / 8;
    const int step_bits = k->bits == 32 ? 16 : k->bits;
    uint8_t *block = malloc((size_t)bytes);
    uint32_t n = 0;
    for (int c0 = 0; c0 < k->nc; c0 += nc)
        for (int j0 = 0; j0 < H; j0 += h)
            for (int i0 = 0; i0 < W; i0 += w, n++) {
                for (int p = 0; p < w * h * nc; p++)
                    put_sample(block, p,
                               step_at(i0 + p / nc % w, j0 + p / nc / w, c0 + p % nc, step_bits),
                               k->bits);
                const int rows = k->tile || H - j0 > h ? h : H - j0;
                assert_true(k->tile ? TIFFWriteEncodedTile(t, n, block, bytes) > 0
                                    : TIFFWriteEncodedStrip(t, n, block, bytes / h * rows) > 0);
            }
    free(block);
    TIFFClose(t);
}

TEST(tiff_reads_alike_however_it_is_laid_out)
{
    enter_scratch("foreign_tiff");
    static const struct kind kinds[] = {
        {"wl", 8, 3, PLANARCONFIG_CONTIG, PHOTOMETRIC_RGB, 0},
        {"wb", 16, 3, PLANARCONFIG_CONTIG, PHOTOMETRIC_RGB, 0},
        {"wl", 16, 3, PLANARCONFIG_SEPARATE, PHOTOMETRIC_RGB, 0},
        {"wb", 16, 3, PLANARCONFIG_SEPARATE, PHOTOMETRIC_RGB, 16},
        {"wl", 16, 1, PLANARCONFIG_CONTIG, PHOTOMETRIC_MINISBLACK, 16},
        {"wl", 8, 1, PLANARCONFIG_CONTIG, PHOTOMETRIC_MINISWHITE, 0},
        {"wl", 32, 1, PLANARCONFIG_CONTIG, PHOTOMETRIC_MINISBLACK, 32},
        {"wb", 32, 3, PLANARCONFIG_CONTIG, PHOTOMETRIC_RGB, 0},
        {"wl", 8, 4, PLANARCONFIG_CONTIG, PHOTOMETRIC_RGB, 16},
    };
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        const struct kind *is = &kinds[k];
        struct image im;
        struct err e = {0};
        write_tiff("a.tif", is);
        if (!image_read(&im, "a.tif", &e))
            fail_msg("layout %zu: %s", k, e.msg);
        assert_int_equal(im.w, W);
        assert_int_equal(im.h, H);
        assert_int_equal(im.nc, is->nc);
        for (int p = 0; p < W * H * is->nc; p++) {
            const unsigned step =
                step_at(p / is->nc % W, p / is->nc / W, p % is->nc, is->bits == 32 ? 16 : is->bits);
            const double v =
                is->bits == 32 ? step * 0.5 - 3 : step / (is->bits == 8 ? 255. : 65535);
            assert_near(im.px[p], is->photometric == PHOTOMETRIC_MINISWHITE ? 1 - v : v,
                        is->bits == 32 ? 0 : 1e-7);
        }
        image_finish(&im);
    }
}

TEST(a_tiff_of_other_samples_is_refused)
{
    enter_scratch("foreign_tiff_not");
    static const struct {
        struct kind kind;
        const char *says;
    } cases[] = {
        {{"wl", 16, 2, PLANARCONFIG_CONTIG, PHOTOMETRIC_MINISBLACK, 0},
         "a.tif: 2 channels: must be 1, 3 or 4"},
        {{"w8", 16, 1, PLANARCONFIG_CONTIG, PHOTOMETRIC_MINISBLACK, 0},
         "a.tif: not a PNG, JPEG or TIFF picture"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct image im;
        struct err e = {0};
        write_tiff("a.tif", &cases[k].kind);
        assert_false(image_read(&im, "a.tif", &e));
        assert_string_equal(e.msg, cases[k].says);
        assert_int_equal(e.code, ERR_DATA);
    }
}

TEST(a_palette_is_read_as_colours)
{
    enter_scratch("foreign_palette");
    uint16_t map[3][256];
    uint8_t row[W];
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < 256; k++)
            map[c][k] = (uint16_t)((c == 1 ? 255 - k : k) * 257);
    TIFF *t = TIFFOpen("a.tif", "wl");
    set_tags(t, &(struct kind){"wl", 8, 1, PLANARCONFIG_CONTIG, PHOTOMETRIC_PALETTE, 0});
    TIFFSetField(t, TIFFTAG_COLORMAP, map[0], map[1], map[2]);
    for (int j = 0; j < H; j++) {
        for (int i = 0; i < W; i++)
            row[i] = (uint8_t)step_at(i, j, 0, 8);
        TIFFWriteScanline(t, row, (uint32_t)j, 0);
    }
    TIFFClose(t);
    struct image im;
    struct err e = {0};
    if (!image_read(&im, "a.tif", &e))
        fail_msg("%s", e.msg);
    assert_int_equal(im.nc, 3);
    for (int p = 0; p < W * H; p++) {
        const unsigned v = step_at(p % W, p / W, 0, 8);
        assert_near(im.px[3 * p] * 255, v, 1e-4);
        assert_near(im.px[3 * p + 1] * 255, 255 - v, 1e-4);
    }
    image_finish(&im);
}

TEST(an_interlaced_png_is_read)
{
    enter_scratch("foreign_png");
    FILE *f = fopen("a.png", "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    uint8_t px[H][W * 3 * 2];
    png_bytep rows[H];
    png_init_io(png, f);
    png_set_IHDR(png, info, W, H, 16, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_ADAM7, 0, 0);
    png_write_info(png, info);
    for (int j = 0; j < H; j++) {
        rows[j] = px[j];
        for (int i = 0; i < W * 3; i++) {
            px[j][2 * i] = (uint8_t)(step_at(i / 3, j, i % 3, 16) >> 8);
            px[j][2 * i + 1] = (uint8_t)step_at(i / 3, j, i % 3, 16);
        }
    }
    png_write_image(png, rows);
    png_write_end(png, NULL);
    png_destroy_write_struct(&png, &info);
    fclose(f);
    struct image im;
    struct err e = {0};
    if (!image_read(&im, "a.png", &e))
        fail_msg("%s", e.msg);
    for (int p = 0; p < W * H * 3; p++)
        assert_near(im.px[p] * 65535, step_at(p / 3 % W, p / 3 / W, p % 3, 16), 0.01);
    image_finish(&im);
}

TEST_MAIN(cmocka_unit_test(tiff_reads_alike_however_it_is_laid_out),
          cmocka_unit_test(a_tiff_of_other_samples_is_refused),
          cmocka_unit_test(a_palette_is_read_as_colours),
          cmocka_unit_test(an_interlaced_png_is_read))
