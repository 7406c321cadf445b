// dng.h - one exposure as a 16-bit DNG: the sensor's counts, untouched, with what a raw converter
// needs to know.
//
// The file is built in memory, so that it is hashed and written from the same bytes. Mono sensors
// are LinearRaw, mosaics CFA; both uncompressed, one strip. The exposure time in EXIF is rounded to
// a float; the exact one is in the session's ledger.
#pragma once
#include "core/err.h"
#include <stddef.h>
#include <stdint.h>

enum dng_pattern { DNG_MONO, DNG_RGGB, DNG_GRBG, DNG_GBRG, DNG_BGGR };

struct dng {
    int w, h;
    enum dng_pattern pattern;
    double black;      // counts
    int white;         // largest count, 1 to 65535
    double exposure_s; // 0: not known
    double gain;       // 1 is ISO 100
    int64_t utc_s;     // when it was taken, seconds since 1970; 0: not known
    char camera[64];   // model; "" becomes "nacre"
    uint16_t *raw;     // [h][w]; dng_read: owned, dng_finish() frees it
};

// *bytes is allocated. ERR_DATA for sizes out of 1..65535.
bool dng_encode(const struct dng *d, void **bytes, size_t *size, struct err *e);

// Reads back what dng_encode wrote. ERR_FILE: cannot be opened; ERR_DATA: not such a DNG, cut
// short.
bool dng_read(struct dng *d, const char *path, struct err *e);
void dng_finish(struct dng *d); // accepts a zeroed struct
