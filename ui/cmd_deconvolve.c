// cmd_deconvolve.c - nacre deconvolve: Richardson-Lucy with a Gaussian or a measured PSF.
#define _GNU_SOURCE
#include "core/imgfile.h"
#include "core/log.h"
#include "core/mem.h"
#include "process/deconvolve.h"
#include "ui/commands.h"
#include "ui/linear.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct args {
    double sigma_px, tv;
    const char *psf, *iterations, *response, *out;
    int most;
    bool accelerate;
};

static const struct opt opts[] = {
    {"sigma", OPT_NUM, offsetof(struct args, sigma_px), "PX", NULL,
     "the Gaussian's width in pixels", UNIT_PX},
    {"psf", OPT_FILE, offsetof(struct args, psf), "IMAGE",
     .help = "a measured PSF in place of the Gaussian, its centre at the middle sample"},
    {"iterations", OPT_TEXT, offsetof(struct args, iterations), "N|auto", "auto",
     "a number, or auto: stop where held-out samples are predicted best"},
    {"most", OPT_INT, offsetof(struct args, most), "N", "400", "limit of the automatic choice"},
    {"accelerate", OPT_FLAG, offsetof(struct args, accelerate),
     .help = "extrapolate along the path (Biggs & Andrews 1997)"},
    {"tv", OPT_NUM, offsetof(struct args, tv), "W", "0", "weight of total variation, 0 to 0.1"},
    {"response", OPT_FILE, offsetof(struct args, response), "auto|srgb|linear|FILE", "auto",
     "what 8-bit samples mean: sRGB (auto, with a note), light itself, or by a record of nacre "
     "calib response; others are light"},
    {"o", OPT_FILE, offsetof(struct args, out), "OUT", .help = "the sharp picture", .needed = true},
    {0},
};

static bool parse_iterations(const char *text, int *n, struct err *e)
{
    *n = 0;
    if (!strcmp(text, "auto"))
        return true;
    char *end;
    const long value = strtol(text, &end, 10);
    if (end == text || *end)
        return err_set(e, ERR_USAGE, "--iterations: '%.60s' is neither a whole number nor auto",
                       text);
    if (value < 1 || value > 100000)
        return err_set(e, ERR_DATA, "--iterations %ld: must be 1 to 100000", value);
    *n = (int)value;
    return true;
}

static struct blur *open_blur(const struct args *args, int w, int h, struct err *e)
{
    if (!args->psf)
        return blur_gauss(w, h, args->sigma_px, e);
    struct image psf = {0}, one = {0};
    struct blur *b = NULL;
    if (image_read(&psf, args->psf, e) && image_check_finite(&psf, args->psf, e) &&
        image_channel(&psf, 0, &one, e)) {
        b = blur_psf(w, h, one.px, one.w, one.h, e);
        if (!b)
            err_in(e, "%s", args->psf);
    }
    image_finish(&psf);
    image_finish(&one);
    return b;
}

// Channel by channel; a picture of several channels reports each.
static bool run_channels(struct image *im, struct blur *b, const struct deconvolve_options *opt,
                         struct cli *cli, struct err *e)
{
    const size_t n = (size_t)im->w * (size_t)im->h;
    float *sharp = sample_alloc(n, sizeof *sharp, "picture", e);
    bool ok = sharp != NULL;
    for (int c = 0; ok && c < im->nc; c++) {
        struct image one = {0};
        struct deconvolve_result res;
        ok = image_channel(im, c, &one, e) &&
             deconvolve(b, im->w, im->h, one.px, opt, sharp, &res, e);
        for (size_t k = 0; ok && k < n; k++)
            im->px[k * (size_t)im->nc + (size_t)c] = sharp[k];
        if (ok) {
            struct doc *item = im->nc > 1 ? doc_item(cli->doc, "channels") : cli->doc;
            doc_int(item, "iterations", res.iterations);
            doc_num(item, "residual_rms", res.residual);
            doc_num(item, "flux", res.flux);
            doc_num(item, "flux_error", res.flux / res.flux_in - 1);
            if (res.negative)
                log_warn("%ld samples below 0 were taken as 0", res.negative);
            if (res.reached_most)
                log_warn("the held-out residual still fell after %d iterations: --most allows more",
                         res.iterations);
            meta_set_num(&im->meta, "nacre.iterations", res.iterations);
        }
        image_finish(&one);
    }
    free(sharp);
    return ok;
}

static bool run(const void *args_, struct cli *cli, struct err *e)
{
    const struct args *args = args_;
    const char *path = cli->operand[0];
    struct deconvolve_options opt = {
        .most = args->most, .accelerate = args->accelerate, .tv = args->tv};
    if (!args->psf && isnan(args->sigma_px))
        return err_set(e, ERR_USAGE, "needs --sigma PX or --psf IMAGE");
    if (args->psf && !isnan(args->sigma_px))
        return err_set(e, ERR_USAGE, "--sigma and --psf exclude each other");
    struct image im = {0};
    struct blur *b = NULL;
    bool ok = parse_iterations(args->iterations, &opt.iterations, e) && image_read(&im, path, e) &&
              image_check_finite(&im, path, e) && (b = open_blur(args, im.w, im.h, e)) &&
              make_linear_by(&im, path, args->response, e);
    if (ok && !run_channels(&im, b, &opt, cli, e))
        ok = err_in(e, "%s", path);
    if (ok) {
        meta_set_text(&im.meta, "nacre.version", NACRE_VERSION);
        meta_set_text(&im.meta, "nacre.command", cli->line);
        ok = image_write(&im, args->out, e);
    }
    blur_free(b);
    image_finish(&im);
    return ok;
}

const struct command cmd_deconvolve = {
    .name = "deconvolve",
    .summary = "undo a known blur (Richardson-Lucy)",
    .operands = "IMAGE",
    .min_operands = 1,
    .max_operands = 1,
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes = "The result is never negative and its sum is the picture's light. Borders reflect.\n\n"
             "  nacre deconvolve bokeh.tif --sigma 1.9 --iterations auto -o sharp.exr",
    .run = run,
};
