// cmd_tables.c - nacre tables: from a height field to diffraction tables over (u, v, w).
#define _GNU_SOURCE
#include "core/log.h"
#include "core/mem.h"
#include "core/sha256.h"
#include "process/tables.h"
#include "ui/bokeh_heights.h"
#include "ui/commands.h"
#include "ui/heights.h"
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct args {
    struct heights_opts heights;
    const char *bokeh, *calibration;
    double coherence_m;
    const char *window;
    const char *repeat;
    const char *illuminant;
    double step_m;
    const char *basis;
    int count;
    double tolerance;
    const char *w;
    double range;
    const char *size;
    int power;
    bool absolute;
    double memory;
    const char *out;
};

#define AT(field) offsetof(struct args, field)
static const struct opt opts[] = {
    {"pixel", OPT_LIST, AT(heights.pixel), "D[,D]", NULL,
     "node spacing in x and y (default: what the file says)"},
    {"z-scale", OPT_NUM, AT(heights.z_scale_m), "H", NULL,
     "height of a sample of 1, for pictures without units", UNIT_M},
    {"fill", OPT_FLAG, AT(heights.fill), NULL, NULL, "fill nodes that were not measured"},
    {"from-bokeh", OPT_FILE, AT(bokeh), "PICTURE|SESSION", NULL,
     "in place of HEIGHT: a bokeh photograph, or a session of one bracket"},
    {"calibration", OPT_FILE, AT(calibration), "FILE", NULL, "its record, from nacre calib bokeh"},
    {"coherence", OPT_NUM, AT(coherence_m), "D", "65um",
     "patch seen at once: four sigma of the Gaussian window", UNIT_M},
    {"window", OPT_CHOICE, AT(window), "gauss|flat", "gauss", "flat: the whole field evenly"},
    {"repeat", OPT_LIST, AT(repeat), "N[,M]", "1",
     "copies of the field side by side, as an array factor"},
    {"illuminant", OPT_TEXT, AT(illuminant), "NAME|FILE", "E",
     "E A D50 D65 F1 F2 F11 inverse-A, or a CSV of nm,power"},
    {"step", OPT_NUM, AT(step_m), "L", "5nm", "wavelength step of the sum over 380 to 780 nm",
     UNIT_M},
    {"basis", OPT_CHOICE, AT(basis), "pod|chebyshev|taylor", "pod",
     "curves in w; pod needs the fewest tables"},
    {"count", OPT_INT, AT(count), "L", NULL, "number of tables"},
    {"tolerance", OPT_NUM, AT(tolerance), "E", NULL,
     "relative L2 error that chooses the number of tables (default 1e-3)"},
    {"w", OPT_LIST, AT(w), "LO,HI", "0,2", "range of w the error is for"},
    {"range", OPT_NUM, AT(range), "R", "2", "the table holds |u|, |v| <= R"},
    {"size", OPT_TEXT, AT(size), "N|auto", "501",
     "nodes a side; auto: N and P so that values between nodes meet the tolerance too"},
    {"power", OPT_INT, AT(power), "P", "5", "odd power that crowds nodes to the middle"},
    {"absolute", OPT_FLAG, AT(absolute), NULL, NULL,
     "values per area of coherence, in place of relative to a mirror"},
    {"memory", OPT_NUM, AT(memory), "SIZE", "1GB", "for transforms and samples", UNIT_BYTES},
    {"o", OPT_FILE, AT(out), "TABLES", NULL, "the tables: .exr", UNIT_NONE, true},
    {0},
};
#undef AT

static bool pair(const char *text, const char *option, int least, double out[2], struct err *e)
{
    const int n = cli_numbers(text, UNIT_NONE, out, 2, e);
    if (n < 0)
        return err_in(e, "--%s", option);
    if (n < least)
        return err_set(e, ERR_USAGE, "--%s needs two numbers, not '%s'", option, text);
    if (n == 1)
        out[1] = out[0];
    return true;
}

static bool make_spec(struct tables_spec *s, const struct args *a, struct err *e)
{
    double repeat[2], w[2];
    const bool is_auto = !strcmp(a->size, "auto");
    char *end;
    const long size = strtol(a->size, &end, 10);
    if (!is_auto && (!*a->size || *end))
        return err_set(e, ERR_USAGE, "--size needs a number of nodes or auto, not '%s'", a->size);
    if (a->count && !isnan(a->tolerance) && !is_auto)
        return err_set(e, ERR_USAGE, "give --count or --tolerance, not both");
    if (!pair(a->repeat, "repeat", 1, repeat, e) || !pair(a->w, "w", 2, w, e))
        return false;
    for (int k = 0; k < 2; k++)
        if (repeat[k] != rint(repeat[k]) || !(fabs(repeat[k]) < 1e6))
            return err_set(e, ERR_USAGE, "--repeat needs whole numbers, not '%s'", a->repeat);
    if (!(a->memory >= 1e6))
        return err_set(e, ERR_DATA, "--memory: %g bytes: must be 1 MB or more", a->memory);
    *s = (struct tables_spec){
        .window = strcmp(a->window, "flat") ? WINDOW_GAUSS : WINDOW_FLAT,
        .coherence_m = a->coherence_m,
        .repeat = {(int)repeat[0], (int)repeat[1]},
        .step_m = a->step_m,
        .absolute = a->absolute,
        .n = is_auto                       ? 0
             : size > 0 && size <= INT_MAX ? (int)size
                                           : 1,
        .power = a->power,
        .range = a->range,
        .basis = !strcmp(a->basis, "pod")      ? TABLE_POD
                 : !strcmp(a->basis, "taylor") ? TABLE_TAYLOR
                                               : TABLE_CHEBYSHEV,
        .w_min = w[0],
        .w_max = w[1],
        .count = a->count,
        .tolerance = a->count              ? 0
                     : isnan(a->tolerance) ? 1e-3
                                           : a->tolerance,
        .memory = (size_t)a->memory,
    };
    return true;
}

// The height field's file, or what it comes from.
static const char *source_of(const struct args *a, const struct cli *cli)
{
    return a->bokeh ? a->bokeh : cli->operand[0];
}

static bool get_heights(struct hfield *hf, const struct args *a, const struct cli *cli,
                        struct err *e)
{
    if (!a->bokeh == !cli->n)
        return err_set(e, ERR_USAGE, "give a height field or --from-bokeh, one of them");
    if (!a->bokeh)
        return heights_read(hf, cli->operand[0], &a->heights, e);
    if (!a->calibration)
        return err_set(e, ERR_USAGE, "--from-bokeh needs --calibration, of nacre calib bokeh");
    return bokeh_heights(hf, a->bokeh, a->calibration, a->out, e);
}

static void record(struct table *t, const struct args *a, const struct cli *cli)
{
    struct meta *m = &t->meta;
    meta_set_text(m, "nacre.version", NACRE_VERSION);
    meta_set_text(m, "nacre.command", cli->line);
    meta_set_text(m, "nacre.heights", source_of(a, cli));
    char hash[SHA256_TEXT];
    struct err ignored;
    if (sha256_file(source_of(a, cli), hash, &ignored))
        meta_set_text(m, "nacre.heights_sha256", hash);
    meta_set_text(m, "nacre.illuminant", a->illuminant);
}

static double last(const struct meta *m, const char *key)
{
    const struct meta_item *item = meta_find(m, key);
    return item && item->n ? item->num[item->n - 1] : NAN;
}

// Taylor series do not converge evenly: say what stands in the way.
static void warn_taylor(const struct table *t)
{
    double order = 0, needed = 0, y = 0, bound = 0, rounding = 0;
    meta_num(&t->meta, "nacre.taylor_order", &order);
    meta_num(&t->meta, "nacre.taylor_order_needed", &needed);
    meta_num(&t->meta, "nacre.taylor_y", &y);
    meta_num(&t->meta, "nacre.taylor_bound", &bound);
    meta_num(&t->meta, "nacre.taylor_rounding", &rounding);
    const double error = last(&t->meta, "nacre.error_l2");
    if (order < needed)
        log_warn("phases reach %.3g rad: the Taylor series needs order %g (%g tables), this is "
                 "order %g, its error %.2g",
                 y, needed, 2 * needed + 1, order, error);
    if (error > bound)
        log_warn("the error %.2g is above the bound %.2g of the series: the alternating sum of "
                 "float32 tables loses %.2g by cancellation; a lower order, chebyshev or pod is "
                 "better",
                 error, bound, rounding);
}

static void note_aliases(const struct table *t)
{
    const struct meta_item *limit = meta_find(&t->meta, "nacre.nyquist_u");
    const double u = limit ? fmin(limit->num[0], limit->num[1]) : 2;
    if (u < t->range)
        log_note("heights are too far apart for |u|, |v| above %.3g: there the sum over nodes "
                 "repeats itself (finer heights, or --range %.3g)",
                 u, u);
}

static void report(const struct table *t, const struct args *a, struct cli *cli)
{
    const struct meta_item *error = meta_find(&t->meta, "nacre.error_l2");
    doc_text(cli->doc, "tables", a->out);
    doc_text(cli->doc, "basis", a->basis);
    doc_int(cli->doc, "count", t->count);
    doc_num(cli->doc, "error_l2", last(&t->meta, "nacre.error_l2"));
    doc_num(cli->doc, "error_l2_worst_w", last(&t->meta, "nacre.error_l2_worst_w"));
    if (error)
        doc_nums(cli->doc, "error_l2_by_count", error->num, error->n);
    doc_int(cli->doc, "size", t->n);
    doc_int(cli->doc, "power", t->power);
    doc_num(cli->doc, "error_between", last(&t->meta, "nacre.error_between"));
    doc_num(cli->doc, "error_between_away", last(&t->meta, "nacre.error_between_away"));
    doc_num(cli->doc, "light_away", last(&t->meta, "nacre.light_away"));
    note_aliases(t);
    if (t->basis == TABLE_TAYLOR) {
        static const char *const keys[] = {"taylor_order", "taylor_order_needed", "taylor_bound",
                                           "taylor_rounding"};
        for (size_t k = 0; k < sizeof keys / sizeof *keys; k++) {
            char *key = xasprintf("nacre.%s", keys[k]);
            double value = NAN;
            meta_num(&t->meta, key, &value);
            doc_num(cli->doc, keys[k], value);
            free(key);
        }
        warn_taylor(t);
    }
}

static bool build(const struct args *a, struct cli *cli, const struct tables_spec *s,
                  const struct hfield *hf, struct err *e)
{
    struct table t = {0};
    const double start_s = now_s();
    if (!tables_make(&t, s, hf, e))
        return err_in(e, "%s", source_of(a, cli));
    const double time_s = now_s() - start_s;
    record(&t, a, cli);
    const bool ok = table_write(&t, a->out, e);
    if (ok) {
        report(&t, a, cli);
        doc_num(cli->doc, "time_s", time_s);
    }
    table_finish(&t);
    return ok;
}

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct args *a = args;
    struct tables_spec s;
    struct hfield hf = {0};
    struct spectrum light = {0};
    bool ok = make_spec(&s, a, e) && get_heights(&hf, a, cli, e) &&
              illuminant_get(&light, a->illuminant, e);
    s.light = &light;
    ok = ok && build(a, cli, &s, &hf, e);
    spectrum_finish(&light);
    hfield_finish(&hf);
    return ok;
}

const struct command cmd_tables = {
    .name = "tables",
    .summary = "diffraction tables from a height field",
    .operands = "[HEIGHT]",
    .min_operands = 0,
    .max_operands = 1,
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes =
        "XYZ(u, v, w) = sum over wavelengths of P cmf |S|^2, relative to a mirror, kept as a few\n"
        "tables over (u, v) with a curve in w each. --tolerance chooses how many; the file states\n"
        "the error with its first 1, 2, ... tables (docs/tables.md).\n\n"
        "  nacre tables scan.gsf --illuminant D65 --tolerance 1e-3 -o scan.exr\n"
        "  nacre tables h.pfm --pixel 0.254um --basis chebyshev --count 3 -o cheb.exr\n"
        "  nacre tables --from-bokeh phone.png --calibration bokeh.yaml -o phone.exr",
    .run = run,
};
