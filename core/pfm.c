// pfm.c - portable float maps: text header, then float32 rows from the bottom up.
#define _GNU_SOURCE
#include "core/codec.h"
#include "core/infile.h"
#include "core/mem.h"
#include <ctype.h>
#include <endian.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WORD = 64 };

// The next word of the header and the one white space (or "\r\n") behind it.
static bool next_word(FILE *f, char word[WORD])
{
    int c = getc(f), n = 0;
    while (isspace(c))
        c = getc(f);
    for (; c != EOF && !isspace(c); c = getc(f)) {
        if (n == WORD - 1)
            return false;
        word[n++] = (char)c;
    }
    word[n] = 0;
    if (c == '\r' && (c = getc(f)) != '\n')
        ungetc(c, f);
    return n && c != EOF;
}

static bool number(FILE *f, const char *what, double *value, struct err *e)
{
    char word[WORD], *end;
    if (!next_word(f, word))
        return err_set(e, ERR_DATA, "bad PFM header: no %s", what);
    *value = strtod(word, &end);
    if (*end || !isfinite(*value))
        return err_set(e, ERR_DATA, "bad PFM header: %s is '%s'", what, word);
    return true;
}

static bool size(FILE *f, int *w, int *h, struct err *e)
{
    double v[2] = {0, 0};
    if (!number(f, "width", &v[0], e) || !number(f, "height", &v[1], e))
        return false;
    for (int k = 0; k < 2; k++)
        if (v[k] < 1 || v[k] > IMAGE_MAX_SIDE || v[k] != floor(v[k]))
            return err_set(e, ERR_DATA, "bad size %g x %g: each side must be 1 to %d pixels", v[0],
                           v[1], IMAGE_MAX_SIDE);
    *w = (int)v[0];
    *h = (int)v[1];
    return true;
}

static bool read_rows(struct infile *in, struct image *im, bool little, struct err *e)
{
    const size_t row = (size_t)im->w * (size_t)im->nc;
    for (int j = im->h - 1; j >= 0; j--) {
        float *px = im->px + (size_t)j * row;
        if (fread(px, sizeof *px, row, in->f) != row)
            return err_errno(e, "cannot read");
        for (size_t k = 0; k < row; k++) {
            uint32_t bits;
            memcpy(&bits, px + k, sizeof bits);
            bits = little ? le32toh(bits) : be32toh(bits);
            memcpy(px + k, &bits, sizeof bits);
        }
    }
    return true;
}

static bool read_file(struct infile *in, struct image *im, struct err *e)
{
    char magic[WORD] = "";
    next_word(in->f, magic);
    const int nc = !strcmp(magic, "PF") ? 3 : !strcmp(magic, "Pf") ? 1 : 0;
    if (!nc)
        return err_set(e, ERR_DATA, "not a PFM file: must begin with PF or Pf");
    int w = 0, h = 0;
    double scale = 0; // its sign is the byte order; its size is a unit that hardly anyone uses
    if (!size(in->f, &w, &h, e) || !number(in->f, "scale", &scale, e))
        return false;
    if (scale == 0)
        return err_set(e, ERR_DATA, "bad PFM header: scale is 0, must be -1 or 1");
    if (!infile_holds(in, 4.0 * nc * w * h, e) || !image_init(im, w, h, nc, e))
        return false;
    meta_set_text(&im->meta, "channels", nc == 1 ? "Y" : "R,G,B");
    return read_rows(in, im, scale < 0, e);
}

bool pfm_read(struct image *im, const char *path, struct err *e)
{
    struct infile in = {0};
    const bool ok = infile_open(&in, path, e) && read_file(&in, im, e);
    infile_close(&in);
    return ok;
}

bool pfm_write(const struct image *im, const char *path, struct err *e)
{
    if (im->nc != 1 && im->nc != 3)
        return err_set(e, ERR_DATA, "PFM holds 1 or 3 channels, not %d: write .exr", im->nc);
    FILE *f = fopen(path, "wbe");
    if (!f)
        return err_errno(e, "cannot write");
    fprintf(f, "%s\n%d %d\n-1.0\n", im->nc == 3 ? "PF" : "Pf", im->w, im->h);
    const size_t row = (size_t)im->w * (size_t)im->nc;
    uint32_t *out = xcalloc(row, sizeof *out);
    for (int j = im->h - 1; j >= 0; j--) {
        memcpy(out, im->px + (size_t)j * row, row * sizeof *out);
        for (size_t k = 0; k < row; k++)
            out[k] = htole32(out[k]);
        fwrite(out, sizeof *out, row, f);
    }
    free(out);
    const bool written = !ferror(f);
    return (!fclose(f) && written) || err_errno(e, "cannot write");
}
