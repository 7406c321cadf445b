// cmd_bokeh.c - nacre bokeh: the height field that an out-of-focus highlight shows.
#define _GNU_SOURCE
#include "core/hfield_file.h"
#include "core/imgfile.h"
#include "core/log.h"
#include "process/bokeh.h"
#include "ui/commands.h"
#include "ui/linear.h"
#include <math.h>
#include <string.h>

struct args {
    const char *calibration, *channel, *response, *lines, *lattice, *edge, *out;
    double f_number;
    bool keep_tilt;
};

static const struct opt opts[] = {
    {"calibration", OPT_FILE, offsetof(struct args, calibration), "FILE",
     .help = "record of nacre calib bokeh", .needed = true},
    {"channel", OPT_CHOICE, offsetof(struct args, channel), "record|r|g|b", "record",
     "the channel to read, with what the record has of it (record: its first, blue unless told)"},
    {"response", OPT_FILE, offsetof(struct args, response), "auto|srgb|linear|FILE", "auto",
     "what 8-bit samples mean: sRGB (auto, with a note), light itself, or by a record of nacre "
     "calib response; others are light"},
    {"lines", OPT_CHOICE, offsetof(struct args, lines), "no|yes|auto", "auto",
     "fold the lines of a grating or CD into one sharp profile; auto: where straight lines explain "
     "95 % of the picture"},
    {"lattice", OPT_CHOICE, offsetof(struct args, lattice), "no|auto", "auto",
     "fold what repeats in two directions into one sharp cell; auto: where a lattice explains 99 % "
     "of the picture"},
    {"edge", OPT_CHOICE, offsetof(struct args, edge), "keep|window|tile", "keep",
     "of the square: as it is, faded to the mean height, or a tile: cut so that copies side by "
     "side "
     "continue each other; a fold may be turned to its own sides for that (tile_turned_deg)"},
    {"f-number", OPT_NUM, offsetof(struct args, f_number), "N", NULL,
     "of the lens, for the cut-off in the file (default: the picture's, else 5.6)"},
    {"keep-tilt", OPT_FLAG, offsetof(struct args, keep_tilt),
     .help = "do not subtract the mean plane"},
    {"o", OPT_FILE, offsetof(struct args, out), "HEIGHT",
     .help = "the height field: .gsf .x3p .exr .pfm .tif", .needed = true},
    {0},
};

static void report(const struct bokeh_result *r, const struct bokeh_options *opt,
                   const struct hfield *hf, struct doc *d)
{
    doc_text(d, "channel", r->channel);
    if (r->score[1] > 0)
        doc_nums(d, "channel_scores_rgb", r->score, 3);
    doc_nums(d, "disc_px", (double[]){r->disc.cx_px, r->disc.cy_px, r->disc.radius_px}, 3);
    doc_int(d, "iterations", r->iterations);
    doc_bool(d, "averaged_along_lines", r->fold == FOLD_LINES);
    doc_text(d, "folded", (const char *[]){"no", "lines", "lattice"}[r->fold]);
    doc_int(d, "nx", hf->nx);
    doc_int(d, "ny", hf->ny);
    doc_num(d, "pixel_m", hf->dx_m);
    for (int k = 0; k < r->n_periods; k++) {
        struct doc *item = doc_item(d, "periods");
        doc_num(item, "period_m", r->period[k].period_m);
        doc_num(item, "direction_deg", r->period[k].direction_rad * 180 / M_PI);
        doc_num(item, "amplitude_m", r->period[k].amplitude_m);
    }
    doc_num(d, "height_sd_m", r->sd_m);
    double lo = NAN, hi = NAN;
    hfield_range(hf, &lo, &hi);
    doc_num(d, "height_range_m", hi - lo);
    if (opt->edge == BOKEH_TILE && r->fold)
        doc_num(d, "tile_turned_deg", r->turned_rad * 180 / M_PI);
    if (opt->edge == BOKEH_TILE)
        doc_num(d, r->fold ? "tile_strain" : "tile_seam", r->fold ? r->strain : r->seam);
    doc_num(d, "cutoff_per_m", r->cutoff_per_m);
}

static bool run(const void *args_, struct cli *cli, struct err *e)
{
    const struct args *args = args_;
    static const char *const names[] = {"R", "G", "B"};
    struct bokeh_options opt = {.level = !args->keep_tilt,
                                .lattice = !strcmp(args->lattice, "auto"),
                                .f_number = args->f_number};
    if (strcmp(args->channel, "record"))
        opt.channel = names[strchr("rgb", args->channel[0]) - "rgb"];
    opt.lines = !strcmp(args->lines, "no")    ? BOKEH_2D
                : !strcmp(args->lines, "yes") ? BOKEH_1D
                                              : BOKEH_1D_IF_LINES;
    opt.edge = !strcmp(args->edge, "window") ? BOKEH_WINDOW
               : !strcmp(args->edge, "tile") ? BOKEH_TILE
                                             : BOKEH_KEEP;
    if (args->f_number <= 0)
        return err_set(e, ERR_DATA, "--f-number %g: must be positive", args->f_number);
    struct bokeh_record rec;
    struct image im = {0};
    struct hfield hf = {0};
    struct bokeh_result res;
    bool ok = bokeh_record_read(&rec, args->calibration, e) &&
              image_read(&im, cli->operand[0], e) && image_check_finite(&im, cli->operand[0], e) &&
              bokeh_record_fits(&rec, args->calibration, &im, e) &&
              make_linear_by(&im, cli->operand[0], args->response, e);
    if (ok && !bokeh_height(&im, &rec, &opt, &hf, &res, e))
        ok = err_in(e, "%s", cli->operand[0]);
    if (ok) {
        meta_set_text(&hf.meta, "nacre.version", NACRE_VERSION);
        meta_set_text(&hf.meta, "nacre.command", cli->line);
        ok = hfield_write(&hf, args->out, NULL, e);
    }
    if (ok)
        report(&res, &opt, &hf, cli->doc);
    hfield_finish(&hf);
    image_finish(&im);
    return ok;
}

const struct command cmd_bokeh = {
    .name = "bokeh",
    .summary = "the height field that an out-of-focus highlight shows",
    .operands = "IMAGE",
    .min_operands = 1,
    .max_operands = 1,
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes = "First the rig, from a known grating; then samples photographed with the same focus:\n"
             "  nacre calib bokeh grating.png --lines 600/mm --blaze 13deg -o bokeh.yaml\n"
             "  nacre bokeh sample.png --calibration bokeh.yaml -o sample.gsf",
    .run = run,
};
