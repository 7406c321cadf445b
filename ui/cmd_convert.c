// cmd_convert.c - nacre convert: a picture from one file format into another.
#define _GNU_SOURCE
#include "core/imgfile.h"
#include "core/log.h"
#include "core/spectrum.h"
#include "ui/commands.h"
#include <math.h>
#include <string.h>

struct args {
    double exposure; // stops
};

static const struct opt opts[] = {
    {"exposure", OPT_NUM, offsetof(struct args, exposure), "STOPS", "0",
     "multiply every sample by 2^STOPS"},
    {0},
};

static bool is_display(const char *path)
{
    const char *ext = path_ext(path);
    return !strcmp(ext, ".png") || !strcmp(ext, ".jpg") || !strcmp(ext, ".jpeg");
}

// 8-bit pictures carry the sRGB curve: take it off, alpha stays.
static void linearise(struct image *im)
{
    const size_t n = (size_t)im->w * (size_t)im->h * (size_t)im->nc;
    for (size_t k = 0; k < n; k++)
        if (im->nc != 4 || k % 4 != 3)
            im->px[k] = (float)srgb_decode((double)im->px[k]);
    meta_set_num(&im->meta, "nacre.encoded", 0);
}

// Formats of three channels get the colour channels of a picture that has more.
static bool drop_extra(struct image *im, const char *out, struct err *e)
{
    static const char *const sets[][3] = {{"R", "G", "B"}, {"X", "Y", "Z"}};
    const char *ext = path_ext(out);
    if (im->nc == 1 || im->nc == 3 || (strcmp(ext, ".pfm") && strcmp(ext, ".hdr")))
        return true;
    for (int s = 0; s < 2; s++) {
        int from[3];
        for (int c = 0; c < 3; c++)
            from[c] = image_channel_index(im, sets[s][c]);
        if (from[0] < 0 || from[1] < 0 || from[2] < 0)
            continue;
        struct image colour;
        if (!image_init(&colour, im->w, im->h, 3, e))
            return false;
        const size_t n = (size_t)im->w * (size_t)im->h;
        for (size_t k = 0; k < n; k++)
            for (int c = 0; c < 3; c++)
                colour.px[3 * k + (size_t)c] = im->px[k * (size_t)im->nc + (size_t)from[c]];
        meta_copy(&colour.meta, &im->meta);
        meta_set_text(&colour.meta, "channels", s ? "X,Y,Z" : "R,G,B");
        log_note("only the channels %s go into a %s file", s ? "X,Y,Z" : "R,G,B", ext);
        image_finish(im);
        *im = colour;
        return true;
    }
    return true; // the writer says what it lacks
}

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct args *a = args;
    const char *in = cli->operand[0], *out = cli->operand[1];
    struct image im = {0};
    if (!image_read(&im, in, e))
        return false;
    double encoded = 0;
    if (meta_num(&im.meta, "nacre.encoded", &encoded) && encoded > 0) {
        linearise(&im);
        if (!is_display(out))
            log_note("%s: 8-bit samples taken as sRGB and made linear", in);
    }
    const float gain = (float)exp2(a->exposure);
    const size_t n = (size_t)im.w * (size_t)im.h * (size_t)im.nc;
    for (size_t k = 0; k < n && a->exposure != 0; k++)
        im.px[k] *= gain;
    meta_set_text(&im.meta, "nacre.version", NACRE_VERSION);
    meta_set_text(&im.meta, "nacre.command", cli->line);
    const bool ok = drop_extra(&im, out, e) && image_write(&im, out, e);
    if (ok) {
        doc_text(cli->doc, "output", out);
        doc_int(cli->doc, "width", im.w);
        doc_int(cli->doc, "height", im.h);
        doc_int(cli->doc, "channels", im.nc);
    }
    image_finish(&im);
    return ok;
}

const struct command cmd_convert = {
    .name = "convert",
    .summary = "a picture or height field in another file format",
    .operands = "IN OUT",
    .min_operands = 2,
    .max_operands = 2,
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes = "Reads .exr .pfm .hdr .png .jpg .tif .dng and camera raw; writes .exr .pfm .hdr and\n"
             "16-bit .tif (linear), .png .jpg (display sRGB). 8-bit pictures are taken as sRGB.\n"
             "  nacre convert radiance.exr look.png --exposure -2",
    .run = run,
};
