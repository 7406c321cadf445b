// hfield_file.c - the table of height formats, and the rules for units.
#define _GNU_SOURCE
#include "core/hfield_file.h"
#include "core/hcodec.h"
#include "core/imgfile.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/outfile.h"
#include "core/units.h"
#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const struct codec {
    const char *ext;
    bool is_height_only;
    bool (*read)(struct hfield *hf, const char *path, const struct hfield_hints *hints,
                 struct err *e);
    bool (*write)(const struct hfield *hf, const char *path, const struct hfield_hints *hints,
                  struct err *e); // NULL: read only
} codecs[] = {
    {".gsf", true, gsf_read, gsf_write},
    {".x3p", true, x3p_read, x3p_write},
    {".di", true, nanoscope_read, NULL},
    {".spm", true, nanoscope_read, NULL},
    {".000", true, nanoscope_read, NULL}, // and every other number of three digits
    {".exr", false, height_picture_read, height_picture_write},
    {".pfm", false, height_picture_read, height_picture_write},
    {".tif", false, height_picture_read, height_picture_write},
    {".tiff", false, height_picture_read, height_picture_write},
    {".png", false, height_picture_read, height_picture_write},
    {NULL, false, NULL, NULL},
};

static const struct codec *codec_of(const char *path)
{
    const char *ext = path_ext(path);
    if (strlen(ext) == 4 && isdigit(ext[1]) && isdigit(ext[2]) && isdigit(ext[3]))
        ext = ".000";
    for (const struct codec *c = codecs; c->ext; c++)
        if (!strcmp(c->ext, ext))
            return c;
    return NULL;
}

bool path_is_height(const char *path)
{
    const struct codec *c = codec_of(path);
    return c && c->is_height_only;
}

bool length_unit(const char *what, const char *unit, double *metres, struct err *e)
{
    if (!*unit)
        return err_set(e, ERR_DATA, "%s: the file states no unit", what);
    const bool micro = !strcmp(unit, "~m") || !strcmp(unit, "\xb5m"); // the latter in Latin-1
    char *one = xasprintf("1%s", micro ? "um" : unit);
    const bool ok = !strpbrk(unit, "0123456789.+-/eE ") && quantity_parse(one, UNIT_M, metres, e);
    free(one);
    return ok || err_set(e, ERR_DATA, "%s: unit '%.20s' is not a length", what, unit);
}

static bool differs(double hint, double file) // NAN: no
{
    return fabs(hint - file) > 0.01 * fabs(file);
}

bool hfield_spacing(const struct hfield_hints *hints, double dx_file_m, double dy_file_m,
                    double *dx_m, double *dy_m, struct err *e)
{
    const bool told = hints && hints->dx_m > 0;
    *dx_m = told ? hints->dx_m : dx_file_m;
    *dy_m = told ? hints->dy_m > 0 ? hints->dy_m : hints->dx_m : dy_file_m;
    if (isnan(*dx_m) || isnan(*dy_m))
        return err_set(e, ERR_DATA,
                       "the file does not say its node spacing: give --pixel (such as 0.25um)");
    if (told && (differs(*dx_m, dx_file_m) || differs(*dy_m, dy_file_m)))
        log_warn("node spacing %g x %g m is used, the file says %g x %g m", *dx_m, *dy_m, dx_file_m,
                 dy_file_m);
    return true;
}

static bool check_heights(const struct hfield *hf, struct err *e)
{
    const size_t n = (size_t)hf->nx * (size_t)hf->ny;
    for (size_t k = 0; k < n; k++)
        if (isinf(hf->z[k]))
            return err_set(e, ERR_DATA, "node (%zu, %zu) is infinite", k % (size_t)hf->nx,
                           k / (size_t)hf->nx);
    return true;
}

bool hfield_read(struct hfield *hf, const char *path, const struct hfield_hints *hints,
                 struct err *e)
{
    const struct codec *c = codec_of(path);
    if (!c)
        return err_set(e, ERR_DATA,
                       "%s: not a height field by its name: can read .gsf .x3p .exr .pfm .tif "
                       ".png .di .spm .000",
                       path);
    struct hfield out = {0};
    if (!c->read(&out, path, hints, e) || !check_heights(&out, e)) {
        hfield_finish(&out);
        return err_in(e, "%s", path);
    }
    *hf = out;
    return true;
}

bool hfield_write(const struct hfield *hf, const char *path, const struct hfield_hints *hints,
                  struct err *e)
{
    const struct codec *c = codec_of(path);
    if (!c || !c->write)
        return err_set(e, ERR_DATA, "%s: cannot write '%s': must be .gsf .x3p .exr .pfm .tif .png",
                       path, path_ext(path));
    struct outfile o;
    if (!outfile_open(&o, path, e))
        return false;
    if (!c->write(hf, o.tmp, hints, e)) {
        outfile_drop(&o);
        return err_in(e, "%s", path);
    }
    return outfile_commit(&o, e);
}
