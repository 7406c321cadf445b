// cmd_eval.c - nacre eval: what a table holds at given points, and what it should hold.
#define _GNU_SOURCE
#include "core/log.h"
#include "core/mem.h"
#include "core/table.h"
#include "process/direct.h"
#include "process/table_spline.h"
#include "ui/commands.h"
#include "ui/heights.h"
#include "ui/points.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct args {
    const char *points;
    int count;
    double range;
    int power;
    const char *reference;
    struct heights_opts heights;
    const char *illuminant;
};

#define AT(field) offsetof(struct args, field)
static const struct opt opts[] = {
    {"points", OPT_FILE, AT(points), "CSV", NULL, "columns u,v[,w]; - is stdin", UNIT_NONE, true},
    {"count", OPT_INT, AT(count), "L", NULL, "use the first L tables (default: all)"},
    {"range", OPT_NUM, AT(range), "R", NULL, "of a table without metadata (.pfm .hdr)"},
    {"power", OPT_INT, AT(power), "P", "1", "of a table without metadata"},
    {"reference", OPT_FILE, AT(reference), "HEIGHT", NULL,
     "compare with direct summation over this height field"},
    {"pixel", OPT_LIST, AT(heights.pixel), "D[,D]", NULL,
     "its node spacing (default: what its file says)"},
    {"z-scale", OPT_NUM, AT(heights.z_scale_m), "H", NULL, "its height of a sample of 1", UNIT_M},
    {"fill", OPT_FLAG, AT(heights.fill), NULL, NULL, "fill its nodes that were not measured"},
    {"illuminant", OPT_TEXT, AT(illuminant), "NAME|FILE", NULL, "its light (default: the table's)"},
    {0},
};
#undef AT

static double number(const struct meta *m, const char *key, int at, double otherwise)
{
    const struct meta_item *item = meta_find(m, key);
    return item && item->n > at ? item->num[at] : otherwise;
}

static bool is_text(const struct meta *m, const char *key, const char *value)
{
    const char *text = meta_text(m, key);
    return text && !strcmp(text, value);
}

// The table says how it was made; the same settings make its reference.
static bool sum_directly(const struct args *a, const struct table *t, const struct points *p,
                         double (*xyz)[3], struct err *e)
{
    const struct meta *m = &t->meta;
    const char *name = a->illuminant ? a->illuminant : meta_text(m, "nacre.illuminant");
    if (!is_text(m, "nacre.model", "heights"))
        return err_set(e, ERR_DATA, "--reference: the table was not made by nacre tables");
    struct hfield hf = {0};
    struct spectrum light = {0};
    struct spectral spectral = {0};
    struct heights_opts heights = a->heights;
    bool ok = heights_read(&hf, a->reference, &heights, e) &&
              illuminant_get(&light, name ? name : "E", e) &&
              spectral_init(&spectral, &light, number(m, "nacre.lambda_step_m", 0, 5e-9), e);
    const struct direct d = {
        .heights = &hf,
        .light = &spectral,
        .window = is_text(m, "nacre.window", "flat") ? WINDOW_FLAT : WINDOW_GAUSS,
        .coherence_m = number(m, "nacre.coherence_m", 0, 65e-6),
        .repeat = {(int)number(m, "nacre.repeat", 0, 1), (int)number(m, "nacre.repeat", 1, 1)},
        .absolute = is_text(m, "nacre.scale", "absolute"),
    };
    ok = ok &&
         (direct_xyz(&d, p->n, (const double(*)[3])p->at, xyz, e) || err_in(e, "%s", a->reference));
    for (int k = 0; ok && t->is_rgb && k < p->n; k++) {
        double rgb[3];
        xyz_to_rgb(xyz[k], rgb);
        memcpy(xyz[k], rgb, sizeof rgb);
    }
    spectral_finish(&spectral);
    spectrum_finish(&light);
    hfield_finish(&hf);
    return ok;
}

// One standard deviation, between nodes as the values are.
static void sigma_at(const struct table *t, const double *at, double out[3])
{
    const struct table plain = {
        .n = t->n, .range = t->range, .power = t->power, .count = 1, .tab = t->sigma};
    table_eval(&plain, at[0], at[1], at[2], 0, out);
}

static double distance(int n, double (*a)[3], double (*b)[3])
{
    double apart = 0, all = 0;
    for (int k = 0; k < n; k++)
        for (int c = 0; c < 3; c++) {
            apart += (a[k][c] - b[k][c]) * (a[k][c] - b[k][c]);
            all += b[k][c] * b[k][c];
        }
    return all > 0 ? sqrt(apart / all) : NAN;
}

static void print_csv(const struct table *t, const struct points *p, double (*xyz)[3],
                      double (*reference)[3])
{
    const char *c = t->is_rgb ? "RGB" : "XYZ";
    printf("u,v,w,%c,%c,%c", c[0], c[1], c[2]);
    if (t->sigma)
        printf(",sigma_%c,sigma_%c,sigma_%c", c[0], c[1], c[2]);
    if (reference)
        printf(",reference_%c,reference_%c,reference_%c", c[0], c[1], c[2]);
    printf("\n");
    for (int k = 0; k < p->n; k++) {
        const double *at = p->at[k];
        printf("%.12g,%.12g,%.12g,%.9g,%.9g,%.9g", at[0], at[1], at[2], xyz[k][0], xyz[k][1],
               xyz[k][2]);
        if (t->sigma) {
            double s[3];
            sigma_at(t, at, s);
            printf(",%.6g,%.6g,%.6g", s[0], s[1], s[2]);
        }
        if (reference)
            printf(",%.12g,%.12g,%.12g", reference[k][0], reference[k][1], reference[k][2]);
        printf("\n");
    }
}

static void fill_doc(struct doc *doc, const struct table *t, const struct points *p,
                     double (*xyz)[3], double (*reference)[3])
{
    const char *name = t->is_rgb ? "rgb" : "xyz";
    doc_int(doc, "points_total", p->n);
    for (int k = 0; k < p->n; k++) {
        struct doc *d = doc_item(doc, "points");
        static const char *const axis[3] = {"u", "v", "w"};
        for (int q = 0; q < 3; q++)
            doc_num(d, axis[q], p->at[k][q]);
        doc_nums(d, name, xyz[k], 3);
        if (t->sigma) {
            double s[3];
            sigma_at(t, p->at[k], s);
            doc_nums(d, "sigma", s, 3);
        }
        if (reference)
            doc_nums(d, "reference", reference[k], 3);
    }
    if (reference)
        doc_num(doc, "error_l2", distance(p->n, xyz, reference));
}

static bool evaluate(const struct args *a, struct cli *cli, const struct table *t,
                     const struct points *p, struct err *e)
{
    if (t->basis != TABLE_PLAIN && !p->has_w)
        return err_set(e, ERR_DATA, "%s: no column w, and the %d tables of %s need it", a->points,
                       t->count, cli->operand[0]);
    if (a->count < 0 || a->count > t->count)
        return err_set(e, ERR_DATA, "--count %d: %s has %d tables", a->count, cli->operand[0],
                       t->count);
    double(*xyz)[3] = sample_alloc((size_t)p->n, sizeof *xyz, "points", e);
    double(*reference)[3] =
        xyz && a->reference ? sample_alloc((size_t)p->n, sizeof *reference, "points", e) : NULL;
    bool ok = xyz && (!a->reference || (reference && sum_directly(a, t, p, reference, e)));
    struct table_spline spline = {0};
    ok = ok && table_spline_init(&spline, t, e);
    for (int k = 0; ok && k < p->n; k++)
        table_spline_at(&spline, p->at[k][0], p->at[k][1], p->at[k][2], a->count, xyz[k]);
    table_spline_finish(&spline);
    if (ok && cli->json)
        fill_doc(cli->doc, t, p, xyz, reference);
    else if (ok)
        print_csv(t, p, xyz, reference);
    if (ok && reference)
        log_note("relative L2 error %.3g over %d points", distance(p->n, xyz, reference), p->n);
    free(xyz);
    free(reference);
    return ok;
}

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct args *a = args;
    const struct table_nodes nodes = {.range = a->range, .power = a->power};
    struct table t = {0};
    struct points p = {0};
    const bool ok = table_read(&t, cli->operand[0], isnan(a->range) ? NULL : &nodes, e) &&
                    points_read(&p, a->points, e) && evaluate(a, cli, &t, &p, e);
    table_finish(&t);
    points_finish(&p);
    return ok;
}

const struct command cmd_eval = {
    .name = "eval",
    .summary = "values of a table at given points, against direct summation",
    .operands = "TABLES|LUT",
    .min_operands = 1,
    .max_operands = 1,
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes =
        "Prints CSV: u,v,w,X,Y,Z, then one standard deviation where the table knows it and the\n"
        "reference when asked for. Between nodes values follow a quintic spline, outside the range\n"
        "they are 0.\n\n"
        "  nacre eval scan.exr --points at.csv --reference scan.gsf\n"
        "  nacre eval lut.pfm --range 0.35 --power 1 --points at.csv",
    .run = run,
};
