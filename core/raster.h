// raster.h - PNG, JPEG and TIFF decoders and encoders, one file each; picture.c chooses by the
// bytes.
//
// A decoder gets the whole file. Its samples: 8 and 16 bits as 0..1, floats as stored; 1, 3 or 4
// channels; meta "nacre.encoded" is 1 for 8 bits. Data that is damaged in the least is ERR_DATA.
#pragma once
#include "core/image.h"
#include <stdint.h>
#include <stdio.h>

bool png_decode(struct image *im, const uint8_t *data, size_t n, struct err *e);
bool jpeg_decode(struct image *im, const uint8_t *data, size_t n, struct err *e);
bool tiff_decode(struct image *im, const uint8_t *data, size_t n, struct err *e);

struct raster {
    void *px; // [h][w][nc] uint8_t or uint16_t
    int w, h, nc;
    int sample_bytes; // 1 or 2; JPEG has 1
};

// False when the file cannot be written or memory is short.
bool png_encode(const struct raster *r, FILE *f);
bool jpeg_encode(const struct raster *r, FILE *f);
bool tiff_encode(const struct raster *r, FILE *f);

// A row of `n` samples of 1 or 2 bytes as 0..1.
void raster_row(float *to, const void *from, size_t n, int sample_bytes);

// What all three say of bytes that cannot be decoded: ERR_DATA.
bool raster_damaged(struct err *e);
