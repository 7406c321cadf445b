// test_foreign_files.c - pictures and heights that other programs write, in the variants that the
// formats allow. The half-float EXR files come from OpenEXR's older C++ library, which shares no
// code with the C one that nacre reads with.
#include "core/codec.h"
#include "core/dng.h"
#include "core/hfield_file.h"
#include "core/imgfile.h"
#include "core/mem.h"
#include "core/outfile.h"
#include "core/sha256.h"
#include "tests/test.h"
#include <ImfCRgbaFile.h>
#include <openexr.h>
#include <zip.h>

enum { W = 45, H = 38 };

static void put(const char *path, const void *data, size_t size)
{
    struct err e = {0};
    if (!outfile_write(path, data, size, &e))
        fail_msg("%s", e.msg);
}

static struct image get(const char *path)
{
    struct image im = {0};
    struct err e = {0};
    if (!image_read(&im, path, &e))
        fail_msg("%s", e.msg);
    unlink(path);
    return im;
}

// A smooth ramp whose values are exact as half floats.
static float ramp(int i, int j, int c)
{
    return (float)(i + 2 * j) / 64 + (float)c;
}

static void fill_half(ImfRgba px[][W])
{
    for (int j = 0; j < H; j++)
        for (int i = 0; i < W; i++) {
            ImfFloatToHalf(ramp(i, j, 0), &px[j][i].r);
            ImfFloatToHalf(ramp(i, j, 1), &px[j][i].g);
            ImfFloatToHalf(ramp(i, j, 2), &px[j][i].b);
            ImfFloatToHalf(ramp(i, j, 3), &px[j][i].a);
        }
}

static void assert_ramp(const struct image *im, int nc, double tolerance)
{
    assert_int_equal(im->w, W);
    assert_int_equal(im->h, H);
    assert_int_equal(im->nc, nc);
    for (int j = 0; j < H; j++)
        for (int i = 0; i < W; i++)
            for (int c = 0; c < nc; c++)
                assert_near(im->px[(j * W + i) * nc + c], ramp(i, j, c), tolerance);
}

TEST(half_scanlines_read_in_every_compression_and_window)
{
    // The library places pixel (0, 0) at `canvas`; the data window begins at (-5, 7) of it.
    static ImfRgba canvas[H + 8][W];
    ImfRgba(*px)[W] = (ImfRgba(*)[W])(&canvas[7][0] - 5);
    fill_half(px);
    for (int compression = IMF_NO_COMPRESSION; compression <= IMF_DWAB_COMPRESSION; compression++) {
        const bool is_lossy = compression >= IMF_B44_COMPRESSION;
        ImfHeader *hdr = ImfNewHeader();
        ImfHeaderSetDisplayWindow(hdr, 0, 0, 99, 99);
        ImfHeaderSetDataWindow(hdr, -5, 7, W - 6, H + 6);
        ImfHeaderSetLineOrder(hdr, compression % 2 ? IMF_DECREASING_Y : IMF_INCREASING_Y);
        ImfHeaderSetCompression(hdr, compression);
        ImfHeaderSetStringAttribute(hdr, "owner", "someone");
        ImfHeaderSetFloatAttribute(hdr, "expTime", 0.125f);
        const int channels = compression % 3 ? IMF_WRITE_RGBA : IMF_WRITE_RGB;
        ImfOutputFile *f = ImfOpenOutputFile("foreign_a.exr", hdr, channels);
        assert_non_null(f);
        ImfOutputSetFrameBuffer(f, &canvas[0][0], 1, W);
        assert_true(ImfOutputWritePixels(f, H));
        ImfCloseOutputFile(f);
        ImfDeleteHeader(hdr);
        struct image im = {0};
        struct err e = {0};
        if (compression >= IMF_DWAA_COMPRESSION && !image_read(&im, "foreign_a.exr", &e)) {
            assert_string_equal(e.msg, "foreign_a.exr: the installed OpenEXR cannot decode its "
                                       "compression: use ZIP or PIZ");
            continue;
        }
        image_finish(&im);
        im = get("foreign_a.exr");
        assert_ramp(&im, channels == IMF_WRITE_RGBA ? 4 : 3, is_lossy ? 0.05 : 0);
        assert_string_equal(meta_text(&im.meta, "owner"), "someone");
        double t = 0;
        assert_true(meta_num(&im.meta, "expTime", &t) && t == 0.125);
        image_finish(&im);
    }
    unlink("foreign_a.exr");
}

TEST(half_tiles_with_smaller_levels_read)
{
    static ImfRgba px[H][W];
    fill_half(px);
    ImfHeader *hdr = ImfNewHeader();
    ImfHeaderSetDisplayWindow(hdr, 0, 0, W - 1, H - 1);
    ImfHeaderSetDataWindow(hdr, 0, 0, W - 1, H - 1);
    ImfHeaderSetCompression(hdr, IMF_ZIP_COMPRESSION);
    ImfTiledOutputFile *f = ImfOpenTiledOutputFile("foreign_b.exr", hdr, IMF_WRITE_RGBA, 16, 8,
                                                   IMF_MIPMAP_LEVELS, IMF_ROUND_DOWN);
    assert_non_null(f);
    ImfTiledOutputSetFrameBuffer(f, &px[0][0], 1, W);
    for (int level = 0, w = W, h = H; w && h; level++) {
        assert_true(
            ImfTiledOutputWriteTiles(f, 0, (w + 15) / 16 - 1, 0, (h + 7) / 8 - 1, level, level));
        if (w == 1 && h == 1)
            break;
        w = w > 1 ? w / 2 : 1;
        h = h > 1 ? h / 2 : 1;
    }
    ImfCloseTiledOutputFile(f);
    ImfDeleteHeader(hdr);
    struct image im = get("foreign_b.exr");
    assert_ramp(&im, 4, 0);
    image_finish(&im);
}

TEST(what_we_write_reads_elsewhere)
{
    struct image im;
    struct err e;
    assert_true(image_init(&im, W, H, 3, &e));
    for (int k = 0; k < W * H; k++)
        for (int c = 0; c < 3; c++)
            im.px[3 * k + c] = ramp(k % W, k / W, c);
    meta_set_num(&im.meta, "aperture", 8);
    meta_set_nums(&im.meta, "nacre.many", (double[]){1, 2, 3}, 3);
    assert_true(image_write(&im, "foreign_c.exr", &e));
    static ImfRgba px[H][W];
    ImfInputFile *f = ImfOpenInputFile("foreign_c.exr");
    assert_non_null(f);
    ImfInputSetFrameBuffer(f, &px[0][0], 1, W);
    assert_true(ImfInputReadPixels(f, 0, H - 1));
    float aperture = 0;
    assert_true(ImfHeaderFloatAttribute(ImfInputHeader(f), "aperture", &aperture));
    assert_near(aperture, 8, 0);
    ImfCloseInputFile(f);
    for (int k = 0; k < W * H; k++)
        assert_near(ImfHalfToFloat(px[k / W][k % W].g), ramp(k % W, k / W, 1), 0);
    image_finish(&im);
    unlink("foreign_c.exr");
}

// One part of 3 x 2 pixels with these channels, written by the C library.
static void write_channels(const char *path, const char *const names[], const int types[], int n,
                           int sampling)
{
    exr_context_t f;
    const exr_context_initializer_t set = EXR_DEFAULT_CONTEXT_INITIALIZER;
    int part;
    assert_int_equal(exr_start_write(&f, path, EXR_WRITE_FILE_DIRECTLY, &set), 0);
    exr_add_part(f, "left", EXR_STORAGE_SCANLINE, &part);
    exr_initialize_required_attr_simple(f, 0, 4, 2, EXR_COMPRESSION_NONE);
    for (int c = 0; c < n; c++)
        exr_add_channel(f, 0, names[c], types[c], EXR_PERCEPTUALLY_LINEAR, sampling, 1);
    assert_int_equal(exr_write_header(f), 0);
    for (int j = 0; j < 2; j++) {
        uint8_t row[4096] = {0};
        size_t size = 0;
        for (int c = 0; c < n; c++)
            for (int i = 0; i < 4 / sampling; i++) {
                const uint32_t word = (uint32_t)(70000 + 10 * c + 4 * j + i);
                const uint16_t half = (uint16_t)(0x3c00 + i); // 1 + i / 1024
                if (types[c] == EXR_PIXEL_HALF) {
                    memcpy(row + size, &half, 2);
                    size += 2;
                } else {
                    memcpy(row + size, &word, 4);
                    size += 4;
                }
            }
        assert_int_equal(exr_write_scanline_chunk(f, 0, j, row, size), 0);
    }
    assert_int_equal(exr_finish(&f), 0);
}

TEST(integer_and_mixed_channels_read_and_odd_ones_are_refused)
{
    static const char *const names[] = {"Z", "depth.id"}, *const comma[] = {"a,b"};
    static const int types[] = {EXR_PIXEL_HALF, EXR_PIXEL_UINT};
    write_channels("foreign_d.exr", names, types, 2, 1);
    struct image im = get("foreign_d.exr"), none = {0};
    struct err e;
    assert_string_equal(meta_text(&im.meta, "channels"), "Z,depth.id");
    for (int k = 0; k < 8; k++) {
        assert_near(im.px[2 * k], 1 + k % 4 / 1024.0, 0);
        assert_near(im.px[2 * k + 1], 70010 + k, 0);
    }
    image_finish(&im);
    write_channels("foreign_d.exr", names, types, 2, 2);
    assert_false(image_read(&none, "foreign_d.exr", &e));
    assert_string_equal(e.msg, "foreign_d.exr: channel Z is subsampled, which is not supported");
    write_channels("foreign_d.exr", comma, types, 1, 1);
    assert_false(image_read(&none, "foreign_d.exr", &e));
    assert_string_equal(e.msg, "foreign_d.exr: channel name 'a,b' holds a comma");
    unlink("foreign_d.exr");
}

TEST(a_big_endian_pfm_reads_with_its_last_row_first)
{
    static const char file[] = "Pf\r\n1 3\r\n1.0\r\n"
                               "\x3f\x80\0\0\x40\0\0\0\xc0\x40\0\0"; // 1, 2, -3 from the bottom up
    put("foreign_e.pfm", file, sizeof file - 1);
    struct image im = get("foreign_e.pfm");
    assert_near(im.px[0], -3, 0);
    assert_near(im.px[1], 2, 0);
    assert_near(im.px[2], 1, 0);
    image_finish(&im);
}

TEST(radiance_files_of_every_code_and_direction_read)
{
#define HEAD "#?RGBE\n# made by hand\nFORMAT=32-bit_rle_rgbe\n\n"
#define A "\x80\x40\x20\x81" // 1, 0.5, 0.25
#define B "\x80\x80\x80\x80" // 0.5 grey
    static const struct {
        const char *file;
        size_t size;
        int w, h;
        int grey; // the only pixel that is B, row by row
    } cases[] = {
#define CASE(size_line, data) HEAD size_line "\n" data, sizeof(HEAD size_line "\n" data) - 1
        {CASE("-Y 2 +X 3", A B A A A A), 3, 2, 1},
        {CASE("+Y 2 +X 3", A B A A A A), 3, 2, 4},
        {CASE("-Y 2 -X 3", B A A A A A), 3, 2, 2},
        {CASE("+X 3 -Y 2", A B A A A A), 3, 2, 3},
        {CASE("+X 3 +Y 2", A B A A A A), 3, 2, 0},
        {CASE("-X 3 +Y 2", A B A A A A), 3, 2, 2},
        {CASE("-Y 2 +X 3", B A "\1\1\1\1" A "\1\1\1\2"), 3, 2, 0}, // the old run-length code
        {CASE("-Y 1 +X 8", "\2\2\0\x08"                            // the new one, by planes
                           "\x88\x80"
                           "\x03\x80\x40\x40\x85\x40"
                           "\x03\x80\x20\x20\x85\x20"
                           "\x03\x80\x81\x81\x85\x81"),
         8, 1, -1},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        put("foreign_f.hdr", cases[k].file, cases[k].size);
        struct image im = get("foreign_f.hdr");
        assert_int_equal(im.w, cases[k].w);
        assert_int_equal(im.h, cases[k].h);
        for (int p = 0; p < im.w * im.h && cases[k].grey >= 0; p++) {
            const bool grey = p == cases[k].grey;
            assert_near(im.px[3 * p], grey ? 0.5 : 1, 0);
            assert_near(im.px[3 * p + 1], 0.5, 0);
            assert_near(im.px[3 * p + 2], grey ? 0.5 : 0.25, 0);
        }
        for (int p = 0; p < 8 && cases[k].grey < 0; p++) {
            assert_near(im.px[3 * p], p ? 1 : 0.5, 0);
            assert_near(im.px[3 * p + 2], p ? 0.25 : 0.5, 0);
        }
        image_finish(&im);
    }
    static const char xyz[] = "#?RADIANCE\nEXPOSURE=2\nEXPOSURE=3\nFORMAT=32-bit_rle_xyze\n\n"
                              "-Y 1 +X 1\n" A;
    put("foreign_f.hdr", xyz, sizeof xyz - 1);
    struct image im = get("foreign_f.hdr");
    double exposure = 0;
    assert_string_equal(meta_text(&im.meta, "channels"), "X,Y,Z");
    assert_true(meta_num(&im.meta, "nacre.hdr_exposure", &exposure) && exposure == 6);
    assert_near(im.px[0], 1, 0); // as stored
    image_finish(&im);
}

TEST(png_of_16_bits_with_alpha_and_of_one_bit_reads)
{
    static const char rgba[] =
        "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\2\0\0\0\1\x08\6\0\0\0\xf4\x22\x7f\x8a\0\0\0\x11IDAT"
        "\x78\xda\x63\xf8\xdf\xc0\xe0\xc0\xc8\xc4\xfc\x1f\0\x0d\xd0\x02\xc5\x11\xc9\xae\xe2"
        "\0\0\0\0IEND\xae\x42\x60\x82";
    static const char grey16[] =
        "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\2\0\0\0\1\x10\0\0\0\0\x81\xd9\xfc\x15\0\0\0\rIDAT"
        "\x78\xda\x63\xf8\xff\x5f\xc8\x04\0\x07\x56\x02\x45\xbe\x6a\xc3\x37"
        "\0\0\0\0IEND\xae\x42\x60\x82";
    static const char bits[] =
        "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x09\0\0\0\1\1\0\0\0\0\x24\xb9\xb9\xd0\0\0\0\x0bIDAT"
        "\x78\xda\x63\x58\xd0\0\0\1\xc3\1\x21\x56\x32\xaa\x40"
        "\0\0\0\0IEND\xae\x42\x60\x82";
    double encoded = 0;
    put("foreign_g.png", rgba, sizeof rgba - 1);
    struct image im = get("foreign_g.png");
    static const int want[8] = {255, 128, 0, 64, 1, 2, 3, 255};
    assert_int_equal(im.nc, 4);
    for (int k = 0; k < 8; k++)
        assert_near(im.px[k] * 255, want[k], 1e-4);
    image_finish(&im);
    put("foreign_g.png", grey16, sizeof grey16 - 1);
    im = get("foreign_g.png");
    assert_int_equal(im.nc, 1);
    assert_near(im.px[1] * 65535, 0x1234, 1e-2);
    assert_true(meta_num(&im.meta, "nacre.encoded", &encoded) && encoded == 0);
    image_finish(&im);
    put("foreign_g.png", bits, sizeof bits - 1);
    im = get("foreign_g.png");
    static const int on[9] = {1, 0, 1, 0, 0, 0, 0, 0, 1};
    for (int k = 0; k < 9; k++)
        assert_near(im.px[k], on[k], 0);
    image_finish(&im);
}

TEST(a_dng_gives_the_counts_of_its_mosaic)
{
    static const char *const cells[] = {"Y", "RGGB", "GRBG", "GBRG", "BGGR"};
    for (enum dng_pattern p = DNG_MONO; p <= DNG_BGGR; p++) {
        struct dng d = {.w = 64,
                        .h = 48,
                        .pattern = p,
                        .black = 64,
                        .white = 4095,
                        .exposure_s = 1.0 / 60,
                        .gain = 2,
                        .utc_s = 1700000000,
                        .camera = "sim"};
        void *bytes;
        size_t size;
        struct err e;
        double v = 0;
        d.raw = xcalloc((size_t)(d.w * d.h), 2);
        for (int k = 0; k < d.w * d.h; k++)
            d.raw[k] = (uint16_t)(k * 37 % 4096);
        assert_true(dng_encode(&d, &bytes, &size, &e));
        put("foreign_h.dng", bytes, size);
        struct image im = get("foreign_h.dng");
        assert_int_equal(im.w, 64);
        assert_int_equal(im.h, 48);
        assert_int_equal(im.nc, 1);
        for (int k = 0; k < d.w * d.h; k++)
            assert_near(im.px[k], d.raw[k], 0);
        assert_string_equal(meta_text(&im.meta, "nacre.bayer"), cells[p]);
        for (int k = 0; k < 4; k++)
            assert_near(meta_find(&im.meta, "nacre.black")->num[k], 64, 0);
        assert_true(meta_num(&im.meta, "nacre.white", &v) && v == 4095);
        assert_true(meta_num(&im.meta, "expTime", &v));
        assert_near(v, 1.0 / 60, 1e-8);
        assert_true(meta_num(&im.meta, "isoSpeed", &v) && v == 200);
        image_finish(&im);
        free(bytes);
        free(d.raw);
    }
}

static void add(zip_t *z, const char *name, const void *data, size_t size)
{
    assert_true(zip_file_add(z, name, zip_source_buffer(z, data, size, 0), 0) >= 0);
}

// A 3 x 2 surface; `axis` and `links` go into the document, md5 of the samples behind `links`.
static void write_x3p(const char *type, const char *z_axis, const char *links, const void *samples,
                      size_t size, const char *md5)
{
    char xml[2048], hex[MD5_TEXT];
    static const uint8_t valid = 0x3d; // node 1 was not measured
    md5_of(samples, size, hex);
    snprintf(xml, sizeof xml,
             "<?xml version='1.0'?>\n<ISO5436_2><Record1><FeatureType>SUR</FeatureType><Axes>"
             "<CX><AxisType>I</AxisType><Increment>1e-6</Increment></CX>"
             "<CY><AxisType>I</AxisType><Increment> 2e-6 </Increment></CY>"
             "<CZ><AxisType>A</AxisType><DataType>%s</DataType>%s</CZ></Axes></Record1>"
             "<Record3><MatrixDimension><SizeX>3</SizeX><SizeY>2</SizeY><SizeZ>1</SizeZ>"
             "</MatrixDimension><DataLink><PointDataLink>bindata/data.bin</PointDataLink>"
             "<MD5ChecksumPointData>%s</MD5ChecksumPointData>%s</DataLink></Record3></ISO5436_2>",
             type, z_axis, md5 ? md5 : hex, links);
    int code;
    zip_t *z = zip_open("foreign_i.x3p", ZIP_CREATE | ZIP_TRUNCATE, &code);
    add(z, "main.xml", xml, strlen(xml));
    add(z, "bindata/data.bin", samples, size);
    add(z, "bindata/valid.bin", &valid, 1);
    assert_int_equal(zip_close(z), 0);
}

TEST(x3p_of_every_sample_type_reads)
{
    static const int16_t small[6] = {0, 1, -2, 3, 4, 5};
    static const int32_t large[6] = {0, 100000, -200000, 3, 4, 5};
    static const double real[6] = {0, 1e-7, -2e-7, 3e-9, 4e-9, 5e-9};
    static const char LINK[] = "<ValidPointsLink>bindata/valid.bin</ValidPointsLink>";
    static const struct {
        const char *type, *z_axis, *links;
        const void *samples;
        size_t size;
        double z[3]; // the first nodes
    } cases[] = {
        {"I",
         "<Increment>1e-9</Increment><Offset>1e-6</Offset>",
         "",
         small,
         sizeof small,
         {1e-6, 1.001e-6, 0.998e-6}},
        {"L", "<Increment>1e-12</Increment>", LINK, large, sizeof large, {0, NAN, -2e-7}},
        {"D", "", "", real, sizeof real, {0, 1e-7, -2e-7}},
    };
    for (int k = 0; k < 3; k++) {
        struct hfield hf = {0};
        struct err e = {0};
        write_x3p(cases[k].type, cases[k].z_axis, cases[k].links, cases[k].samples, cases[k].size,
                  NULL);
        if (!hfield_read(&hf, "foreign_i.x3p", NULL, &e))
            fail_msg("%s", e.msg);
        assert_int_equal(hf.nx, 3);
        assert_int_equal(hf.ny, 2);
        assert_near(hf.dx_m, 1e-6, 0);
        assert_near(hf.dy_m, 2e-6, 0);
        for (int i = 0; i < 3; i++) {
            if (isnan(cases[k].z[i]))
                assert_true(isnan(hf.z[i]));
            else
                assert_near(hf.z[i], cases[k].z[i], 1e-13);
        }
        hfield_finish(&hf);
    }
    unlink("foreign_i.x3p");
}

TEST(an_x3p_that_contradicts_itself_is_refused)
{
    static const float z[6] = {0};
    static const struct {
        const char *type, *z_axis, *links, *md5, *msg;
        size_t size;
    } cases[] = {
        {"F", "", "", NULL, "20 bytes of samples, must be 24 for 3 x 2", 20},
        {"Q", "", "", NULL, "main.xml: data type 'Q': must be I, L, F or D", 24},
        {"I", "", "", NULL, "main.xml: integer heights without a CZ increment", 12},
        {"F", "<Increment>x</Increment>", "", NULL,
         "main.xml: CZ increment is 'x', must be a number", 24},
        {"F", "", "", "00000000000000000000000000000000",
         "damaged: 'bindata/data.bin' does not have the MD5 that main.xml states", 24},
        {"F", "", "<ValidPointsLink>none.bin</ValidPointsLink>", NULL, "no 'none.bin' inside", 24},
        {"F", "</CX>", "", NULL, "main.xml:2: mismatched tag", 24},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct hfield hf = {0};
        struct err e = {0};
        char want[256];
        write_x3p(cases[k].type, cases[k].z_axis, cases[k].links, z, cases[k].size, cases[k].md5);
        assert_false(hfield_read(&hf, "foreign_i.x3p", NULL, &e));
        snprintf(want, sizeof want, "foreign_i.x3p: %s", cases[k].msg);
        assert_string_equal(e.msg, want);
        assert_int_equal(e.code, ERR_DATA);
    }
    unlink("foreign_i.x3p");
}

// A scan of 2 x 3 samples behind a header with these lines.
static bool read_scan(const char *image_lines, const void *samples, size_t size, struct hfield *hf,
                      struct err *e)
{
    char file[2048] = {0};
    snprintf(file, sizeof file,
             "\\*File list\r\n\\Version: 0x09300000\r\n\\*Scanner list\r\n"
             "\\@Sens. Zsens: V 20.0 nm/V\r\n\\@Sens. Broken: V 1 nA/V\r\n"
             "\\*Ciao image list\r\n\\@2:Image Data: S [Deflection] \"D\"\r\n"
             "\\*Ciao image list\r\n%s\\*File list end\r\n",
             image_lines);
    memcpy(file + 1024, samples, size);
    put("foreign_j.spm", file, 1024 + size);
    const bool ok = hfield_read(hf, "foreign_j.spm", NULL, e);
    unlink("foreign_j.spm");
    return ok;
}

#define SCAN(length, scan_size, z_scale)                                                           \
    "\\Data offset: 1024\r\n\\Data length: " length "\r\n\\Bytes/pixel: 2\r\n\\Samps/line: 2\r\n"  \
    "\\Number of lines: 3\r\n\\Scan Size: " scan_size "\r\n"                                       \
    "\\@2:Image Data: S [Height] \"Height\"\r\n\\@2:Z scale: V " z_scale "\r\n"

TEST(nanoscope_scans_of_both_widths_read)
{
    static const int16_t half[6] = {0, 0, 0, 0, 16384, -32768};
    static const int32_t word[6] = {0, 0, 0, 0, 1 << 30, INT32_MIN};
    struct hfield hf = {0};
    struct err e = {0};
    for (int k = 0; k < 2; k++) {
        const bool ok = k ? read_scan(SCAN("24", "4 9 um", "[Sens. Zsens] (0.1 V/LSB) 8.0 V"), word,
                                      sizeof word, &hf, &e)
                          : read_scan(SCAN("12", "4000 nm", "[Sens. Zsens] (0.1 V/LSB) 8000 mV"),
                                      half, sizeof half, &hf, &e);
        if (!ok)
            fail_msg("%s", e.msg);
        assert_int_equal(hf.nx, 2);
        assert_int_equal(hf.ny, 3);
        assert_near(hf.dx_m, 2e-6, 1e-20);
        assert_near(hf.dy_m, k ? 3e-6 : 2e-6, 1e-20);
        assert_near(hf.z[0], 40e-9, 1e-14); // a quarter of 8 V times 20 nm/V
        assert_near(hf.z[1], -80e-9, 1e-14);
        hfield_finish(&hf);
    }
}

TEST(a_nanoscope_header_that_lies_is_refused)
{
    static const struct {
        const char *lines, *msg;
    } cases[] = {
        {SCAN("13", "4 um", "[Sens. Zsens] (0.1 V/LSB) 8.0 V"),
         "13 bytes of samples, must be 2 or 4 times 2 x 3"},
        {SCAN("24", "4 um", "[Sens. Zsens] (0.1 V/LSB) 8.0 V"),
         "cut short: samples end at byte 1048, the file at 1036"},
        {SCAN("12", "4 V", "[Sens. Zsens] (0.1 V/LSB) 8.0 V"),
         "Scan Size: unit 'V' is not a length"},
        {SCAN("12", "4", "[Sens. Zsens] (0.1 V/LSB) 8.0 V"),
         "bad Nanoscope header: 'Scan Size' is '4'"},
        {SCAN("12", "4 um", "8.0 V"), "bad Nanoscope header: '@2:Z scale' is 'V 8.0 V'"},
        {SCAN("12", "4 um", "[Sens. Broken] (0.1 V/LSB) 8.0 V"),
         "@Sens. Broken: unit 'nA' is not a length"},
        {SCAN("12", "4 um", "[Sens. None] (0.1 V/LSB) 8.0 V"),
         "bad Nanoscope header: '@Sens. None' is '', must be such as V 20 nm/V"},
        {"", "no height channel: must be Height or ZSensor, has Deflection ?"},
    };
    static const int16_t z[6] = {0};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct hfield hf = {0};
        struct err e = {0};
        char want[256];
        assert_false(read_scan(cases[k].lines, z, sizeof z, &hf, &e));
        snprintf(want, sizeof want, "foreign_j.spm: %s", cases[k].msg);
        assert_string_equal(e.msg, want);
        assert_int_equal(e.code, ERR_DATA);
    }
}

TEST_MAIN(cmocka_unit_test(half_scanlines_read_in_every_compression_and_window),
          cmocka_unit_test(half_tiles_with_smaller_levels_read),
          cmocka_unit_test(what_we_write_reads_elsewhere),
          cmocka_unit_test(integer_and_mixed_channels_read_and_odd_ones_are_refused),
          cmocka_unit_test(a_big_endian_pfm_reads_with_its_last_row_first),
          cmocka_unit_test(radiance_files_of_every_code_and_direction_read),
          cmocka_unit_test(png_of_16_bits_with_alpha_and_of_one_bit_reads),
          cmocka_unit_test(a_dng_gives_the_counts_of_its_mosaic),
          cmocka_unit_test(x3p_of_every_sample_type_reads),
          cmocka_unit_test(an_x3p_that_contradicts_itself_is_refused),
          cmocka_unit_test(nanoscope_scans_of_both_widths_read),
          cmocka_unit_test(a_nanoscope_header_that_lies_is_refused))
