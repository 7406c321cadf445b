// test_unpack.c - every pixel format against a reference that looks up one bit at a time.
#include "tests/test.h"

#include "acquire/unpack.h"
#include "core/raster.h"
#include "tests/noise.h"
#include <linux/videodev2.h>

enum { W = 24, H = 3, PAD = 5 };

// Where bit `b` of pixel `i` lies in its row, by the kernel's "Image Formats": byte, and bit in it.
struct place {
    int byte, bit;
};

// MIPI packing: the upper eight bits have a byte each; which bits the lower ones are is written out
// here as the tables of the kernel's documentation have it.
static struct place csi2_place(int bits, int i, int b)
{
    static const struct place low10[4][2] = {
        {{4, 0}, {4, 1}}, {{4, 2}, {4, 3}}, {{4, 4}, {4, 5}}, {{4, 6}, {4, 7}}};
    static const struct place low12[2][4] = {{{2, 0}, {2, 1}, {2, 2}, {2, 3}},
                                             {{2, 4}, {2, 5}, {2, 6}, {2, 7}}};
    static const struct place low14[4][6] = {{{4, 0}, {4, 1}, {4, 2}, {4, 3}, {4, 4}, {4, 5}},
                                             {{4, 6}, {4, 7}, {5, 0}, {5, 1}, {5, 2}, {5, 3}},
                                             {{5, 4}, {5, 5}, {5, 6}, {5, 7}, {6, 0}, {6, 1}},
                                             {{6, 2}, {6, 3}, {6, 4}, {6, 5}, {6, 6}, {6, 7}}};
    const int group = bits == 12 ? 2 : 4, bytes = group * bits / 8, base = i / group * bytes;
    const int k = i % group, low = bits - 8;
    if (b >= low)
        return (struct place){base + k, b - low};
    const struct place p = bits == 10 ? low10[k][b] : bits == 12 ? low12[k][b] : low14[k][b];
    return (struct place){base + p.byte, p.bit};
}

static struct place place_of(const struct pixel_format *f, int i, int b)
{
    switch (f->layout) {
    case PIXEL_8: return (struct place){i, b};
    case PIXEL_16: return (struct place){2 * i + b / 8, b % 8};
    case PIXEL_16_BE: return (struct place){2 * i + 1 - b / 8, b % 8};
    case PIXEL_CSI2: return csi2_place(f->bits, i, b);
    case PIXEL_STREAM: {
        const int from_top = i * 10 + 9 - b;
        return (struct place){from_top / 8, 7 - from_top % 8};
    }
    case PIXEL_YUYV: return (struct place){2 * i, b};
    case PIXEL_UYVY: return (struct place){2 * i + 1, b};
    default: return (struct place){3 * i + 1, b};
    }
}

static unsigned reference(const struct pixel_format *f, const uint8_t *row, int i)
{
    unsigned v = 0;
    for (int b = 0; b < f->bits; b++) {
        const struct place p = place_of(f, i, b);
        v |= (unsigned)(row[p.byte] >> p.bit & 1) << b;
    }
    return v;
}

static void fill(const struct pixel_format *f, uint8_t *in, size_t bytes, size_t stride)
{
    uint64_t seed = f->fourcc;
    for (size_t k = 0; k < bytes; k++)
        in[k] = (uint8_t)(256 * noise_uniform(&seed));
    if (f->layout != PIXEL_16) // whose unused bits are 0
        return;
    for (int j = 0; j < H; j++)
        for (int i = 0; i < W; i++)
            in[(size_t)j * stride + 2 * (size_t)i + 1] &= (uint8_t)((1 << (f->bits - 8)) - 1);
}

TEST(every_format_unpacks_to_the_bits_that_the_kernel_documents)
{
    const struct pixel_format *f;
    int n = 0;
    for (int rank = 0; (f = pixel_format_at(rank)); rank++) {
        if (f->layout == PIXEL_JPEG)
            continue;
        const size_t stride = pixel_row_bytes(f, W) + PAD, bytes = stride * H - PAD;
        uint8_t in[(6 * W + PAD) * H];
        uint16_t out[W * H];
        fill(f, in, bytes, stride);
        assert_true(unpack(f, in, bytes, stride, W, H, out));
        for (int j = 0; j < H; j++)
            for (int i = 0; i < W; i++)
                if (out[j * W + i] != reference(f, in + (size_t)j * stride, i))
                    fail_msg("%s (%d, %d): %u, not %u", f->name, i, j, out[j * W + i],
                             reference(f, in + (size_t)j * stride, i));
        n++;
    }
    print_message("%d formats\n", n);
    assert_true(n >= 35);
}

TEST(formats_are_found_by_both_names)
{
    static const struct {
        const char *fourcc, *name;
        uint32_t code;
        enum cam_pattern pattern;
        int bits;
    } known[] = {
        {"BA81", "SBGGR8", V4L2_PIX_FMT_SBGGR8, CAM_BGGR, 8},
        {"BA10", "SGRBG10", V4L2_PIX_FMT_SGRBG10, CAM_GRBG, 10},
        {"pRAA", "SRGGB10_CSI2P", V4L2_PIX_FMT_SRGGB10P, CAM_RGGB, 10},
        {"pGCC", "SGBRG12_CSI2P", V4L2_PIX_FMT_SGBRG12P, CAM_GBRG, 12},
        {"BYR2", "SBGGR16", V4L2_PIX_FMT_SBGGR16, CAM_BGGR, 16},
        {"GREY", "R8", V4L2_PIX_FMT_GREY, CAM_MONO, 8},
        {"Y12", "R12", V4L2_PIX_FMT_Y12, CAM_MONO, 12},
    };
    for (size_t k = 0; k < sizeof known / sizeof *known; k++) {
        const struct pixel_format *f = pixel_format_of(known[k].code);
        assert_ptr_equal(f, pixel_format_named(known[k].fourcc));
        assert_ptr_equal(f, pixel_format_named(known[k].name));
        assert_int_equal(f->pattern, known[k].pattern);
        assert_int_equal(f->bits, known[k].bits);
        assert_false(f->for_looking);
    }
    assert_null(pixel_format_named("RGBX"));
    assert_null(pixel_format_of(0));
    assert_true(pixel_format_named("YUYV")->for_looking);
    assert_true(pixel_format_named("MJPG")->for_looking);
}

TEST(no_two_formats_share_a_name)
{
    const struct pixel_format *a, *b;
    for (int k = 0; (a = pixel_format_at(k)); k++)
        for (int l = 0; l < k && (b = pixel_format_at(l)); l++)
            if (a->fourcc == b->fourcc || !strcmp(a->name, b->name))
                fail_msg("%s and %s", a->name, b->name);
}

TEST(a_frame_cut_short_is_told_and_its_whole_rows_are_kept)
{
    const struct pixel_format *f = pixel_format_named("SRGGB10_CSI2P");
    uint8_t in[30 * H];
    uint16_t out[W * H];
    memset(in, 0xff, sizeof in);
    memset(out, 0, sizeof out);
    assert_false(unpack(f, in, 30 * H - 1, 30, W, H, out));
    assert_int_equal(out[W * 2 - 1], 1023);
    assert_int_equal(out[W * 2], 0);
}

TEST(unused_bits_that_are_set_saturate)
{
    const uint8_t in[2] = {0x05, 0x10};
    uint16_t out;
    assert_true(unpack(pixel_format_named("R12"), in, 2, 2, 1, 1, &out));
    assert_int_equal(out, 4095);
}

TEST(widths_must_fill_whole_groups)
{
    assert_false(pixel_width_ok(pixel_format_named("SRGGB10_CSI2P"), 642));
    assert_true(pixel_width_ok(pixel_format_named("SRGGB12_CSI2P"), 642));
    assert_false(pixel_width_ok(pixel_format_named("YUYV"), 641));
    assert_true(pixel_width_ok(pixel_format_named("R10"), 641));
    assert_false(pixel_width_ok(pixel_format_named("R10"), 0));
}

TEST(a_jpeg_becomes_its_green_and_a_broken_one_does_not)
{
    enum { N = 16 };
    uint8_t rgb[N * N][3];
    uint16_t out[N * N];
    char *file = NULL;
    size_t bytes = 0;
    for (int k = 0; k < N * N; k++)
        memcpy(rgb[k], (const uint8_t[]){90, 77, 60}, 3);
    FILE *f = open_memstream(&file, &bytes);
    assert_true(jpeg_encode(&(struct raster){rgb, N, N, 3, 1}, f));
    fclose(f);
    const struct pixel_format *p = pixel_format_named("MJPEG");
    assert_true(unpack(p, file, bytes, 0, N, N, out));
    for (int k = 0; k < N * N; k++)
        assert_near(out[k], 77, 2);
    assert_false(unpack(p, file, bytes, 0, N, N + 1, out));
    assert_false(unpack(p, file, bytes / 2, 0, N, N, out));
    assert_false(unpack(p, "no picture", 10, 0, N, N, out));
    free(file);
}

TEST_MAIN(cmocka_unit_test(every_format_unpacks_to_the_bits_that_the_kernel_documents),
          cmocka_unit_test(formats_are_found_by_both_names),
          cmocka_unit_test(no_two_formats_share_a_name),
          cmocka_unit_test(a_frame_cut_short_is_told_and_its_whole_rows_are_kept),
          cmocka_unit_test(unused_bits_that_are_set_saturate),
          cmocka_unit_test(widths_must_fill_whole_groups),
          cmocka_unit_test(a_jpeg_becomes_its_green_and_a_broken_one_does_not))
