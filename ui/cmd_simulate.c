// cmd_simulate.c - nacre simulate: what the simulated bench would show without noise, and its
// truth.
#define _GNU_SOURCE
#include "core/hfield_file.h"
#include "core/imgfile.h"
#include "core/meta.h"
#include "sim/energy.h"
#include "sim/sim.h"
#include "sim/truth.h"
#include "ui/commands.h"
#include <math.h>
#include <string.h>

struct args {
    const char *what, *out, *light, *filter, *illuminant, *table_of;
    int size, power;
    double range, pixel_m;
};

static void stamp(struct meta *m, const struct cli *cli)
{
    meta_set_text(m, "nacre.version", NACRE_VERSION);
    meta_set_text(m, "nacre.command", cli->line);
}

static bool find_light(const struct lab *lab, const struct args *a, int *line, int *position,
                       struct err *e)
{
    static const char *const builtin[] = {"green", "red", "blue", "open"};
    const struct rig *rig = &lab->rig;
    *line = *position = 0;
    if (!rig->path) {
        for (int k = 0; k < 4; k++)
            if (!strcmp(a->filter, builtin[k])) {
                *position = k;
                return true;
            }
        return err_set(e, ERR_DATA, "no filter '%s': there are green, red, blue, open", a->filter);
    }
    const int light = a->light ? rig_light_index(rig, a->light) : 0;
    const int filter = rig_filter_index(rig, a->filter);
    if (light < 0 || light >= rig->n_lights)
        return err_set(e, ERR_DATA, "%s: no light '%s'", rig->path, a->light ? a->light : "");
    if (filter < 0)
        return err_set(e, ERR_DATA, "%s: no filter '%s'", rig->path, a->filter);
    *line = rig->light[light].line;
    *position = rig->filter[filter].position;
    return true;
}

static bool write_pattern(struct lab *lab, const struct args *a, struct cli *cli, struct err *e)
{
    int line, position;
    struct band b = {0};
    struct image im = {0};
    double mean_m = 0, sum = 0;
    bool ok = find_light(lab, a, &line, &position, e) && lab_band(lab, line, position, &b, e) &&
              photo_pattern(&lab->scene, &b, &im, e);
    for (int k = 0; ok && k < b.n; k++) {
        mean_m += b.weight[3 * k] * b.lambda_m[k];
        sum += b.weight[3 * k];
    }
    if (ok) {
        stamp(&im.meta, cli);
        meta_set_num(&im.meta, "nacre.irradiance", b.irradiance);
        meta_set_num(&im.meta, "nacre.lambda_m", mean_m / sum);
        doc_num(cli->doc, "lambda_m", mean_m / sum);
        doc_num(cli->doc, "irradiance", b.irradiance);
        ok = image_write(&im, a->out, e);
    }
    band_finish(&b);
    image_finish(&im);
    return ok;
}

// What an eye in the camera's place sees, by direct sums over wavelengths: what a renderer should
// show.
static bool write_picture(struct lab *lab, const struct args *a, struct cli *cli, struct err *e)
{
    struct spectrum illuminant = {0};
    struct band b = {0};
    struct image im = {0};
    struct sim_scene eye = lab->scene;
    struct lab other = {0};
    eye.sensor.bayer = true; // three channels
    bool ok = (!a->table_of || sim_lab_open(&other, a->table_of, e)) &&
              illuminant_get(&illuminant, a->illuminant, e) && band_of_eye(&b, &illuminant, e);
    if (ok)
        eye.table_of = a->table_of ? &other.scene.view : NULL;
    ok = ok && photo_pattern(&eye, &b, &im, e);
    if (ok) {
        stamp(&im.meta, cli);
        meta_set_text(&im.meta, "nacre.illuminant", a->illuminant);
        ok = image_write(&im, a->out, e);
    }
    lab_finish(&other);
    spectrum_finish(&illuminant);
    band_finish(&b);
    image_finish(&im);
    return ok;
}

static bool write_geometry(struct lab *lab, const struct args *a, struct cli *cli, struct err *e)
{
    struct image im = {0};
    bool ok = photo_geometry(&lab->scene, &im, e);
    if (ok) {
        stamp(&im.meta, cli);
        ok = image_write(&im, a->out, e);
    }
    image_finish(&im);
    return ok;
}

static bool write_bokeh(struct lab *lab, const struct args *a, struct cli *cli, struct err *e)
{
    struct image im = {0};
    bool ok = bokeh_photo(&lab->scene.bokeh, &lab->scene.sample, &im, e);
    if (ok) {
        stamp(&im.meta, cli);
        ok = image_write(&im, a->out, e);
    }
    image_finish(&im);
    return ok;
}

static bool write_board(struct lab *lab, const struct args *a, struct cli *cli, struct err *e)
{
    struct image im = {0};
    bool ok = board_photo(&lab->scene.board, &lab->scene.view, &im, e) ||
              err_in(e, "%s", cli->operand[0]);
    if (ok) {
        stamp(&im.meta, cli);
        ok = image_write(&im, a->out, e);
    }
    image_finish(&im);
    return ok;
}

static bool write_ball(struct lab *lab, const struct args *a, struct cli *cli, struct err *e)
{
    struct image im = {0};
    bool ok =
        ball_photo(&lab->scene.ball, &lab->scene.view, &im, e) || err_in(e, "%s", cli->operand[0]);
    if (ok) {
        stamp(&im.meta, cli);
        ok = image_write(&im, a->out, e);
    }
    image_finish(&im);
    return ok;
}

static bool write_truth(struct lab *lab, const struct args *a, struct cli *cli, struct err *e)
{
    struct spectrum illuminant = {0};
    struct table t = {0};
    bool ok = table_init(&t, a->size, a->range, a->power, 1, e) &&
              illuminant_get(&illuminant, a->illuminant, e) &&
              truth_table(&lab->scene.sample, &lab->scene.view, &illuminant, &t, e);
    if (ok) {
        stamp(&t.meta, cli);
        meta_set_text(&t.meta, "nacre.illuminant", a->illuminant);
        meta_set_text(&t.meta, "nacre.observer", "CIE 1931 2 deg");
        meta_set_num(&t.meta, "nacre.f0", sqrt(lab->scene.sample.r0));
        ok = table_write(&t, a->out, e);
    }
    spectrum_finish(&illuminant);
    table_finish(&t);
    return ok;
}

// N x N nodes around the middle of the sample, its turn included.
static bool sampled_height(const struct sample *s, int n, double pixel_m, struct hfield *hf,
                           struct err *e)
{
    if (!hfield_init(hf, n, n, pixel_m, pixel_m, e))
        return false;
    const double middle = 0.5 * (n - 1);
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            double amplitude;
            hf->z[(size_t)j * (size_t)n + (size_t)i] =
                (float)sample_height(s, (i - middle) * pixel_m, (j - middle) * pixel_m, &amplitude);
        }
    return true;
}

// A map's own nodes, one cell of it, unless others are asked for.
static bool write_height(struct lab *lab, const struct args *a, struct cli *cli, struct err *e)
{
    struct sample *s = &lab->scene.sample;
    struct hfield sampled = {0};
    const bool as_it_is = s->map.z && isnan(a->pixel_m);
    const double pixel_m = isnan(a->pixel_m) ? lab->scene.bokeh.m_per_px : a->pixel_m;
    if (!as_it_is && !sampled_height(s, a->size, pixel_m, &sampled, e))
        return false;
    struct hfield *hf = as_it_is ? &s->map : &sampled;
    stamp(&hf->meta, cli);
    const bool ok = hfield_write(hf, a->out, NULL, e);
    hfield_finish(&sampled);
    return ok;
}

static bool tell_energy(struct lab *lab, const struct args *a, struct cli *cli, struct err *e)
{
    int line, position;
    struct band b = {0};
    struct energy all;
    const bool one_d = isinf(lab->scene.sample.period_y_m);
    bool ok = find_light(lab, a, &line, &position, e) && lab_band(lab, line, position, &b, e);
    const double lambda_m = ok ? b.lambda_m[b.n / 2] : 0;
    ok = ok && energy_of(&lab->scene.sample, lambda_m, one_d ? 100000 : 500, &all, e);
    band_finish(&b);
    if (!ok)
        return false;
    doc_num(cli->doc, "lambda_m", lambda_m);
    doc_num(cli->doc, "reflectance", all.reflectance);
    doc_num(cli->doc, "orders", all.orders);
    doc_num(cli->doc, "propagating", all.propagating);
    doc_num(cli->doc, "returned", all.returned);
    doc_num(cli->doc, "excess", all.returned - all.propagating);
    return true;
}

static const struct {
    const char *what;
    bool (*make)(struct lab *lab, const struct args *a, struct cli *cli, struct err *e);
} products[] = {
    {"pattern", write_pattern}, {"picture", write_picture}, {"geometry", write_geometry},
    {"truth", write_truth},     {"height", write_height},   {"bokeh", write_bokeh},
    {"board", write_board},     {"ball", write_ball},       {"energy", tell_energy},
};
static const char product_names[] = "pattern|picture|geometry|truth|height|bokeh|board|ball|energy";

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct args *a = args;
    size_t k = 0;
    while (strcmp(products[k].what, a->what))
        k++;
    const bool writes = products[k].make != tell_energy;
    if (writes != (a->out != NULL))
        return err_set(e, ERR_USAGE, writes ? "needs -o FILE" : "--what energy writes no file");
    struct lab lab = {0};
    if (!sim_lab_open(&lab, cli->operand[0], e))
        return false;
    doc_text(cli->doc, "sample", lab.scene.sample.kind);
    doc_num(cli->doc, "f0", sqrt(lab.scene.sample.r0));
    const bool ok = products[k].make(&lab, a, cli, e);
    if (ok && writes)
        doc_text(cli->doc, "output", a->out);
    lab_finish(&lab);
    return ok;
}

#define AT(field) offsetof(struct args, field)
static const struct opt options[] = {
    {"what", OPT_CHOICE, AT(what), product_names, "pattern",
     "radiance without noise; the same as an eye sees it, linear sRGB for irradiance 1 at the "
     "sample; u, v, w, weight of every pixel; the table S_d; the heights; the "
     "out-of-focus highlight; a chessboard or a mirror ball in the sample's place; the light that "
     "the orders return"},
    {"o", OPT_FILE, AT(out), "FILE", NULL, "where to write"},
    {"light", OPT_TEXT, AT(light), "NAME", NULL, "of the rig; default: the first"},
    {"filter", OPT_TEXT, AT(filter), "NAME", "green", "of the rig"},
    {"illuminant", OPT_TEXT, AT(illuminant), "NAME|FILE", "E", "of picture and table"},
    {"table-of", OPT_FILE, AT(table_of), "RIG|SCENE", NULL,
     "of the picture: as a perfect table of what that one photographs would show it"},
    {"size", OPT_INT, AT(size), "N", "501", "nodes a side of the table or heights"},
    {"range", OPT_NUM, AT(range), "R", "0.35", "of the table"},
    {"power", OPT_INT, AT(power), "P", "1", "of the table"},
    {"pixel", OPT_NUM, AT(pixel_m), "D", NULL,
     "between heights; default: a map's own nodes, else the pixel of the scene's bokeh", UNIT_M},
    {0},
};

const struct command cmd_simulate = {
    .name = "simulate",
    .summary = "what a simulated bench would show without noise, and its truth",
    .operands = "RIG|SCENE",
    .min_operands = 1,
    .max_operands = 1,
    .opts = options,
    .args_size = sizeof(struct args),
    .notes = "RIG is a rig file whose camera is simulated, SCENE a file such as\n"
             "rigs/samples/lcd.yaml; 'sim' is the built-in scene.\n"
             "  nacre simulate rigs/sim.yaml --what truth --size 501 --range 0.35 -o truth.exr\n",
    .run = run,
};
