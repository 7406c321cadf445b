// imgfile.c - the table of picture formats, and what is the same for all of them.
#define _GNU_SOURCE
#include "core/imgfile.h"
#include "core/codec.h"
#include "core/mem.h"
#include "core/outfile.h"
#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const struct codec {
    const char *ext;
    bool (*read)(struct image *im, const char *path, struct err *e);
    bool (*write)(const struct image *im, const char *path, struct err *e); // NULL: read only
} codecs[] = {
    {".exr", exr_read, exr_write},
    {".pfm", pfm_read, pfm_write},
    {".hdr", rgbe_read, rgbe_write},
    {".png", picture_read, display_write},
    {".jpg", picture_read, display_write},
    {".jpeg", picture_read, display_write},
    {".tif", picture_read, tiff16_write},
    {".tiff", picture_read, tiff16_write},
    {".dng", raw_read, NULL},
    {".cr2", raw_read, NULL},
    {".cr3", raw_read, NULL},
    {".nef", raw_read, NULL},
    {".arw", raw_read, NULL},
    {".raf", raw_read, NULL},
    {".orf", raw_read, NULL},
    {".rw2", raw_read, NULL},
    {".pef", raw_read, NULL},
    {NULL, NULL, NULL},
};

const char *path_ext(const char *path)
{
    static _Thread_local char recent[8][16];
    static _Thread_local unsigned turn;
    const char *slash = strrchr(path, '/'), *base = slash ? slash + 1 : path;
    const char *dot = strrchr(base, '.');
    if (!dot || dot == base || strlen(dot) >= sizeof recent[0])
        return "";
    char *ext = recent[turn++ % 8];
    for (size_t k = 0; k <= strlen(dot); k++)
        ext[k] = (char)tolower((unsigned char)dot[k]);
    return ext;
}

static const struct codec *codec_of(const char *path)
{
    const char *ext = path_ext(path);
    for (const struct codec *c = codecs; c->ext; c++)
        if (!strcmp(c->ext, ext))
            return c;
    return NULL;
}

bool image_read(struct image *im, const char *path, struct err *e)
{
    const struct codec *c = codec_of(path);
    if (!c)
        return err_set(e, ERR_DATA,
                       "%s: not a picture by its name: can read .exr .pfm .hdr .png .jpg .tif .dng "
                       "and camera raw",
                       path);
    struct image out = {0};
    if (!c->read(&out, path, e)) {
        image_finish(&out);
        return err_in(e, "%s", path);
    }
    *im = out;
    return true;
}

bool image_write(const struct image *im, const char *path, struct err *e)
{
    const struct codec *c = codec_of(path);
    if (!c || !c->write)
        return err_set(e, ERR_DATA, "%s: cannot write '%s': must be .exr .pfm .hdr .png .jpg .tif",
                       path, path_ext(path));
    struct outfile o;
    if (!outfile_open(&o, path, e))
        return false;
    if (!c->write(im, o.tmp, e)) {
        outfile_drop(&o);
        return err_in(e, "%s", path);
    }
    return outfile_commit(&o, e);
}

bool image_check_finite(const struct image *im, const char *path, struct err *e)
{
    const struct flaws f = image_flaws(im);
    if (!f.n)
        return true;
    const size_t at = ((size_t)f.j * (size_t)im->w + (size_t)f.i) * (size_t)im->nc + (size_t)f.c;
    return err_set(e, ERR_DATA, "%s: pixel (%d, %d) is %s (%ld such sample%s)", path, f.i, f.j,
                   isnan(im->px[at]) ? "NaN" : "infinite", f.n, f.n == 1 ? "" : "s");
}
