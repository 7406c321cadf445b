// factor_file.c - factors in files: a picture of the filters, row by row.
#define _GNU_SOURCE
#include "core/imgfile.h"
#include "core/mem.h"
#include "process/factor.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

bool factors_write(const struct factors *f, const char *path, struct err *e)
{
    if (strcmp(path_ext(path), ".exr"))
        return err_set(e, ERR_USAGE, "%s: factors are written as .exr, for what they say of axes",
                       path);
    struct image im;
    const size_t filter = (size_t)f->rank * (size_t)f->n * 3;
    if (!image_init(&im, f->n, f->f[1] ? 2 * f->rank : f->rank, 3, e))
        return false;
    memcpy(im.px, f->f[0], filter * sizeof *im.px);
    if (f->f[1])
        memcpy(im.px + filter, f->f[1], filter * sizeof *im.px);
    meta_copy(&im.meta, &f->meta);
    meta_set_text(&im.meta, "channels", "R,G,B");
    meta_set_text(&im.meta, "nacre.factors", factor_kind_names[f->kind]);
    meta_set_num(&im.meta, "nacre.rank", f->rank);
    meta_set_num(&im.meta, "nacre.range", f->range);
    meta_set_num(&im.meta, "nacre.power", f->power);
    meta_set_nums(&im.meta, "nacre.axes", &f->axis[0][0], 4);
    meta_set_nums(&im.meta, "nacre.error", f->error, 4 * f->rank);
    const bool ok = image_write(&im, path, e);
    image_finish(&im);
    return ok;
}

static bool read_kind(struct factors *f, const struct meta *m, struct err *e)
{
    const char *kind = meta_text(m, "nacre.factors");
    if (!kind)
        return err_set(e, ERR_DATA, "not factors: made by nacre factor, they say nacre.factors");
    for (int k = 0; factor_kind_names[k]; k++)
        if (!strcmp(kind, factor_kind_names[k])) {
            f->kind = (enum factor_kind)k;
            return true;
        }
    return err_set(e, ERR_DATA, "unknown kind of factors '%.40s'", kind);
}

static bool read_fields(struct factors *f, const struct image *im, struct err *e)
{
    const struct meta *m = &im->meta;
    const struct meta_item *axes = meta_find(m, "nacre.axes"), *error = meta_find(m, "nacre.error");
    double rank = 0, power = 0;
    if (!read_kind(f, m, e))
        return false;
    const int filters = f->kind == FACTOR_LINE ? 1 : 2;
    f->n = im->w;
    f->rank = im->h / filters;
    if (im->nc != 3 || !meta_num(m, "nacre.rank", &rank) || rank != f->rank ||
        im->h != filters * f->rank || !meta_num(m, "nacre.range", &f->range) ||
        !meta_num(m, "nacre.power", &power) || !axes || axes->n != 4 || !error ||
        error->n != 4 * f->rank)
        return err_set(e, ERR_DATA,
                       "damaged factors: rank, range, power, axes or error do not fit");
    f->power = fabs(power) < 100 ? (int)power : 0;
    memcpy(f->axis, axes->num, sizeof f->axis);
    f->error = xcalloc((size_t)error->n, sizeof *f->error);
    memcpy(f->error, error->num, (size_t)error->n * sizeof *f->error);
    if (!(fabs(f->axis[0][0] * f->axis[1][1] - f->axis[0][1] * f->axis[1][0]) > .1))
        return err_set(e, ERR_DATA, "damaged factors: the axes are parallel");
    return table_nodes_check(f->n, f->range, f->power, e);
}

static bool read_filters(struct factors *f, const struct image *im, struct err *e)
{
    const size_t filter = (size_t)f->rank * (size_t)f->n * 3;
    for (int k = 0; k < (f->kind == FACTOR_LINE ? 1 : 2); k++) {
        f->f[k] = sample_alloc(filter, sizeof **f->f, "factors", e);
        if (!f->f[k])
            return false;
        memcpy(f->f[k], im->px + (size_t)k * filter, filter * sizeof **f->f);
    }
    return true;
}

bool factors_is_file(const char *path)
{
    struct image im = {0};
    struct err e = {0};
    const bool is = !strcmp(path_ext(path), ".exr") && image_read(&im, path, &e) &&
                    meta_text(&im.meta, "nacre.factors");
    image_finish(&im);
    return is;
}

bool factors_read(struct factors *f, const char *path, struct err *e)
{
    struct image im = {0};
    struct factors out = {0};
    if (!image_read(&im, path, e))
        return false;
    const bool ok =
        image_check_finite(&im, path, e) &&
        ((read_fields(&out, &im, e) && read_filters(&out, &im, e)) || err_in(e, "%s", path));
    if (ok) {
        meta_copy(&out.meta, &im.meta);
        *f = out;
    } else {
        factors_finish(&out);
    }
    image_finish(&im);
    return ok;
}
