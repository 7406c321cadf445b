// tiff_buffer.c - libtiff on a buffer in memory.
#include "core/tiff_buffer.h"
#include <stdlib.h>
#include <string.h>

static tsize_t buffer_read(thandle_t h, void *to, tsize_t want)
{
    struct tiff_buffer *b = h;
    const size_t left = b->pos < b->size ? b->size - b->pos : 0;
    const size_t n = (size_t)want < left ? (size_t)want : left;
    memcpy(to, b->at + b->pos, n);
    b->pos += n;
    return (tsize_t)n;
}

static tsize_t buffer_write(thandle_t h, void *from, tsize_t want)
{
    struct tiff_buffer *b = h;
    const size_t end = b->pos + (size_t)want;
    if (b->fixed)
        return -1;
    if (end > b->room) {
        const size_t room = end + end / 8 + 4096;
        unsigned char *at = realloc(b->at, room);
        if (!at)
            return -1;
        memset(at + b->room, 0, room - b->room);
        b->at = at;
        b->room = room;
    }
    memcpy(b->at + b->pos, from, (size_t)want);
    b->pos = end;
    b->size = end > b->size ? end : b->size;
    return want;
}

static toff_t buffer_seek(thandle_t h, toff_t to, int whence)
{
    struct tiff_buffer *b = h;
    b->pos = (size_t)to + (whence == SEEK_CUR ? b->pos : whence == SEEK_END ? b->size : 0);
    return b->pos;
}

static int buffer_close(thandle_t h)
{
    (void)h;
    return 0;
}

static toff_t buffer_size(thandle_t h)
{
    return ((struct tiff_buffer *)h)->size;
}

static int buffer_map(thandle_t h, void **at, toff_t *size)
{
    struct tiff_buffer *b = h;
    *at = b->at;
    *size = b->size;
    return b->fixed;
}

static void buffer_unmap(thandle_t h, void *at, toff_t size)
{
    (void)h;
    (void)at;
    (void)size;
}

TIFF *tiff_buffer_open(struct tiff_buffer *b, const char *mode)
{
    TIFFSetErrorHandler(NULL); // its failures come back as return values
    TIFFSetWarningHandler(NULL);
    return TIFFClientOpen("tiff", mode, b, buffer_read, buffer_write, buffer_seek, buffer_close,
                          buffer_size, buffer_map, buffer_unmap);
}
