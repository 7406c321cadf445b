// tiff_buffer.h - libtiff on a buffer in memory.
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <tiffio.h>

// A growing buffer to write (start it zeroed, or with `room`; free `at`), or fixed bytes to read.
struct tiff_buffer {
    unsigned char *at;
    size_t size, room, pos;
    bool fixed;
};

// NULL when these bytes are no TIFF. libtiff's messages are silenced: failures are return values.
TIFF *tiff_buffer_open(struct tiff_buffer *b, const char *mode);
