// cmd_methods.c - nacre methods: every way to filter an environment, side by side as a page.
//
// The comparison of T17 figure 24 and R17 figures 6 and 8: picture, error map and time of each
// method, all over the viewer's direction. The exact map is the measure; it is itself held against
// full integration in a few directions.
#define _GNU_SOURCE
#include "core/colormap.h"
#include "core/imgfile.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/sort.h"
#include "core/spectrum.h"
#include "process/env_direct.h"
#include "process/env_exact.h"
#include "process/env_separable.h"
#include "ui/commands.h"
#include "ui/html.h"
#include "ui/read_lut.h"
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

struct args {
    const char *lut;
    double range;
    int power;
    const char *tangent, *normal;
    int size;
    const char *out;
};

#define AT(field) offsetof(struct args, field)
static const struct opt opts[] = {
    {"lut", OPT_FILE, AT(lut), "LUT", NULL, "the diffraction table", UNIT_NONE, true},
    {"range", OPT_NUM, AT(range), "R", NULL, "range of a table whose file does not say (.pfm)"},
    {"power", OPT_INT, AT(power), "P", "1", "its power"},
    {"tangent", OPT_LIST, AT(tangent), "X,Y,Z", "1,0,0", "tangent of the sample, in the world"},
    {"normal", OPT_LIST, AT(normal), "X,Y,Z", "0,0,1", "normal of the sample"},
    {"size", OPT_INT, AT(size), "N", "384", "nodes a side of each map"},
    {"o", OPT_FILE, AT(out), "FOLDER", NULL, "index.html and its pictures", UNIT_NONE, true},
    {0},
};
#undef AT

static const struct method {
    const char *file, *title;
    int products; // of the exact method, 0: all; -1: separable
    int rank, passes;
} methods[] = {
    {"exact", "Exact: all products", 0, 0, 0},
    {"products-4", "The 4 best products", 4, 0, 0},
    {"products-1", "1 product: T17's preconvolution, Z by direction", 1, 0, 0},
    {"rank-1", "R17, rank 1, four passes", -1, 1, 4},
    {"rank-1-two", "R17, rank 1, two passes", -1, 1, 2},
    {"rank-3", "R17, rank 3, four passes", -1, 3, 4},
    {"rank-11", "R17, rank 11, four passes", -1, 11, 4},
    {"rank-21", "R17, rank 21, four passes", -1, 21, 4},
};

struct job {
    const struct args *a;
    struct environment env;
    struct table lut;
    struct frame frame;
    struct image exact;
    double white;
};

static const struct fresnel constant = {false, 1};

static bool run_exact(const struct job *j, int products, struct image *map, struct err *e)
{
    const struct env_how how = {
        .tolerance = 1e-3, .products = products, .detail_rad = M_PI / j->env.map.h};
    struct env_kernel k = {0};
    const bool ok = env_kernel_init(&k, &j->lut, &constant, &how, e) &&
                    env_exact(&k, &j->env, &j->frame, j->a->size, map, e);
    env_kernel_finish(&k);
    return ok;
}

// R17's map is over what is in the mirror: read there for every direction of the viewer.
static bool over_viewer(const struct job *j, const struct environment *seen, struct image *map,
                        struct err *e)
{
    const int n = j->a->size;
    if (!image_init(map, n, n, 3, e))
        return false;
    for (int k = 0; k < n * n; k++) {
        const double t = env_map_cosine(k % n, n), b = env_map_cosine(k / n, n);
        double rgb[3];
        if (t * t + b * b >= 1)
            continue;
        environment_radiance(seen, frame_world(&j->frame, v3(-t, -b, sqrt(1 - t * t - b * b))),
                             rgb);
        for (int c = 0; c < 3; c++)
            map->px[3 * k + c] = (float)rgb[c];
    }
    return true;
}

static bool run_method(const struct job *j, const struct method *m, struct image *map,
                       double *seconds, struct err *e)
{
    const double start = now_s();
    if (m->products >= 0) {
        const bool ok = run_exact(j, m->products, map, e);
        *seconds = now_s() - start;
        return ok;
    }
    const int wide = 4 * j->a->size; // as many pixels to a steradian at the normal
    const struct separable how = {wide, 256, m->passes == 4};
    struct factors f = {0};
    struct environment seen = {0};
    bool ok = factor(&f, &j->lut, m->rank < j->lut.n ? m->rank : j->lut.n, false, false, e) &&
              env_separable(&f, &j->env, &j->frame, &how, &seen.map, e);
    *seconds = now_s() - start;
    ok = ok && over_viewer(j, &seen, map, e);
    environment_finish(&seen);
    factors_finish(&f);
    return ok;
}

struct off {
    double all, near; // relative L2: everywhere, within 30 degrees of the normal
};

// And as false colour: 1e-4 of the exact map's peak to the peak.
static struct off difference(const struct job *j, const struct image *map, struct image *shown)
{
    const int n = map->w;
    double wrong[2] = {0}, sum[2] = {0}, peak = 0;
    for (int k = 0; k < 3 * n * n; k++)
        peak = fmax(peak, (double)j->exact.px[k]);
    for (int k = 0; k < n * n; k++) {
        const double t = env_map_cosine(k % n, n), b = env_map_cosine(k / n, n);
        const bool is_near = t * t + b * b < .25;
        double most = 0;
        unsigned char rgb[3];
        for (int c = 0; c < 3; c++) {
            const double want = (double)j->exact.px[3 * k + c];
            const double d = (double)map->px[3 * k + c] - want;
            most = fmax(most, fabs(d));
            wrong[0] += d * d;
            sum[0] += want * want;
            wrong[1] += is_near ? d * d : 0;
            sum[1] += is_near ? want * want : 0;
        }
        colormap(t * t + b * b < 1 ? 1 + log10(fmax(most / peak, 1e-12)) / 4 : 0, rgb);
        for (int c = 0; c < 3; c++)
            shown->px[3 * k + c] = (float)srgb_decode(rgb[c] / 255.0);
    }
    return (struct off){sqrt(wrong[0] / sum[0]), sqrt(wrong[1] / sum[1])};
}

// White is what 1 % of the exact map's lit samples exceed.
static double white_of(const struct image *map)
{
    const size_t n = (size_t)map->w * (size_t)map->h * 3;
    float *lit = xcalloc(n, sizeof *lit);
    size_t count = 0;
    for (size_t k = 0; k < n; k++)
        if (map->px[k] > 0)
            lit[count++] = map->px[k];
    sort_floats(lit, count);
    const double white = count ? (double)lit[count * 99 / 100] : 1;
    free(lit);
    return white;
}

static bool write_picture(const struct job *j, const char *file, const char *more,
                          struct image *picture, struct err *e)
{
    char *path = xasprintf("%s/%s%s.png", j->a->out, file, more);
    const bool ok = image_write(picture, path, e);
    free(path);
    return ok;
}

static void show(struct html *h, const struct method *m, double seconds, struct off off)
{
    char text[200], png[64];
    snprintf(text, sizeof text, "%.3g s; relative L2 %.2g, %.2g within 30 degrees.", seconds,
             off.all, off.near);
    html_section(h, m->title, text);
    fputs("<div class=row>", h->f);
    snprintf(png, sizeof png, "%s.png", m->file);
    html_picture(h, png, "Radiance over the viewer's direction cosines.");
    snprintf(png, sizeof png, "%s-error.png", m->file);
    html_picture(h, png, "Error, logarithmic: 1e-4 of the peak (dark) to the peak.");
    fputs("</div>\n", h->f);
}

static bool one(struct job *j, const struct method *m, struct html *h, struct doc *d, struct err *e)
{
    struct image map = {0}, shown = {0};
    double seconds = 0;
    bool ok = run_method(j, m, &map, &seconds, e) && image_init(&shown, map.w, map.h, 3, e);
    if (ok && !j->exact.px) {
        ok = image_init(&j->exact, map.w, map.h, 3, e);
        if (ok)
            memcpy(j->exact.px, map.px, (size_t)map.w * (size_t)map.h * 3 * sizeof *map.px);
        j->white = white_of(&map);
    }
    if (ok) {
        const struct off off = difference(j, &map, &shown);
        for (int k = 0; k < 3 * map.w * map.h; k++)
            map.px[k] *= (float)(1 / j->white);
        ok = write_picture(j, m->file, "", &map, e) &&
             write_picture(j, m->file, "-error", &shown, e);
        show(h, m, seconds, off);
        struct doc *row = doc_item(d, "methods");
        doc_text(row, "method", m->title);
        doc_num(row, "seconds", seconds);
        doc_num(row, "relative_l2", off.all);
        doc_num(row, "relative_l2_near", off.near);
    }
    image_finish(&map);
    image_finish(&shown);
    return ok;
}

// The exact map against full integration at nodes all over the disk.
static bool judge(const struct job *j, struct html *h, struct doc *d, struct err *e)
{
    enum { SPOTS = 12 };
    const int n = j->a->size;
    double o[SPOTS][2], rgb[SPOTS][3], wrong = 0, sum = 0;
    int node[SPOTS][2];
    for (int k = 0; k < 2 * SPOTS; k++) {
        const double a = 2.4 * (k / 2), r = .97 * sqrt((k / 2 + .5) / SPOTS);
        node[k / 2][k % 2] = (int)lround((1 + r * (k % 2 ? sin(a) : cos(a))) / 2 * (n - 1));
        o[k / 2][k % 2] = env_map_cosine(node[k / 2][k % 2], n);
    }
    const double start = now_s();
    if (!env_direct(&j->lut, &constant, &j->env, &j->frame, SPOTS, (const double(*)[2])o, rgb, e))
        return false;
    const double seconds = (now_s() - start) / SPOTS * M_PI / 4 * n * n;
    for (int k = 0; k < 3 * SPOTS; k++) {
        const double got = (double)j->exact.px[3 * (node[k / 3][1] * n + node[k / 3][0]) + k % 3];
        wrong += (got - rgb[k / 3][k % 3]) * (got - rgb[k / 3][k % 3]);
        sum += rgb[k / 3][k % 3] * rgb[k / 3][k % 3];
    }
    char text[200];
    snprintf(text, sizeof text,
             "In %d directions the exact map is within %.2g of it (relative L2). The whole map "
             "would take %.3g s.",
             SPOTS, sqrt(wrong / sum), seconds);
    html_section(h, "Full integration", text);
    doc_num(d, "exact_against_direct", sqrt(wrong / sum));
    doc_num(d, "direct_seconds", seconds);
    return true;
}

static bool page(struct job *j, struct cli *cli, struct err *e)
{
    struct html h;
    html_open(&h, "An environment filtered by every method",
              "nacre " NACRE_VERSION ": what a flat diffracting sample shows of its surroundings, "
              "constant Fresnel. Errors are against the exact map.");
    html_command(&h, cli->line);
    bool ok = true;
    for (size_t k = 0; ok && k < sizeof methods / sizeof *methods; k++)
        ok = one(j, &methods[k], &h, cli->doc, e);
    ok = ok && judge(j, &h, cli->doc, e);
    char *path = xasprintf("%s/index.html", j->a->out);
    ok = html_close(&h, ok ? path : NULL, e) && ok;
    if (ok)
        doc_text(cli->doc, "output", path);
    free(path);
    return ok;
}

static bool read_direction(const char *text, const char *name, struct vec3 *v, struct err *e)
{
    double x[3];
    const int n = cli_numbers(text, UNIT_NONE, x, 3, e);
    if (n != 3)
        return n < 0 ? err_in(e, "--%s", name)
                     : err_set(e, ERR_USAGE, "--%s: needs X,Y,Z, not '%.60s'", name, text);
    *v = v3(x[0], x[1], x[2]);
    return true;
}

static bool run(const void *args, struct cli *cli, struct err *e)
{
    struct job j = {.a = args};
    struct vec3 t, n;
    if (j.a->size < 16 || j.a->size > 2048)
        return err_set(e, ERR_DATA, "bad --size %d: must be 16 to 2048", j.a->size);
    if (!read_direction(j.a->tangent, "tangent", &t, e) ||
        !read_direction(j.a->normal, "normal", &n, e))
        return false;
    if (!frame_from(t, n, &j.frame))
        return err_set(e, ERR_DATA,
                       "tangent %s and normal %s make no frame: parallel, or of length 0",
                       j.a->tangent, j.a->normal);
    bool ok = read_lut(&j.lut, j.a->lut, j.a->range, j.a->power, e) &&
              (j.lut.basis == TABLE_PLAIN ||
               err_set(e, ERR_DATA, "%s: tables over w have no factors", j.a->lut)) &&
              environment_read(&j.env, cli->operand[0], e);
    if (ok && mkdir(j.a->out, 0777) && errno != EEXIST)
        ok = err_errno(e, "%s", j.a->out);
    ok = ok && page(&j, cli, e);
    image_finish(&j.exact);
    table_finish(&j.lut);
    environment_finish(&j.env);
    return ok;
}

const struct command cmd_methods = {
    .name = "methods",
    .summary = "every way to filter an environment, as a page: picture, error map, time",
    .operands = "ENV",
    .min_operands = 1,
    .max_operands = 1,
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes = "The comparison of T17 figure 24 and R17 figures 6 and 8, for your environment and "
             "table.\n"
             "  nacre methods grace.hdr --lut lut.exr -o methods-out",
    .run = run,
};
