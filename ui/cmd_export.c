// cmd_export.c - nacre export: a table for other renderers, with what is lost on the way.
#define _GNU_SOURCE
#include "core/log.h"
#include "render/export.h"
#include "ui/commands.h"
#include "ui/read_lut.h"
#include <math.h>
#include <string.h>

struct args {
    const char *to, *out;
    double range, r0, azimuth_rad;
    int power, count, resolution, phis, thetas;
};

#define AT(field) offsetof(struct args, field)
static const struct opt opts[] = {
    {"to", OPT_CHOICE, AT(to), "bsdf|merl|glsl", NULL,
     "RGL tensor file (Mitsuba, pbrt), MERL binary, or a GLSL function and its texture", UNIT_NONE,
     true},
    {"r0", OPT_NUM, AT(r0), "R0", NULL,
     "power reflectance at normal incidence (default: the table's F0 squared)"},
    {"count", OPT_INT, AT(count), "L", NULL, "use the first L tables (default: all)"},
    {"azimuth", OPT_NUM, AT(azimuth_rad), "DEG", "0deg",
     "merl: the half vectors' angle from t that the slice shows", UNIT_RAD},
    {"resolution", OPT_INT, AT(resolution), "N", "128", "bsdf: half vectors a side"},
    {"phis", OPT_INT, AT(phis), "N", "17", "bsdf: azimuths of the incident light"},
    {"thetas", OPT_INT, AT(thetas), "N", "8", "bsdf: its angles from the normal, to 80 degrees"},
    {"range", OPT_NUM, AT(range), "R", NULL, "of a table without metadata (.pfm .hdr)"},
    {"power", OPT_INT, AT(power), "P", "1", "of a table without metadata"},
    {"o", OPT_FILE, AT(out), "OUT", NULL, "where to write", UNIT_NONE, true},
    {0},
};
#undef AT

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct args *a = args;
    struct table t = {0};
    struct material m;
    struct export_loss loss;
    if (a->resolution > 1024 || a->phis > 256 || a->thetas > 256)
        return err_set(e, ERR_DATA,
                       "a BSDF of %d x %d x %d^2 is too large: at most 256 x 256 x "
                       "1024^2",
                       a->phis, a->thetas, a->resolution);
    if (!isnan(a->r0) && !(a->r0 > 0 && a->r0 <= 1))
        return err_set(e, ERR_DATA, "bad R0 %g: must be above 0 and at most 1", a->r0);
    if (!read_lut(&t, cli->operand[0], a->range, a->power, e))
        return false;
    if (a->count < 0 || a->count > t.count) {
        err_set(e, ERR_DATA, "--count %d: %s has %d tables", a->count, cli->operand[0], t.count);
        table_finish(&t);
        return false;
    }
    material_init(&m);
    material_take_table(&m, &t, a->r0);
    m.tables_used = a->count;
    const bool ok = !strcmp(a->to, "bsdf")
                        ? export_bsdf(&m, &(struct export_bsdf){a->phis, a->thetas, a->resolution},
                                      a->out, &loss, e)
                    : !strcmp(a->to, "merl") ? export_merl(&m, a->azimuth_rad, a->out, &loss, e)
                                             : export_glsl(&m, a->out, &loss, e);
    material_finish(&m);
    if (!ok)
        return false;
    doc_text(cli->doc, "output", a->out);
    doc_text(cli->doc, "loss", loss.what);
    doc_num(cli->doc, "error_l2", loss.error);
    if (loss.error > 0.1)
        log_warn("the file shows this material only roughly: relative L2 error %.2g", loss.error);
    return true;
}

const struct command cmd_export = {
    .name = "export",
    .summary = "a table for other renderers, with what is lost on the way",
    .operands = "TABLES|LUT",
    .min_operands = 1,
    .max_operands = 1,
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes =
        "No format but ours holds a diffracting material whole; the loss is printed and kept in\n"
        "the file (merl: beside it). glsl also writes the texture, OUT with .pfm for its ending.\n"
        "  nacre export lut.exr --to glsl -o shader.glsl\n"
        "  nacre export lut.exr --to bsdf -o phone.bsdf\n"
        "  nacre export lut.exr --to merl --azimuth 45deg -o phone.binary",
    .run = run,
};
