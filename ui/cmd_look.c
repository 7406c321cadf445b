// cmd_look.c - nacre look: any picture, table or height field as something to look at.
#define _GNU_SOURCE
#include "core/colormap.h"
#include "core/hfield_file.h"
#include "core/imgfile.h"
#include "core/mem.h"
#include "core/sort.h"
#include "core/spectrum.h"
#include "ui/commands.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct args {
    const char *exposure, *channel;
    double decades;
};

static const struct opt opts[] = {
    {"exposure", OPT_TEXT, offsetof(struct args, exposure), "STOPS|auto", "auto",
     "auto: the 99th percentile of the lit pixels becomes white"},
    {"false-color", OPT_NUM, offsetof(struct args, decades), "DECADES", NULL,
     "one channel on a logarithmic colour scale that ends at the peak"},
    {"channel", OPT_TEXT, offsetof(struct args, channel), "NAME", NULL,
     "the channel for --false-color (default: the first)"},
    {0},
};

// The value below which a share of the positive samples of all channels lies; 0 when there is none.
static double percentile(const struct image *im, double share)
{
    const size_t n = (size_t)im->w * (size_t)im->h * (size_t)im->nc;
    float *lit = xcalloc(n, sizeof *lit);
    size_t count = 0;
    for (size_t k = 0; k < n; k++)
        if (im->px[k] > 0 && isfinite(im->px[k]))
            lit[count++] = im->px[k];
    sort_floats(lit, count);
    const double value = count ? (double)lit[(size_t)(share * (double)(count - 1))] : 0;
    free(lit);
    return value;
}

static void set_colour(float px[3], double v)
{
    unsigned char rgb[3];
    colormap(v, rgb);
    for (int q = 0; q < 3; q++)
        px[q] = (float)srgb_decode(rgb[q] / 255.0);
}

static void false_colour(const struct image *im, int c, double decades, struct image *out)
{
    const size_t n = (size_t)im->w * (size_t)im->h;
    double peak = 0;
    for (size_t k = 0; k < n; k++)
        peak = fmax(peak, (double)im->px[k * (size_t)im->nc + (size_t)c]); // fmax passes over NAN
    for (size_t k = 0; k < n; k++) {
        const double v = (double)im->px[k * (size_t)im->nc + (size_t)c];
        set_colour(out->px + 3 * k, isnan(v) ? NAN : 1 + log10(fmax(v / peak, 1e-30)) / decades);
    }
}

// Linear sRGB of a grey, RGB or XYZ picture.
static void to_rgb(const struct image *im, struct image *out)
{
    const bool is_xyz = image_channel_index(im, "X") == 0;
    const size_t n = (size_t)im->w * (size_t)im->h;
    for (size_t k = 0; k < n; k++) {
        const float *from = im->px + k * (size_t)im->nc;
        double rgb[3];
        for (int c = 0; c < 3; c++)
            rgb[c] = (double)from[im->nc >= 3 ? c : 0];
        if (is_xyz)
            xyz_to_rgb(rgb, rgb);
        for (int c = 0; c < 3; c++)
            out->px[3 * k + (size_t)c] = (float)rgb[c];
    }
}

static bool expose(struct image *rgb, const char *text, double *stops, struct err *e)
{
    if (!strcmp(text, "auto")) {
        const double white = percentile(rgb, 0.99);
        *stops = white > 0 ? -log2(white) : 0;
    } else if (!quantity_parse(text, UNIT_NONE, stops, e)) {
        return err_in(e, "--exposure (or auto)");
    }
    const float gain = (float)exp2(*stops);
    const size_t n = (size_t)rgb->w * (size_t)rgb->h * 3;
    for (size_t k = 0; k < n; k++)
        rgb->px[k] *= gain;
    return true;
}

// A height field on the linear colour scale from its lowest to its highest node.
static bool look_at_heights(const char *in, const char *to, struct doc *doc, struct err *e)
{
    struct hfield hf = {0};
    struct image out = {0};
    double lo_m = 0, hi_m = 0;
    bool ok =
        hfield_read(&hf, in, NULL, e) && image_init(&out, hf.nx, hf.ny, 3, e) &&
        (hfield_range(&hf, &lo_m, &hi_m) || err_set(e, ERR_DATA, "%s: no node was measured", in));
    if (ok) {
        const size_t n = (size_t)hf.nx * (size_t)hf.ny;
        for (size_t k = 0; k < n; k++)
            set_colour(out.px + 3 * k, ((double)hf.z[k] - lo_m) / (hi_m > lo_m ? hi_m - lo_m : 1));
        doc_num(doc, "lowest_m", lo_m);
        doc_num(doc, "highest_m", hi_m);
        ok = image_write(&out, to, e);
    }
    hfield_finish(&hf);
    image_finish(&out);
    return ok;
}

static bool run(const void *args_, struct cli *cli, struct err *e)
{
    const struct args *args = args_;
    const char *in = cli->operand[0], *to = cli->operand[1];
    if (!isnan(args->decades) && !(args->decades > 0))
        return err_set(e, ERR_DATA, "--false-color %g: must be above 0", args->decades);
    if (path_is_height(in))
        return look_at_heights(in, to, cli->doc, e);
    struct image im = {0}, out = {0};
    bool ok = image_read(&im, in, e) && image_init(&out, im.w, im.h, 3, e);
    if (ok && isnan(args->decades)) {
        double stops = 0;
        to_rgb(&im, &out);
        ok = expose(&out, args->exposure, &stops, e);
        doc_num(cli->doc, "exposure_stops", stops);
    } else if (ok) {
        const int c = args->channel ? image_channel_index(&im, args->channel) : 0;
        ok = c >= 0 || err_set(e, ERR_DATA, "%s: no channel '%s'", in, args->channel);
        if (ok)
            false_colour(&im, c, args->decades, &out);
    }
    ok = ok && image_write(&out, to, e);
    image_finish(&im);
    image_finish(&out);
    return ok;
}

const struct command cmd_look = {
    .name = "look",
    .summary =
        "make a picture to look at: exposed, XYZ as sRGB, or in false colour; of heights too",
    .operands = "IN OUT.png",
    .min_operands = 2,
    .max_operands = 2,
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes = "  nacre look radiance.exr radiance.png --false-color 5\n"
             "  nacre look table.exr table.png\n"
             "  nacre look height.gsf height.png",
    .run = run,
};
