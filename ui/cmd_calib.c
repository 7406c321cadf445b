// cmd_calib.c - nacre calib: what this rig really is, as dated records.
#define _GNU_SOURCE
#include "ui/calib.h"
#include "ui/commands.h"
#include <string.h>

#define AT(field) offsetof(struct calib_args, field)
static const struct opt opts[] = {
    {"lines", OPT_NUM, AT(lines_per_m), "N", NULL, "bokeh: lines of the known grating, e.g. 600/mm",
     UNIT_PER_M},
    {"blaze", OPT_NUM, AT(blaze_rad), "ANGLE", NULL, "bokeh: its blaze angle, e.g. 13deg",
     UNIT_RAD},
    {"turn", OPT_TEXT, AT(turn), "auto|DEG", "auto",
     "bokeh: how far the sensor shows the sample turned counter-clockwise; auto: by the lines, "
     "which "
     "stand upright on the sample"},
    {"channel", OPT_CHOICE, AT(channel), "r|g|b", NULL, "bokeh: the channel to use (default b)"},
    {"o", OPT_FILE, AT(out), "FILE", NULL, "the record", .needed = true},
    {0},
};

static const struct verb {
    const char *name;
    bool (*run)(const struct calib_args *a, struct cli *cli, struct err *e);
} verbs[] = {
    {"bokeh", calib_bokeh},
    {NULL, NULL},
};

static bool run(const void *args, struct cli *cli, struct err *e)
{
    struct cli rest = *cli;
    rest.n--;
    rest.operand++;
    for (const struct verb *v = verbs; v->name; v++)
        if (!strcmp(v->name, cli->operand[0])) {
            if (rest.n < 1)
                return err_set(e, ERR_USAGE, "calib %s: needs a file to work on", v->name);
            doc_text(cli->doc, "output", ((const struct calib_args *)args)->out);
            return v->run(args, &rest, e);
        }
    return err_set(e, ERR_USAGE, "calib: '%.40s' is not one of bokeh", cli->operand[0]);
}

const struct command cmd_calib = {
    .name = "calib",
    .summary = "calibration records: what this rig really is",
    .operands = "VERB FILE...",
    .min_operands = 1,
    .max_operands = 256,
    .opts = opts,
    .args_size = sizeof(struct calib_args),
    .notes = "  nacre calib bokeh grating.png --lines 600/mm --blaze 13deg -o bokeh.yaml",
    .run = run,
};
