// cmd_slits.c - nacre slits: tables of analytic gratings.
#define _GNU_SOURCE
#include "core/imgfile.h"
#include "core/log.h"
#include "process/multislit.h"
#include "process/rainbow.h"
#include "ui/commands.h"
#include <math.h>
#include <string.h>

struct args {
    double pitch_m, width_m;
    int count;
    const char *model;
    bool radial;
    double turn_rad;
    const char *window;
    const char *mask;
    double exponent;
    bool absolute;
    double roughness;
    double w;
    const char *illuminant;
    double step_m;
    bool rgb;
    double range;
    int size, power;
    const char *out;
};

#define AT(field) offsetof(struct args, field)
static const struct opt opts[] = {
    {"pitch", OPT_NUM, AT(pitch_m), "D", NULL, "distance of the slits", UNIT_M, true},
    {"width", OPT_NUM, AT(width_m), "A", NULL, "of a slit", UNIT_M},
    {"count", OPT_INT, AT(count), "N", NULL, "slits lit at once"},
    {"model", OPT_CHOICE, AT(model), "slits|g04|g04-spectral", "slits",
     "slits: T17 eq. 16; g04: Stam's shader, its rainbow or the observer's colours"},
    {"radial", OPT_FLAG, AT(radial), NULL, NULL, "the row turned to all directions"},
    {"turn", OPT_NUM, AT(turn_rad), "ANGLE", "0", "of the row, from u towards v", UNIT_RAD},
    {"window", OPT_LIST, AT(window), "SU[,SV]", NULL,
     "Gaussian in the half vector along and across the row, rms; 0: none"},
    {"mask", OPT_FILE, AT(mask), "IMG", NULL, "picture over the table that multiplies it"},
    {"exponent", OPT_NUM, AT(exponent), "E", "2", "power of 1 / wavelength: 2 in T17 eq. 12"},
    {"absolute", OPT_FLAG, AT(absolute), NULL, NULL,
     "reflectance in place of Y = 1 at h = 0; needs --window SU,SV, the lobe across"},
    {"roughness", OPT_NUM, AT(roughness), "R", "0", "of the g04 highlight; 0: none"},
    {"w", OPT_NUM, AT(w), "W", "2", "h.n that the g04 highlight is for"},
    {"illuminant", OPT_TEXT, AT(illuminant), "NAME|FILE", "E",
     "E A D50 D65 F1 F2 F11 inverse-A, or a CSV of nm,power"},
    {"step", OPT_NUM, AT(step_m), "L", NULL,
     "wavelength step (default: resolves every lobe, at most 5 nm)", UNIT_M},
    {"rgb", OPT_FLAG, AT(rgb), NULL, NULL, "linear sRGB in place of XYZ"},
    {"range", OPT_NUM, AT(range), "R", "1", "the table holds |u|, |v| <= R"},
    {"size", OPT_INT, AT(size), "N", "512", "nodes a side"},
    {"power", OPT_INT, AT(power), "P", "1", "odd power that crowds nodes to the middle"},
    {"o", OPT_FILE, AT(out), "LUT", NULL, "the table: .exr .pfm .hdr", UNIT_NONE, true},
    {0},
};
#undef AT

static bool make_slits(struct table *t, const struct args *a, const struct spectrum *light,
                       struct err *e)
{
    struct multislit s = {
        .pitch_m = a->pitch_m,
        .width_m = a->width_m,
        .count = a->count,
        .turn_rad = a->turn_rad,
        .radial = a->radial,
        .exponent = a->exponent,
        .absolute = a->absolute,
    };
    if (isnan(a->width_m) || !a->count)
        return err_set(e, ERR_USAGE, "--width and --count are needed for slits");
    const int n = a->window ? cli_numbers(a->window, UNIT_NONE, s.window, 2, e) : 0;
    if (n < 0)
        return err_in(e, "--window");
    const double reach = a->range * (a->radial ? M_SQRT2 : 1);
    const double step_m = isnan(a->step_m) ? multislit_step(&s, reach) : a->step_m;
    if (!multislit_table(t, &s, light, step_m, a->size, a->range, a->power, e))
        return false;
    const double numbers[] = {s.pitch_m, s.width_m, s.count};
    meta_set_nums(&t->meta, "nacre.slits", numbers, 3);
    meta_set_num(&t->meta, "nacre.exponent", s.exponent);
    meta_set_num(&t->meta, "nacre.lambda_step_m", step_m);
    meta_set_text(&t->meta, "nacre.scale", s.absolute ? "absolute" : "mirror");
    return true;
}

static bool make_rainbow(struct table *t, const struct args *a, const struct spectrum *light,
                         struct err *e)
{
    struct rainbow r = {.spacing_m = a->pitch_m, .roughness = a->roughness, .highlight = {1, 1, 1}};
    const bool printed = !strcmp(a->model, "g04");
    if (!rainbow_table(t, &r, printed ? NULL : light, a->w, a->size, a->range, a->power, e))
        return false;
    meta_set_num(&t->meta, "nacre.w", a->w);
    return true;
}

static bool mask_table(struct table *t, const char *path, struct err *e)
{
    struct image mask = {0};
    if (!image_read(&mask, path, e))
        return false;
    const bool ok = image_check_finite(&mask, path, e);
    if (ok)
        table_mask(t, &mask);
    image_finish(&mask);
    return ok;
}

static void turn_rgb(struct table *t)
{
    const size_t n2 = (size_t)t->n * (size_t)t->n;
    for (size_t k = 0; k < n2; k++) {
        double rgb[3];
        float *px = t->tab + 3 * k;
        xyz_to_rgb((const double[]){px[0], px[1], px[2]}, rgb);
        for (int c = 0; c < 3; c++)
            px[c] = (float)rgb[c];
    }
    t->is_rgb = true;
}

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct args *a = args;
    struct table t = {0};
    struct spectrum light = {0};
    bool ok = illuminant_get(&light, a->illuminant, e) &&
              (strcmp(a->model, "slits") ? make_rainbow : make_slits)(&t, a, &light, e) &&
              (!a->mask || mask_table(&t, a->mask, e));
    if (ok && a->rgb && !t.is_rgb)
        turn_rgb(&t);
    if (ok) {
        meta_set_text(&t.meta, "nacre.version", NACRE_VERSION);
        meta_set_text(&t.meta, "nacre.command", cli->line);
        meta_set_text(&t.meta, "nacre.model", a->model);
        meta_set_text(&t.meta, "nacre.illuminant", a->illuminant);
        meta_set_text(&t.meta, "nacre.observer", "CIE 1931 2 deg");
        meta_set_num(&t.meta, "nacre.f0", 1);
        ok = table_write(&t, a->out, e);
    }
    if (ok) {
        doc_text(cli->doc, "table", a->out);
        doc_text(cli->doc, "model", a->model);
    }
    table_finish(&t);
    spectrum_finish(&light);
    return ok;
}

const struct command cmd_slits = {
    .name = "slits",
    .summary = "diffraction tables of slits, a compact disc, Stam's shader",
    .operands = "",
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes = "A compact disc (T17): rows along its tangents, so u is the radial direction.\n\n"
             "  nacre slits --pitch 2um --width 0.5um --count 21 --window 0,0.05 -o cd.exr\n"
             "  nacre slits --pitch 8um --width 1um --count 12 --radial --mask m.png -o paper.exr\n"
             "  nacre slits --model g04 --pitch 1.6um --roughness 5 -o stam.exr",
    .run = run,
};
