// table_file.c - diffraction tables in files.
//
// One picture holds it all: the top row is v = -R; channels "X,Y,Z" (or "R,G,B") of a plain table,
// "0.X,0.Y,0.Z,1.X,..." of L tables, then "sigma.X,.." and "cover". Range, power, basis and curves
// are metadata, which only .exr can hold (docs/formats.md).
#define _GNU_SOURCE
#include "core/imgfile.h"
#include "core/mem.h"
#include "core/table.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const basis_names[] = {
    [TABLE_PLAIN] = "plain",
    [TABLE_TAYLOR] = "taylor",
    [TABLE_CHEBYSHEV] = "chebyshev",
    [TABLE_POD] = "pod",
};
static const double srgb_primaries[8] = {0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329};
static const double xyz_primaries[8] = {1, 0, 0, 1, 0, 0, 1 / 3.0, 1 / 3.0};

static char *append(char *list, const char *name)
{
    char *longer = list ? xasprintf("%s,%s", list, name) : xstrdup(name);
    free(list);
    return longer;
}

static char *append_colour(char *list, const char *prefix, bool is_rgb)
{
    for (int c = 0; c < 3; c++) {
        char *name = xasprintf("%s%c", prefix, (is_rgb ? "RGB" : "XYZ")[c]);
        list = append(list, name);
        free(name);
    }
    return list;
}

static char *channel_names(const struct table *t)
{
    char *list = NULL;
    for (int m = 0; m < t->count; m++) {
        char prefix[16] = "";
        if (t->basis != TABLE_PLAIN)
            snprintf(prefix, sizeof prefix, "%d.", m);
        list = append_colour(list, prefix, t->is_rgb);
    }
    if (t->sigma)
        list = append_colour(list, "sigma.", t->is_rgb);
    return t->cover ? append(list, "cover") : list;
}

// `n` planes of samples between a table's array [n2][n] and the picture's channels from `first`.
static void to_picture(struct image *im, int first, const float *plane, int n)
{
    const size_t n2 = (size_t)im->w * (size_t)im->h;
    for (size_t k = 0; k < n2; k++)
        memcpy(im->px + k * (size_t)im->nc + first, plane + k * (size_t)n,
               (size_t)n * sizeof *plane);
}

static void from_picture(const struct image *im, int first, float *plane, int n)
{
    const size_t n2 = (size_t)im->w * (size_t)im->h;
    for (size_t k = 0; k < n2; k++)
        memcpy(plane + k * (size_t)n, im->px + k * (size_t)im->nc + first,
               (size_t)n * sizeof *plane);
}

static void write_fields(const struct table *t, struct meta *m)
{
    meta_copy(m, &t->meta);
    meta_set_num(m, "nacre.range", t->range);
    meta_set_num(m, "nacre.power", t->power);
    meta_set_text(m, "nacre.basis", basis_names[t->basis]);
    meta_set_nums(m, "chromaticities", t->is_rgb ? srgb_primaries : xyz_primaries, 8);
    if (t->basis == TABLE_PLAIN)
        return;
    meta_set_nums(m, "nacre.w_range", (double[]){t->w_min, t->w_max}, 2);
    if (t->basis == TABLE_POD)
        meta_set_nums(m, "nacre.curves", t->curve, t->count * t->nw);
}

bool table_write(const struct table *t, const char *path, struct err *e)
{
    const bool is_exr = !strcmp(path_ext(path), ".exr");
    const bool extras = is_exr && (t->sigma || t->cover);
    if (!is_exr && t->basis != TABLE_PLAIN)
        return err_set(e, ERR_DATA, "%s: only .exr holds tables over w (%d tables)", path,
                       t->count);
    const int nc = 3 * t->count + (extras && t->sigma ? 3 : 0) + (extras && t->cover ? 1 : 0);
    struct image im;
    if (!image_init(&im, t->n, t->n, nc, e))
        return err_in(e, "%s", path);
    const size_t n2 = (size_t)t->n * (size_t)t->n;
    for (int m = 0; m < t->count; m++)
        to_picture(&im, 3 * m, t->tab + (size_t)m * n2 * 3, 3);
    int next = 3 * t->count;
    if (extras && t->sigma) {
        to_picture(&im, next, t->sigma, 3);
        next += 3;
    }
    if (extras && t->cover)
        to_picture(&im, next, t->cover, 1);
    write_fields(t, &im.meta);
    char *names = extras ? channel_names(t)
                         : channel_names(&(struct table){
                               .count = t->count, .basis = t->basis, .is_rgb = t->is_rgb});
    meta_set_text(&im.meta, "channels", names);
    meta_set_text(&im.meta, "compression", "none"); // ZIP: 5 % smaller, 20 times slower
    free(names);
    const bool ok = image_write(&im, path, e);
    image_finish(&im);
    return ok;
}

static bool read_basis(struct table *t, const struct meta *m, struct err *e)
{
    const char *name = meta_text(m, "nacre.basis");
    t->basis = TABLE_PLAIN;
    for (int k = 0; name && k < 4; k++)
        if (!strcmp(name, basis_names[k]))
            t->basis = (enum table_basis)k;
    if (name && strcmp(name, basis_names[t->basis]))
        return err_set(e, ERR_DATA, "unknown basis '%.40s': must be plain taylor chebyshev pod",
                       name);
    if (t->basis == TABLE_PLAIN)
        return t->count == 1 || err_set(e, ERR_DATA, "%d tables without a basis", t->count);
    const struct meta_item *w = meta_find(m, "nacre.w_range");
    if (!w || w->n != 2 || !(w->num[0] < w->num[1]) || !isfinite(w->num[1] - w->num[0]))
        return err_set(e, ERR_DATA, "no valid nacre.w_range: must be two rising numbers");
    t->w_min = w->num[0];
    t->w_max = w->num[1];
    if (t->basis != TABLE_POD)
        return true;
    const struct meta_item *c = meta_find(m, "nacre.curves");
    if (!c || c->n % t->count || c->n / t->count < 2)
        return err_set(e, ERR_DATA, "no valid nacre.curves: must be 2 or more samples a table");
    t->nw = c->n / t->count;
    t->curve = xcalloc((size_t)c->n, sizeof *t->curve);
    memcpy(t->curve, c->num, (size_t)c->n * sizeof *t->curve);
    return true;
}

// Place of the first of three colour channels with this prefix, -1 when they are not there.
static int colour_at(const struct image *im, const char *prefix, bool is_rgb)
{
    int at = -1;
    for (int c = 0; c < 3; c++) {
        char name[32];
        snprintf(name, sizeof name, "%s%c", prefix, (is_rgb ? "RGB" : "XYZ")[c]);
        const int k = image_channel_index(im, name);
        if (c == 0)
            at = k;
        else if (at < 0 || k != at + c)
            return -1;
    }
    return at;
}

// The place of every table's channels; their number, 0 when the picture is no table.
static int find_tables(const struct image *im, bool is_rgb, int place[IMAGE_MAX_CHANNELS])
{
    if ((place[0] = colour_at(im, "", is_rgb)) >= 0)
        return 1;
    int count = 0;
    for (; count < IMAGE_MAX_CHANNELS; count++) {
        char prefix[16];
        snprintf(prefix, sizeof prefix, "%d.", count);
        if ((place[count] = colour_at(im, prefix, is_rgb)) < 0)
            break;
    }
    return count;
}

static bool read_samples(struct table *t, const struct image *im, const int *place, struct err *e)
{
    const size_t n2 = (size_t)im->w * (size_t)im->h;
    for (int m = 0; m < t->count; m++)
        from_picture(im, place[m], t->tab + (size_t)m * n2 * 3, 3);
    for (size_t k = 0; k < n2 * 3 * (size_t)t->count; k++)
        if (!isfinite(t->tab[k])) {
            const int node = (int)(k / 3 % n2);
            return err_set(e, ERR_DATA, "node (%d, %d) is %s", node % im->w, node / im->w,
                           isnan(t->tab[k]) ? "NaN" : "infinite");
        }
    const int sigma = colour_at(im, "sigma.", t->is_rgb), cover = image_channel_index(im, "cover");
    if (sigma >= 0) {
        if (!(t->sigma = sample_alloc(n2 * 3, sizeof *t->sigma, "table", e)))
            return false;
        from_picture(im, sigma, t->sigma, 3);
    }
    if (cover >= 0) {
        if (!(t->cover = sample_alloc(n2, sizeof *t->cover, "table", e)))
            return false;
        from_picture(im, cover, t->cover, 1);
    }
    return true;
}

static bool from_image(struct table *t, struct image *im, const char *path,
                       const struct table_nodes *assume, struct err *e)
{
    const bool is_pfm = !strcmp(path_ext(path), ".pfm"); // which cannot say RGB or XYZ
    if (is_pfm && im->nc == 3)
        meta_set_text(&im->meta, "channels", "X,Y,Z");
    int place[IMAGE_MAX_CHANNELS];
    bool is_rgb = false;
    int count = find_tables(im, false, place);
    if (!count) {
        is_rgb = true;
        count = find_tables(im, true, place);
    }
    if (!count)
        return err_set(e, ERR_DATA, "not a table: it has no channels X,Y,Z or R,G,B");
    if (im->w != im->h)
        return err_set(e, ERR_DATA, "not a table: it must be square, not %d x %d", im->w, im->h);
    double range = assume ? assume->range : (double)NAN;
    double power = assume ? assume->power : (double)NAN;
    const bool has_range = meta_num(&im->meta, "nacre.range", &range);
    const bool has_power = meta_num(&im->meta, "nacre.power", &power);
    if (!assume && (!has_range || !has_power))
        return err_set(e, ERR_DATA, "the file does not say range and power: give --range, --power");
    if (power != floor(power) || fabs(power) > 1000)
        return err_set(e, ERR_DATA, "bad table power %g: must be odd (1, 3, 5, ...)", power);
    if (!table_init(t, im->w, range, (int)power, count, e))
        return false;
    t->is_rgb = is_rgb;
    if (!read_basis(t, &im->meta, e) || !read_samples(t, im, place, e))
        return false;
    meta_copy(&t->meta, &im->meta);
    static const char *const fields[] = {"channels",      "nacre.range",   "nacre.power",
                                         "nacre.basis",   "nacre.w_range", "nacre.curves",
                                         "chromaticities"};
    for (size_t k = 0; k < sizeof fields / sizeof *fields; k++)
        meta_drop(&t->meta, fields[k]);
    return true;
}

bool table_read(struct table *t, const char *path, const struct table_nodes *assume, struct err *e)
{
    struct image im = {0};
    struct table out = {0};
    if (!image_read(&im, path, e))
        return false;
    const bool ok = from_image(&out, &im, path, assume, e);
    image_finish(&im);
    if (!ok) {
        table_finish(&out);
        return err_in(e, "%s", path);
    }
    *t = out;
    return true;
}
