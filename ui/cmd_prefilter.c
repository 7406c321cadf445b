// cmd_prefilter.c - nacre prefilter: what a diffracting sample shows of its surroundings.
#define _GNU_SOURCE
#include "core/imgfile.h"
#include "core/log.h"
#include "process/env_direct.h"
#include "process/env_exact.h"
#include "process/env_separable.h"
#include "render/env_gl.h"
#include "render/gl.h"
#include "render/studio.h"
#include "ui/commands.h"
#include "ui/read_lut.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct args {
    const char *lut;
    double range;
    int power;
    const char *tangent, *normal, *method, *fresnel;
    double r0, tolerance;
    int products, rank;
    const char *window;
    bool align;
    const char *passes;
    int taps;
    const char *backend;
    int size;
    const char *out;
};

#define AT(field) offsetof(struct args, field)
static const struct opt opts[] = {
    {"lut", OPT_FILE, AT(lut), "LUT", NULL,
     "the diffraction table; separable: also the factors of nacre factor", UNIT_NONE, true},
    {"range", OPT_NUM, AT(range), "R", NULL, "range of a table whose file does not say (.pfm)"},
    {"power", OPT_INT, AT(power), "P", "1", "its power"},
    {"tangent", OPT_LIST, AT(tangent), "X,Y,Z", NULL, "tangent of the sample, in the world",
     UNIT_NONE, true},
    {"normal", OPT_LIST, AT(normal), "X,Y,Z", NULL, "normal of the sample; bitangent = n x t",
     UNIT_NONE, true},
    {"method", OPT_CHOICE, AT(method), "exact|separable|direct", "exact",
     "plane convolutions; blurs by factors; full integration"},
    {"fresnel", OPT_CHOICE, AT(fresnel), "constant|schlick", "constant", "F over the angle"},
    {"r0", OPT_NUM, AT(r0), "R0", "0.04", "power reflectance at normal incidence (schlick)"},
    {"tolerance", OPT_NUM, AT(tolerance), "E", "1e-3",
     "of the Fresnel term and the weight of angles, relative (exact)"},
    {"products", OPT_INT, AT(products), "N", "0",
     "the best so many, 1 to 16, in place of the tolerance; 0: as it needs (exact)"},
    {"window", OPT_LIST, AT(window), "T,B,WIDTH", NULL,
     "compute only the directions within WIDTH/2 of (T, B); the others are 0 (exact)"},
    {"rank", OPT_INT, AT(rank), "R", "1", "products of the table; factors have theirs (separable)"},
    {"align", OPT_FLAG, AT(align), NULL, NULL,
     "turn the pattern's main directions into axes first (separable)"},
    {"passes", OPT_CHOICE, AT(passes), "2|4", "4",
     "4 turn the map to the sample and back, which keeps lines straight (separable)"},
    {"taps", OPT_INT, AT(taps), "N", "256", "of a filter (separable)"},
    {"backend", OPT_CHOICE, AT(backend), "auto|gl|cpu", "auto",
     "auto is gl on a graphics card, cpu where OpenGL draws in software (separable)"},
    {"size", OPT_INT, AT(size), "N", NULL, "nodes a side; separable: columns of the map", UNIT_NONE,
     true},
    {"o", OPT_FILE, AT(out), "OUT", NULL, "the map: .exr .pfm .hdr", UNIT_NONE, true},
    {0},
};
#undef AT

static bool read_vector(const char *text, const char *name, struct vec3 *v, struct err *e)
{
    double x[3];
    const int n = cli_numbers(text, UNIT_NONE, x, 3, e);
    if (n < 0)
        return err_in(e, "--%s", name);
    if (n != 3)
        return err_set(e, ERR_USAGE, "--%s: needs X,Y,Z, not '%.60s'", name, text);
    const double most = fmax(fabs(x[0]), fmax(fabs(x[1]), fabs(x[2])));
    *v = most > 0 ? v3(x[0] / most, x[1] / most, x[2] / most) : v3(0, 0, 0);
    return most > 0 ||
           err_set(e, ERR_DATA, "--%s: %s is no direction: its length is 0", name, text);
}

static bool read_frame(const struct args *a, struct frame *f, struct err *e)
{
    struct vec3 t, n;
    if (!read_vector(a->tangent, "tangent", &t, e) || !read_vector(a->normal, "normal", &n, e))
        return false;
    return frame_from(t, n, f) ||
           err_set(e, ERR_DATA, "tangent %s is parallel to normal %s: it must lie in the surface",
                   a->tangent, a->normal);
}

static bool check(const struct args *a, struct err *e)
{
    if (!(a->r0 > 0 && a->r0 <= 1))
        return err_set(e, ERR_DATA, "bad --r0 %g: must be above 0 and at most 1", a->r0);
    if (a->window && strcmp(a->method, "exact"))
        return err_set(e, ERR_DATA, "--window: only --method exact computes a part of the map");
    if (a->size < 2 || a->size > 16384)
        return err_set(e, ERR_DATA, "bad --size %d: must be 2 to 16384", a->size);
    return true;
}

struct job {
    const struct args *a;
    const struct environment *env;
    const struct table *lut;       // not read when there are factors
    const struct factors *factors; // of a file, or NULL
    struct frame frame;
    struct fresnel fresnel;
};

static bool read_window(const struct args *a, double window[3], struct err *e)
{
    window[0] = window[1] = 0;
    window[2] = 2;
    const int n = a->window ? cli_numbers(a->window, UNIT_NONE, window, 3, e) : 3;
    if (n < 0)
        return err_in(e, "--window");
    if (n != 3)
        return err_set(e, ERR_USAGE, "--window: needs T,B,WIDTH, not '%.60s'", a->window);
    if (!(fabs(window[0]) <= 1 && fabs(window[1]) <= 1 && window[2] > 0 && window[2] <= 2))
        return err_set(e, ERR_DATA,
                       "--window: T and B must be -1 to 1, WIDTH above 0 and at most 2, not %.60s",
                       a->window);
    return true;
}

// What was not computed, and why.
static void tell_skipped(const struct env_kernel *k, const struct env_light *l, int n,
                         struct doc *d)
{
    long seen = 0, all = 0;
    for (int p = 0; p < n * n; p++) {
        const double t = env_map_cosine(p % n, n), b = env_map_cosine(p / n, n);
        const bool disk = t * t + b * b < 1;
        all += disk;
        seen += disk && fabs(t - l->t) <= .5 * l->grid.span && fabs(b - l->b) <= .5 * l->grid.span;
    }
    const int count = k->terms.n_post;
    doc_num(d, "skipped.light", 1 - l->used);
    doc_num(d, "skipped.directions", all ? 1 - (double)seen / (double)all : 0);
    doc_int(d, "skipped.products",
            k->terms.n_kernel > 1 ? count * (count + 1) / 2 - k->terms.n : 0);
}

static bool exact(const struct job *j, struct doc *d, struct image *out, struct err *e)
{
    const double start = now_s();
    double window[3];
    if (!read_window(j->a, window, e))
        return false;
    const struct env_how how = {.tolerance = j->a->tolerance,
                                .products = j->a->products,
                                .detail_rad = M_PI / j->env->map.h,
                                .span = window[2]};
    struct env_kernel k;
    struct env_light l = {0};
    if (!env_kernel_init(&k, j->lut, &j->fresnel, &how, e))
        return false;
    const double ready = now_s();
    const bool ok = env_light_init(&l, &k, j->env, &j->frame, window[0], window[1], e) &&
                    env_exact_map(&k, &l, j->a->size, out, e);
    if (ok)
        tell_skipped(&k, &l, j->a->size, d);
    env_light_finish(&l);
    doc_int(d, "grid", k.grid.side);
    doc_int(d, "products", k.terms.n);
    doc_int(d, "transforms", k.terms.n_pre + k.terms.n_post);
    doc_num(d, "weight_error", k.terms.error);
    doc_num(d, "kernel_s", ready - start);
    env_kernel_finish(&k);
    return ok;
}

// On OpenGL when that is asked for, or when it is more than software.
static bool blurs(const struct job *j, const struct factors *f, const struct separable *how,
                  struct doc *d, struct image *out, struct err *e)
{
    struct gl_context *gl = NULL;
    struct err none = {0};
    const char *backend = j->a->backend;
    if (strcmp(backend, "cpu") && !gl_context_open(&gl, &none) && !strcmp(backend, "gl")) {
        *e = none;
        return false;
    }
    const bool on_gl = gl && (!strcmp(backend, "gl") || !env_gl_is_software());
    doc_text(d, "backend", on_gl ? gl_name() : "cpu");
    const double start = now_s();
    const bool ok = on_gl ? env_gl_separable(f, j->env, &j->frame, how, out, e)
                          : env_separable(f, j->env, &j->frame, how, out, e);
    doc_num(d, "blur_s", now_s() - start);
    gl_context_close(gl);
    return ok;
}

static bool separable(const struct job *j, struct doc *d, struct image *out, struct err *e)
{
    const struct separable how = {j->a->size, j->a->taps, !strcmp(j->a->passes, "4")};
    struct factors made = {0};
    if (j->fresnel.schlick)
        return err_set(e, ERR_DATA,
                       "--fresnel schlick: separable holds at normal incidence, where Fresnel is "
                       "constant");
    if (!j->factors && !factor(&made, j->lut, j->a->rank, j->a->align, true, e))
        return err_in(e, "%s", j->a->lut);
    const struct factors *f = j->factors ? j->factors : &made;
    const bool ok = blurs(j, f, &how, d, out, e);
    doc_text(d, "kind", factor_kind_names[f->kind]);
    doc_int(d, "rank", f->rank);
    doc_num(d, "rank_error", f->error[4 * (f->rank - 1) + 3]);
    factors_finish(&made);
    return ok;
}

static bool filter(const struct job *j, struct doc *d, struct image *out, struct err *e)
{
    const double start = now_s();
    bool ok;
    if (!strcmp(j->a->method, "direct"))
        ok = env_direct_map(j->lut, &j->fresnel, j->env, &j->frame, j->a->size, out, e);
    else if (!strcmp(j->a->method, "separable"))
        ok = separable(j, d, out, e);
    else
        ok = exact(j, d, out, e);
    doc_num(d, "seconds", now_s() - start);
    return ok;
}

static bool read_factors(struct factors *f, const struct args *a, struct err *e)
{
    if (!strcmp(a->method, "separable"))
        return factors_read(f, a->lut, e);
    return err_set(e, ERR_DATA, "%s holds factors: --method %s needs the table itself", a->lut,
                   a->method);
}

static void record(const struct args *a, const struct cli *cli, const struct frame *f,
                   struct meta *m)
{
    meta_set_text(m, "nacre.version", NACRE_VERSION);
    meta_set_text(m, "nacre.command", cli->line);
    meta_set_text(m, "nacre.environment", cli->operand[0]);
    meta_set_text(m, "nacre.lut", a->lut);
    if (strcmp(a->method, "separable")) {
        meta_set_num(m, "nacre.range", 1);
        meta_set_num(m, "nacre.power", 1);
    }
    meta_set_nums(m, "nacre.tangent", (double[]){f->t.x, f->t.y, f->t.z}, 3);
    meta_set_nums(m, "nacre.normal", (double[]){f->n.x, f->n.y, f->n.z}, 3);
}

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct args *a = args;
    struct environment env = {0};
    struct table t = {0};
    struct factors f = {0};
    struct image out = {0};
    const bool factored = factors_is_file(a->lut);
    struct job j = {a, &env, &t, factored ? &f : NULL,
                    .fresnel = {!strcmp(a->fresnel, "schlick"), a->r0}};
    const bool ok =
        check(a, e) && read_frame(a, &j.frame, e) &&
        (factored ? read_factors(&f, a, e) : read_lut(&t, a->lut, a->range, a->power, e)) &&
        studio_or_file(&env, cli->operand[0], e) && filter(&j, cli->doc, &out, e);
    if (ok)
        record(a, cli, &j.frame, &out.meta);
    const bool written = ok && image_write(&out, a->out, e);
    if (written)
        doc_text(cli->doc, "output", a->out);
    image_finish(&out);
    factors_finish(&f);
    table_finish(&t);
    environment_finish(&env);
    return written;
}

const struct command cmd_prefilter = {
    .name = "prefilter",
    .summary = "the light that a diffracting sample sends on from an environment",
    .operands = "ENV",
    .min_operands = 1,
    .max_operands = 1,
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes = "ENV is a lat-long map of radiance (.hdr .exr .pfm), twice as wide as high, or "
             "studio, a made-up\n"
             "room.\n"
             "The map written holds the outgoing radiance over (o_t, o_b), the direction cosines\n"
             "of the viewer: column i is o_t = 2i/(N-1) - 1, row j is o_b = 2j/(N-1) - 1, and 0\n"
             "outside the unit disk. The separable method (R17) writes a lat-long map N x N/2 of\n"
             "what is seen with that direction in the mirror; it holds near the normal.\n"
             "  nacre prefilter grace.hdr --lut lut.exr --tangent 1,0,0 --normal 0,0,1 --size 512 "
             "-o map.exr",
    .run = run,
};
