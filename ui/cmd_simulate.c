// cmd_simulate.c - nacre simulate: what the simulated bench would show without noise, and its
// truth.
#define _GNU_SOURCE
#include "core/imgfile.h"
#include "core/meta.h"
#include "sim/sim.h"
#include "sim/truth.h"
#include "ui/commands.h"
#include <math.h>
#include <string.h>

struct args {
    const char *what, *out, *light, *filter, *illuminant;
    int size, power;
    double range;
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

static bool write_truth(struct lab *lab, const struct args *a, struct cli *cli, struct err *e)
{
    struct spectrum illuminant = {0};
    struct table t = {0};
    bool ok = table_init(&t, a->size, a->range, a->power, 1, e) &&
              illuminant_get(&illuminant, a->illuminant, e) &&
              truth_table(&lab->scene.sample, &illuminant, &t, e);
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

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct args *a = args;
    struct lab lab = {0};
    if (!sim_lab_open(&lab, cli->operand[0], e))
        return false;
    doc_text(cli->doc, "sample", lab.scene.sample.kind);
    doc_num(cli->doc, "f0", sqrt(lab.scene.sample.r0));
    const bool ok = !strcmp(a->what, "truth")      ? write_truth(&lab, a, cli, e)
                    : !strcmp(a->what, "geometry") ? write_geometry(&lab, a, cli, e)
                                                   : write_pattern(&lab, a, cli, e);
    if (ok)
        doc_text(cli->doc, "output", a->out);
    lab_finish(&lab);
    return ok;
}

#define AT(field) offsetof(struct args, field)
static const struct opt options[] = {
    {"what", OPT_CHOICE, AT(what), "pattern|geometry|truth", "pattern",
     "radiance without noise; u, v, w and weight of every pixel; the table S_d"},
    {"o", OPT_FILE, AT(out), "FILE", NULL, "where to write", .needed = true},
    {"light", OPT_TEXT, AT(light), "NAME", NULL, "of the rig; default: the first"},
    {"filter", OPT_TEXT, AT(filter), "NAME", "green", "of the rig"},
    {"illuminant", OPT_TEXT, AT(illuminant), "NAME|FILE", "E", "of the table"},
    {"size", OPT_INT, AT(size), "N", "501", "nodes a side of the table"},
    {"range", OPT_NUM, AT(range), "R", "0.35", "of the table"},
    {"power", OPT_INT, AT(power), "P", "1", "of the table"},
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
