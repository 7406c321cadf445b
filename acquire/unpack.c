// unpack.c - one table of formats, and a loop for every layout.
#define _GNU_SOURCE
#include "acquire/unpack.h"
#include "core/raster.h"
#include <linux/videodev2.h>
#include <string.h>

#define BAYER(text, layout, bits, bggr, gbrg, grbg, rggb)                                          \
    {rggb, "SRGGB" text, layout, CAM_RGGB, bits}, {grbg, "SGRBG" text, layout, CAM_GRBG, bits},    \
        {gbrg, "SGBRG" text, layout, CAM_GBRG, bits},                                              \
    {                                                                                              \
        bggr, "SBGGR" text, layout, CAM_BGGR, bits                                                 \
    }
#define V4L2(x) V4L2_PIX_FMT_##x

// More bits first, and of the same those that cost less to move.
static const struct pixel_format formats[] = {
    BAYER("16", PIXEL_16, 16, V4L2(SBGGR16), V4L2(SGBRG16), V4L2(SGRBG16), V4L2(SRGGB16)),
    {V4L2(Y16), "R16", PIXEL_16, CAM_MONO, 16},
    {V4L2(Y16_BE), "R16_BE", PIXEL_16_BE, CAM_MONO, 16},
    BAYER("14_CSI2P", PIXEL_CSI2, 14, V4L2(SBGGR14P), V4L2(SGBRG14P), V4L2(SGRBG14P),
          V4L2(SRGGB14P)),
    BAYER("14", PIXEL_16, 14, V4L2(SBGGR14), V4L2(SGBRG14), V4L2(SGRBG14), V4L2(SRGGB14)),
    {V4L2(Y14), "R14", PIXEL_16, CAM_MONO, 14},
    BAYER("12_CSI2P", PIXEL_CSI2, 12, V4L2(SBGGR12P), V4L2(SGBRG12P), V4L2(SGRBG12P),
          V4L2(SRGGB12P)),
    BAYER("12", PIXEL_16, 12, V4L2(SBGGR12), V4L2(SGBRG12), V4L2(SGRBG12), V4L2(SRGGB12)),
    {v4l2_fourcc('Y', '1', '2', 'P'), "R12_CSI2P", PIXEL_CSI2, CAM_MONO, 12},
    {V4L2(Y12), "R12", PIXEL_16, CAM_MONO, 12},
    BAYER("10_CSI2P", PIXEL_CSI2, 10, V4L2(SBGGR10P), V4L2(SGBRG10P), V4L2(SGRBG10P),
          V4L2(SRGGB10P)),
    BAYER("10", PIXEL_16, 10, V4L2(SBGGR10), V4L2(SGBRG10), V4L2(SGRBG10), V4L2(SRGGB10)),
    {V4L2(Y10P), "R10_CSI2P", PIXEL_CSI2, CAM_MONO, 10},
    {V4L2(Y10BPACK), "R10_STREAM", PIXEL_STREAM, CAM_MONO, 10},
    {V4L2(Y10), "R10", PIXEL_16, CAM_MONO, 10},
    BAYER("8", PIXEL_8, 8, V4L2(SBGGR8), V4L2(SGBRG8), V4L2(SGRBG8), V4L2(SRGGB8)),
    {V4L2(GREY), "R8", PIXEL_8, CAM_MONO, 8},
    {V4L2(YUYV), "YUYV", PIXEL_YUYV, CAM_MONO, 8, true},
    {V4L2(UYVY), "UYVY", PIXEL_UYVY, CAM_MONO, 8, true},
    {V4L2(RGB24), "BGR888", PIXEL_RGB, CAM_MONO, 8, true}, // libcamera names the last byte first
    {V4L2(BGR24), "RGB888", PIXEL_RGB, CAM_MONO, 8, true},
    {V4L2(MJPEG), "MJPEG", PIXEL_JPEG, CAM_MONO, 8, true},
    {V4L2(JPEG), "JPEG", PIXEL_JPEG, CAM_MONO, 8, true},
};
enum { N_FORMATS = sizeof formats / sizeof *formats };

const struct pixel_format *pixel_format_at(int rank)
{
    return rank >= 0 && rank < N_FORMATS ? &formats[rank] : NULL;
}

const struct pixel_format *pixel_format_of(uint32_t fourcc)
{
    for (int k = 0; k < N_FORMATS; k++)
        if (formats[k].fourcc == fourcc)
            return &formats[k];
    return NULL;
}

const char *pixel_fourcc_text(uint32_t fourcc, char buf[5])
{
    for (int k = 0; k < 4; k++) {
        const char c = (char)(fourcc >> 8 * k & 0x7f); // the top bit of the last says big-endian
        buf[k] = c > ' ' ? c : 0;
    }
    buf[4] = 0;
    return buf;
}

const struct pixel_format *pixel_format_named(const char *name)
{
    char text[5];
    for (int k = 0; k < N_FORMATS; k++)
        if (!strcmp(name, formats[k].name) ||
            !strcmp(name, pixel_fourcc_text(formats[k].fourcc, text)))
            return &formats[k];
    return NULL;
}

static int group_of(const struct pixel_format *f) // pixels that share bytes
{
    switch (f->layout) {
    case PIXEL_CSI2: return f->bits == 12 ? 2 : 4;
    case PIXEL_STREAM: return 4;
    case PIXEL_YUYV:
    case PIXEL_UYVY: return 2;
    default: return 1;
    }
}

bool pixel_width_ok(const struct pixel_format *f, int w)
{
    return w > 0 && w % group_of(f) == 0;
}

size_t pixel_row_bytes(const struct pixel_format *f, int w)
{
    const size_t n = (size_t)w;
    switch (f->layout) {
    case PIXEL_8: return n;
    case PIXEL_CSI2:
    case PIXEL_STREAM: return n * (size_t)f->bits / 8;
    case PIXEL_RGB: return 3 * n;
    case PIXEL_JPEG: return 0;
    default: return 2 * n;
    }
}

// Constants in every call, so that the compiler unrolls the group.
static inline void csi2_row(const uint8_t *in, int w, uint16_t *out, int bits, int group)
{
    const int low = bits - 8, tail = group * low / 8;
    for (int i = 0; i < w; i += group, in += group + tail, out += group) {
        uint32_t lows = 0;
        for (int k = 0; k < tail; k++)
            lows |= (uint32_t)in[group + k] << 8 * k;
        for (int k = 0; k < group; k++)
            out[k] = (uint16_t)(in[k] << low | (lows >> k * low & ((1u << low) - 1)));
    }
}

static void stream10_row(const uint8_t *in, int w, uint16_t *out)
{
    for (int i = 0; i < w; i += 4, in += 5, out += 4) {
        uint64_t bits = 0;
        for (int k = 0; k < 5; k++)
            bits = bits << 8 | in[k];
        for (int k = 0; k < 4; k++)
            out[k] = (uint16_t)(bits >> 10 * (3 - k) & 0x3ff);
    }
}

static void wide_row(const uint8_t *in, int w, uint16_t *out, int low, uint16_t limit)
{
    for (int i = 0; i < w; i++) {
        const uint16_t v = (uint16_t)(in[2 * i + low] | in[2 * i + 1 - low] << 8);
        out[i] = v < limit ? v : limit; // the unused bits should be 0
    }
}

static void bytes_row(const uint8_t *in, int w, uint16_t *out, int first, int step)
{
    for (int i = 0; i < w; i++)
        out[i] = in[first + i * step];
}

static void unpack_row(const struct pixel_format *f, const uint8_t *in, int w, uint16_t *out)
{
    const uint16_t limit = (uint16_t)((1u << f->bits) - 1);
    switch (f->layout) {
    case PIXEL_8: bytes_row(in, w, out, 0, 1); break;
    case PIXEL_16: wide_row(in, w, out, 0, limit); break;
    case PIXEL_16_BE: wide_row(in, w, out, 1, limit); break;
    case PIXEL_STREAM: stream10_row(in, w, out); break;
    case PIXEL_YUYV: bytes_row(in, w, out, 0, 2); break;
    case PIXEL_UYVY: bytes_row(in, w, out, 1, 2); break;
    case PIXEL_RGB: bytes_row(in, w, out, 1, 3); break;
    case PIXEL_JPEG: break;
    case PIXEL_CSI2:
        if (f->bits == 10)
            csi2_row(in, w, out, 10, 4);
        else if (f->bits == 12)
            csi2_row(in, w, out, 12, 2);
        else
            csi2_row(in, w, out, 14, 4);
        break;
    }
}

static bool unpack_jpeg(const void *in, size_t bytes, int w, int h, uint16_t *out)
{
    struct image im = {0};
    struct err ignored;
    const bool ok = jpeg_decode(&im, in, bytes, &ignored) && im.w == w && im.h == h;
    const size_t n = ok ? (size_t)w * (size_t)h : 0, nc = (size_t)im.nc, green = nc / 2;
    for (size_t k = 0; k < n; k++)
        out[k] = (uint16_t)(255 * im.px[k * nc + green] + 0.5f);
    image_finish(&im);
    return ok;
}

bool unpack(const struct pixel_format *f, const void *in, size_t bytes, size_t stride, int w, int h,
            uint16_t *out)
{
    if (f->layout == PIXEL_JPEG)
        return unpack_jpeg(in, bytes, w, h, out);
    const size_t need = pixel_row_bytes(f, w);
    int j = 0;
    for (; j < h && (size_t)j * stride + need <= bytes; j++)
        unpack_row(f, (const uint8_t *)in + (size_t)j * stride, w, out + (size_t)j * (size_t)w);
    return j == h;
}
