// unpack.h - the pixel formats of cameras, by name, and their samples as 16-bit counts.
//
// Names   fourcc is V4L2's code; name is libcamera's ("SRGGB10_CSI2P"), which people may use too.
// Layouts as in the kernel's "Image Formats": samples of 10 to 14 bits come one by one in 16 bits
//         (little-endian, right-justified), or as MIPI CSI-2 packs them: the upper 8 bits of a
//         group of pixels, then all their lower bits, first pixel first, lowest bit first.
// Pictures that a camera has already processed have for_looking set: of YUV the luma is taken, of
//         RGB and JPEG the green.
#pragma once
#include "acquire/camera.h"

enum pixel_layout {
    PIXEL_8,      // one byte a sample
    PIXEL_16,     // two, little-endian
    PIXEL_16_BE,  // two, big-endian
    PIXEL_CSI2,   // MIPI CSI-2 packed
    PIXEL_STREAM, // bits without gaps, highest first
    PIXEL_YUYV,   // Y at even bytes
    PIXEL_UYVY,   // Y at odd bytes
    PIXEL_RGB,    // three bytes, G in the middle
    PIXEL_JPEG,   // a file
};

struct pixel_format {
    uint32_t fourcc;
    char name[16];
    enum pixel_layout layout;
    enum cam_pattern pattern;
    int bits; // a sample has, 8 to 16
    bool for_looking;
};

const struct pixel_format *pixel_format_of(uint32_t fourcc);     // NULL: not known
const struct pixel_format *pixel_format_named(const char *name); // "BA12" or "SGRBG12"; or NULL
const struct pixel_format *pixel_format_at(int rank);            // best for measuring first;
                                                                 // NULL past the last
const char *pixel_fourcc_text(uint32_t fourcc, char buf[5]);     // "BA12"; returns buf
size_t pixel_row_bytes(const struct pixel_format *f, int w);     // at least; 0: files
bool pixel_width_ok(const struct pixel_format *f, int w);        // whole groups only

// in: h rows, `stride` bytes apart; out [h][w], counts up to 2^bits - 1. `bytes` is how much there
// is: false, with nothing wrong in out, when that is too little (or no JPEG); what is there is
// unpacked.
bool unpack(const struct pixel_format *f, const void *in, size_t bytes, size_t stride, int w, int h,
            uint16_t *out);
