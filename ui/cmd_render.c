// cmd_render.c - nacre render: a scene file to a picture.
#define _GNU_SOURCE
#include "core/imgfile.h"
#include "core/log.h"
#include "render/cpu.h"
#include "render/display.h"
#include "render/gl_progress.h"
#include "render/view.h"
#include "ui/commands.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

struct args {
    const char *out, *size, *backend, *table, *factors, *tables, *environment, *illuminant,
        *exposure, *with, *against, *view;
    double tolerance, decades;
    int samples;
    bool reference;
};

static const struct opt opts[] = {
    {"o", OPT_FILE, offsetof(struct args, out), "OUT",
     .help = "picture to write: .exr .pfm .hdr linear radiance, .png .jpg as a screen shows it",
     .needed = true},
    {"size", OPT_TEXT, offsetof(struct args, size), "WxH",
     .help = "pixels (default: as the scene says, else 960x720)"},
    {"backend", OPT_CHOICE, offsetof(struct args, backend), "gl|cpu", "gl",
     "OpenGL without a display, or the CPU in double"},
    {"reference", OPT_FLAG, offsetof(struct args, reference),
     .help =
         "CPU with full integration: 64 rays a pixel, over the lens and the area of each light"},
    {"samples", OPT_INT, offsetof(struct args, samples), "N", "4",
     "N x N pictures, whose mean is over each pixel, the lens, the area of each light and "
     "the room; 1: one, with each pixel's middle and lights as points"},
    {"table", OPT_FILE, offsetof(struct args, table), "FILE",
     .help = "diffraction table of the sample, instead of the scene's"},
    {"factors", OPT_FILE, offsetof(struct args, factors), "FILE",
     .help = "products of filters (nacre factor) in the place of the sample's table"},
    {"tables", OPT_FILE, offsetof(struct args, tables), "DIR", "gallery-out/tables",
     "where to look for files that are not beside the scene"},
    {"environment", OPT_FILE, offsetof(struct args, environment), "MAP",
     .help = "lat-long map in the place of the scene's"},
    {"illuminant", OPT_TEXT, offsetof(struct args, illuminant), "NAME|FILE",
     .help = "spectrum of the lights instead of the scene's, where samples have slits or a photo"},
    {"exposure", OPT_TEXT, offsetof(struct args, exposure), "STOPS|auto",
     .help = "exposure of a .png or .jpg, instead of the scene's"},
    {"with", OPT_CHOICE, offsetof(struct args, with), "none|table|slits|g04",
     .help = "how the sample diffracts, instead of what the scene chose"},
    {"view", OPT_CHOICE, offsetof(struct args, view), "color|false|split|difference", "color",
     "false: luminance in false colour; split and difference: --against another picture"},
    {"against", OPT_CHOICE, offsetof(struct args, against), "none|table|slits|g04|cpu|reference",
     .help = "the other picture: the same with another diffraction, or by another renderer"},
    {"decades", OPT_NUM, offsetof(struct args, decades), "D", "4", "of the false colour's scale"},
    {"tolerance", OPT_NUM, offsetof(struct args, tolerance), "E",
     .help = "use only as many of a set of tables as this relative error needs"},
    {0},
};

static bool parse_size(const char *text, int *w, int *h, struct err *e)
{
    int end = 0;
    if (sscanf(text, "%dx%d%n", w, h, &end) != 2 || text[end])
        return err_set(e, ERR_USAGE, "--size: '%.40s' is not a size such as 1920x1080", text);
    if (*w < 1 || *h < 1 || *w > 16384 || *h > 16384)
        return err_set(e, ERR_DATA, "--size: %dx%d is out of range: must be 1x1 to 16384x16384", *w,
                       *h);
    return true;
}

static bool parse_options(const struct args *a, struct scene_options *o, struct err *e)
{
    *o = (struct scene_options){.table = a->table,
                                .factors = a->factors,
                                .tables = a->tables,
                                .environment = a->environment,
                                .illuminant = a->illuminant,
                                .exposure_ev = NAN,
                                .still = true};
    if (a->size && !parse_size(a->size, &o->w, &o->h, e))
        return false;
    if (!a->exposure)
        return true;
    o->exposure_auto = !strcmp(a->exposure, "auto");
    return o->exposure_auto || quantity_parse(a->exposure, UNIT_NONE, &o->exposure_ev, e) ||
           err_in(e, "--exposure");
}

static void tell_work(const struct gl_work *w, struct cli *cli)
{
    doc_num(cli->doc, "skipped.shading", 1 - (double)w->shaded / (double)w->shaded_most);
    if (w->looked_up_most)
        doc_num(cli->doc, "skipped.diffraction",
                1 - (double)w->looked_up / (double)w->looked_up_most);
    if (!isnan(w->error))
        doc_num(cli->doc, "error", w->error);
    if (w->tables) {
        doc_int(cli->doc, "tables", w->tables);
        doc_int(cli->doc, "tables_used", w->tables_used);
    }
}

static bool cpu_draw(const struct args *a, struct scene *s, bool reference, struct image *im,
                     struct err *e)
{
    return a->samples > 1 && !reference ? cpu_render_passes(s, a->samples, im, e)
                                        : cpu_render(s, reference, im, e);
}

static bool gl_draw(const struct args *a, struct scene *s, struct image *im, struct gl_work *work,
                    struct err *e)
{
    return a->samples > 1 ? gl_render_passes(s, a->samples, im, work, e)
                          : gl_render(s, im, work, e);
}

// The other picture of a split or a difference.
static bool draw_other(const struct args *a, struct scene *s, struct image *im, struct err *e)
{
    struct material *m = &s->object[0].material;
    const enum diffraction keep = m->diffraction;
    const bool reference = !strcmp(a->against, "reference");
    if (reference || !strcmp(a->against, "cpu"))
        return cpu_draw(a, s, reference, im, e);
    const bool ok = material_choose(m, a->against, e) && gl_draw(a, s, im, NULL, e);
    m->diffraction = keep;
    return ok;
}

// Turns radiance to what the file shows.
static bool show(const struct args *a, struct scene *s, struct image *im, double ev, struct err *e)
{
    const char *ext = path_ext(a->out);
    const bool two = !strcmp(a->view, "split") || !strcmp(a->view, "difference");
    const bool display = !strcmp(ext, ".png") || !strcmp(ext, ".jpg");
    struct image other = {0};
    if (two && !draw_other(a, s, &other, e))
        return false;
    if (!strcmp(a->view, "difference"))
        view_difference(im, &other, a->decades);
    else if (!strcmp(a->view, "false"))
        view_false_color(im, view_peak(im), a->decades);
    else if (two)
        view_split(im, &other);
    if (display && (!strcmp(a->view, "color") || !strcmp(a->view, "split")))
        display_map(im, ev);
    if (display)
        display_dither(im);
    image_finish(&other);
    return true;
}

static bool check(const struct args *a, struct err *e)
{
    const bool two = !strcmp(a->view, "split") || !strcmp(a->view, "difference");
    if (two != (a->against != NULL))
        return err_set(e, ERR_USAGE, "--against and --view split or difference need each other");
    if (a->samples < 1 || a->samples > 64)
        return err_set(e, ERR_DATA, "--samples: %d is out of range: must be 1 to 64", a->samples);
    return a->decades > 0 || err_set(e, ERR_DATA, "--decades: %g must be above 0", a->decades);
}

static bool draw(const struct args *a, struct scene *s, struct image *im, struct cli *cli,
                 struct err *e)
{
    struct gl_work work = {0};
    const bool cpu = a->reference || !strcmp(a->backend, "cpu");
    const double start_s = now_s();
    if (!(cpu ? cpu_draw(a, s, a->reference, im, e) : gl_draw(a, s, im, &work, e)))
        return false;
    doc_text(cli->doc, "picture", a->out);
    doc_int(cli->doc, "width", im->w);
    doc_int(cli->doc, "height", im->h);
    doc_text(cli->doc, "backend", a->reference ? "cpu, full integration" : cpu ? "cpu" : "gl");
    doc_num(cli->doc, "seconds", now_s() - start_s);
    if (!cpu)
        tell_work(&work, cli);
    return true;
}

static bool write_picture(const struct args *a, struct scene *s, struct image *im, struct cli *cli,
                          struct err *e)
{
    const double ev = isnan(s->exposure_ev) ? display_exposure(im) : s->exposure_ev;
    doc_num(cli->doc, "exposure_ev", ev);
    if (!show(a, s, im, ev, e))
        return false;
    meta_set_text(&im->meta, "nacre.version", NACRE_VERSION);
    meta_set_text(&im->meta, "nacre.command", cli->line);
    meta_set_num(&im->meta, "nacre.exposure_ev", ev);
    return image_write(im, a->out, e);
}

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct args *a = args;
    struct scene_options o;
    struct scene s;
    struct image im = {0};
    if (!check(a, e) || !parse_options(a, &o, e) || !scene_read(&s, cli->operand[0], &o, e))
        return false;
    for (int k = 0; k < s.n_objects && !isnan(a->tolerance); k++)
        material_set_tolerance(&s.object[k].material, a->tolerance);
    const bool ok = (!a->with || material_choose(&s.object[0].material, a->with, e)) &&
                    draw(a, &s, &im, cli, e) && write_picture(a, &s, &im, cli, e);
    image_finish(&im);
    scene_finish(&s);
    return ok;
}

const struct command cmd_render = {
    .name = "render",
    .summary = "draw a scene: a sample under lights, to a picture",
    .operands = "SCENE",
    .min_operands = 1,
    .max_operands = 1,
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes = "  nacre render rigs/scenes/plane.yaml -o plane.png\n"
             "  nacre render rigs/scenes/plane.yaml --table sample.exr --reference -o truth.exr\n"
             "\nScene files: docs/render.md.\n",
    .run = run,
};
