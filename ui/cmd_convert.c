// cmd_convert.c - nacre convert: a picture from one file format into another.
#define _GNU_SOURCE
#include "core/hfield_file.h"
#include "core/imgfile.h"
#include "core/log.h"
#include "ui/commands.h"
#include "ui/linear.h"
#include <math.h>
#include <string.h>

struct args {
    double exposure; // stops
    const char *pixel;
    double z_scale_m;
};

static const struct opt opts[] = {
    {"exposure", OPT_NUM, offsetof(struct args, exposure), "STOPS", "0",
     "multiply every sample by 2^STOPS"},
    {"pixel", OPT_LIST, offsetof(struct args, pixel), "D[,D]", NULL,
     "node spacing of a height field that does not state it (0.25um)"},
    {"z-scale", OPT_NUM, offsetof(struct args, z_scale_m), "H", NULL,
     "height of white in a height field as .tif or .png", UNIT_M},
    {0},
};

static bool is_display(const char *path)
{
    const char *ext = path_ext(path);
    return !strcmp(ext, ".png") || !strcmp(ext, ".jpg") || !strcmp(ext, ".jpeg");
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

static void provenance(struct meta *m, const struct cli *cli)
{
    meta_set_text(m, "nacre.version", NACRE_VERSION);
    meta_set_text(m, "nacre.command", cli->line);
}

static bool is_scaled(const char *path) // 16-bit samples, which need --z-scale
{
    const char *ext = path_ext(path);
    return !strcmp(ext, ".png") || !strcmp(ext, ".tif") || !strcmp(ext, ".tiff");
}

static bool convert_heights(const struct args *a, struct cli *cli, struct err *e)
{
    const char *in = cli->operand[0], *out = cli->operand[1];
    double d[2] = {0, 0};
    if (a->pixel && cli_numbers(a->pixel, UNIT_M, d, 2, e) < 1)
        return err_in(e, "--pixel");
    const double z = a->z_scale_m > 0 ? a->z_scale_m : 0;
    const bool for_output = is_scaled(out) && !is_scaled(in);
    const struct hfield_hints from = {d[0], d[1], for_output ? 0 : z}, to = {.z_scale_m = z};
    struct hfield hf = {0};
    if (!hfield_read(&hf, in, &from, e))
        return false;
    provenance(&hf.meta, cli);
    const bool ok = hfield_write(&hf, out, &to, e);
    double lo = NAN, hi = NAN;
    hfield_range(&hf, &lo, &hi);
    if (ok) {
        doc_text(cli->doc, "output", out);
        doc_int(cli->doc, "width", hf.nx);
        doc_int(cli->doc, "height", hf.ny);
        doc_nums(cli->doc, "spacing_m", (double[]){hf.dx_m, hf.dy_m}, 2);
        doc_nums(cli->doc, "range_m", (double[]){lo, hi}, 2);
        doc_int(cli->doc, "missing", hfield_missing(&hf));
    }
    hfield_finish(&hf);
    return ok;
}

static bool convert_picture(const struct args *a, struct cli *cli, struct err *e)
{
    const char *in = cli->operand[0], *out = cli->operand[1];
    struct image im = {0};
    if (!image_read(&im, in, e))
        return false;
    make_linear(&im, is_display(out) ? NULL : in); // there the same curve goes on again
    const float gain = (float)exp2(a->exposure);
    const size_t n = (size_t)im.w * (size_t)im.h * (size_t)im.nc;
    for (size_t k = 0; k < n && a->exposure != 0; k++)
        im.px[k] *= gain;
    provenance(&im.meta, cli);
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

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct args *a = args;
    const bool heights = path_is_height(cli->operand[0]) || path_is_height(cli->operand[1]) ||
                         a->pixel || !isnan(a->z_scale_m);
    if (!isnan(a->z_scale_m) && !(a->z_scale_m > 0))
        return err_set(e, ERR_DATA, "--z-scale %g m: must be positive", a->z_scale_m);
    return heights ? convert_heights(a, cli, e) : convert_picture(a, cli, e);
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
             "Height fields: .gsf .x3p and Nanoscope by name, .exr .pfm .tif .png when --pixel or\n"
             "--z-scale is given.\n"
             "  nacre convert radiance.exr look.png --exposure -2\n"
             "  nacre convert scan.di scan.x3p",
    .run = run,
};
