// cmd_factor.c - nacre factor: a diffraction table as a few products of filters.
#define _GNU_SOURCE
#include "core/log.h"
#include "core/mem.h"
#include "process/factor.h"
#include "ui/commands.h"
#include "ui/read_lut.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct args {
    int rank;
    bool align;
    const char *kind;
    double range;
    int power;
    const char *out;
};

#define AT(field) offsetof(struct args, field)
static const struct opt opts[] = {
    {"rank", OPT_INT, AT(rank), "R", NULL, "products per channel", UNIT_NONE, true},
    {"align", OPT_FLAG, AT(align), NULL, NULL, "turn the two main directions into the axes first"},
    {"kind", OPT_CHOICE, AT(kind), "auto|composition", "auto",
     "find out whether the pattern is a sum of two lines or one line, or do not"},
    {"range", OPT_NUM, AT(range), "R", NULL, "range of a table whose file does not say (.pfm)"},
    {"power", OPT_INT, AT(power), "P", "1", "its power"},
    {"o", OPT_FILE, AT(out), "FACTORS", NULL, "the filters: .exr", UNIT_NONE, true},
    {0},
};
#undef AT

static void report(struct doc *d, const struct factors *f, double seconds)
{
    static const char *const names[4] = {"error_r", "error_g", "error_b", "error"};
    double *column = xcalloc((size_t)f->rank, sizeof *column);
    doc_text(d, "kind", factor_kind_names[f->kind]);
    doc_int(d, "rank", f->rank);
    for (int k = 0; k < (f->kind == FACTOR_LINE ? 1 : 2); k++)
        doc_num(d, k ? "direction_1_deg" : "direction_0_deg",
                atan2(f->axis[k][1], f->axis[k][0]) * 180 / M_PI);
    for (int c = 3; c >= 0; c--) {
        for (int k = 0; k < f->rank; k++)
            column[k] = f->error[4 * k + c];
        doc_nums(d, names[c], column, f->rank);
    }
    doc_num(d, "seconds", seconds);
    free(column);
}

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct args *a = args;
    struct table t = {0};
    struct factors f = {0};
    bool ok = read_lut(&t, cli->operand[0], a->range, a->power, e);
    const double start = now_s();
    ok = ok && (factor(&f, &t, a->rank, a->align, !strcmp(a->kind, "auto"), e) ||
                err_in(e, "%s", cli->operand[0]));
    const double seconds = now_s() - start;
    if (ok) {
        meta_set_text(&f.meta, "nacre.version", NACRE_VERSION);
        meta_set_text(&f.meta, "nacre.command", cli->line);
        ok = factors_write(&f, a->out, e);
    }
    if (ok) {
        report(cli->doc, &f, seconds);
        doc_text(cli->doc, "output", a->out);
    }
    factors_finish(&f);
    table_finish(&t);
    return ok;
}

const struct command cmd_factor = {
    .name = "factor",
    .summary = "a diffraction table as a few products of filters",
    .operands = "LUT",
    .min_operands = 1,
    .max_operands = 1,
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes =
        "The table as S(u, v) = sum over the rank of f0(a) f1(b), per channel of linear sRGB,\n"
        "by singular values; error is relative, in Frobenius norm, for each rank up to R (with\n"
        "--align the last one also holds the way back to the table). A pattern on two lines\n"
        "becomes a sum of two directional blurs, one on a single line one blur.\n"
        "  nacre factor lut.exr --rank 3 --align -o factors.exr",
    .run = run,
};
