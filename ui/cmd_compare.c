// cmd_compare.c - nacre compare: how far one picture or table is from another.
#define _GNU_SOURCE
#include "core/colormap.h"
#include "core/image.h"
#include "core/imgfile.h"
#include "core/spectrum.h"
#include "ui/commands.h"
#include <math.h>
#include <string.h>

struct args {
    const char *out, *scale;
};

static const struct opt opts[] = {
    {"scale", OPT_CHOICE, offsetof(struct args, scale), "one|best", "one",
     "compare as they are, or after the one factor that fits best"},
    {"o", OPT_FILE, offsetof(struct args, out), "MAP.png",
     .help = "write the error as a false-colour picture"},
    {0},
};

struct difference {
    double sum_aa, sum_ab, sum_bb; // over all compared samples
    double scale;                  // a is multiplied by it
    double l2, rmse, worst, peak;
    long samples, left_out;
};

// Colour channels only: a table's cover, a picture's variance and mask say where to compare, not
// what.
static int colour_channels(const struct image *im)
{
    return im->nc >= 3 ? 3 : 1;
}

static bool is_left_out(const struct image *im, int cover, size_t k)
{
    return cover >= 0 && !(im->px[k * (size_t)im->nc + (size_t)cover] > 0);
}

static struct difference compare(const struct image *a, const struct image *b, bool best,
                                 struct image *map)
{
    struct difference d = {.scale = 1};
    const int nc = colour_channels(a), cover = image_channel_index(a, "cover");
    const size_t n = (size_t)a->w * (size_t)a->h;
    for (int pass = 0; pass < 2; pass++) {
        double sum = 0;
        for (size_t k = 0; k < n; k++) {
            double pixel = 0;
            bool skip = is_left_out(a, cover, k);
            for (int c = 0; c < nc && !skip; c++)
                skip = !isfinite(a->px[k * (size_t)a->nc + (size_t)c]) ||
                       !isfinite(b->px[k * (size_t)b->nc + (size_t)c]);
            for (int c = 0; c < nc && !skip; c++) {
                const double x = (double)a->px[k * (size_t)a->nc + (size_t)c],
                             y = (double)b->px[k * (size_t)b->nc + (size_t)c];
                if (pass == 0) {
                    d.sum_aa += x * x;
                    d.sum_ab += x * y;
                    d.sum_bb += y * y;
                    d.peak = fmax(d.peak, fabs(y));
                    d.samples++;
                } else {
                    const double e = d.scale * x - y;
                    sum += e * e;
                    pixel = fmax(pixel, fabs(e));
                }
            }
            d.left_out += skip && pass == 0;
            d.worst = fmax(d.worst, pixel);
            if (map && pass == 1)
                map->px[k] = skip ? NAN : (float)pixel;
        }
        if (pass == 0 && best && d.sum_aa > 0)
            d.scale = d.sum_ab / d.sum_aa;
        if (pass == 1) {
            d.l2 = sqrt(sum / d.sum_bb);
            d.rmse = sqrt(sum / (double)d.samples);
        }
    }
    return d;
}

// The error from 1e-4 of the worst (dark) to the worst (bright), on a logarithmic scale.
static bool write_map(const struct image *map, double worst, const char *path, struct err *e)
{
    struct image picture;
    if (!image_init(&picture, map->w, map->h, 3, e))
        return false;
    const size_t n = (size_t)map->w * (size_t)map->h;
    for (size_t k = 0; k < n; k++) {
        unsigned char rgb[3];
        const double err = (double)map->px[k];
        colormap(isnan(err) ? NAN : 1 + log10(fmax(err / worst, 1e-12)) / 4, rgb);
        for (int c = 0; c < 3; c++)
            picture.px[k * 3 + (size_t)c] = (float)srgb_decode(rgb[c] / 255.0);
    }
    const bool ok = image_write(&picture, path, e);
    image_finish(&picture);
    return ok;
}

static bool run(const void *args_, struct cli *cli, struct err *e)
{
    const struct args *args = args_;
    struct image a = {0}, b = {0}, map = {0};
    bool ok = image_read(&a, cli->operand[0], e) && image_read(&b, cli->operand[1], e);
    if (ok && (a.w != b.w || a.h != b.h || colour_channels(&a) != colour_channels(&b)))
        ok = err_set(e, ERR_DATA, "%s is %d x %d x %d, %s is %d x %d x %d: sizes must agree",
                     cli->operand[0], a.w, a.h, colour_channels(&a), cli->operand[1], b.w, b.h,
                     colour_channels(&b));
    ok = ok && image_init(&map, a.w, a.h, 1, e);
    if (ok) {
        const struct difference d = compare(&a, &b, !strcmp(args->scale, "best"), &map);
        if (!d.samples || !(d.sum_bb > 0))
            ok = err_set(e, ERR_DATA,
                         "%s: nothing to compare with: all samples are zero, missing or uncovered",
                         cli->operand[1]);
        if (ok && args->out)
            ok = write_map(&map, d.worst, args->out, e);
        doc_num(cli->doc, "relative_l2", d.l2);
        doc_num(cli->doc, "rmse", d.rmse);
        doc_num(cli->doc, "worst", d.worst);
        doc_num(cli->doc, "worst_of_peak", d.worst / d.peak);
        doc_num(cli->doc, "peak", d.peak);
        doc_num(cli->doc, "scale", d.scale);
        doc_int(cli->doc, "samples", d.samples);
        doc_int(cli->doc, "pixels_left_out", d.left_out);
    }
    image_finish(&a);
    image_finish(&b);
    image_finish(&map);
    return ok;
}

const struct command cmd_compare = {
    .name = "compare",
    .summary = "tell how far a picture or table is from another",
    .operands = "A TRUTH",
    .min_operands = 2,
    .max_operands = 2,
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes = "Errors are relative to TRUTH. Samples that are NaN in either, or that A's cover "
             "channel marks as not\n"
             "measured, are left out and counted. The map's scale is logarithmic: black is 1e-4 of "
             "TRUTH's peak,\n"
             "1e-4 of it, grey not compared.",
    .run = run,
};
