// calib_geometry.c - nacre calib geometry: the half vector of every pixel, from the rig's records.
#define _GNU_SOURCE
#include "calib/geometry.h"
#include "calib/light.h"
#include "core/imgfile.h"
#include "ui/calib.h"
#include <string.h>

// --light: a record, or X,Y,Z from the sample's origin along t, b, n.
static bool find_light(const struct calib_args *a, const struct lens *l, struct vec3 *at,
                       struct err *e)
{
    double x[3];
    struct err not_numbers;
    if (!a->light)
        return err_set(e, ERR_USAGE,
                       "give the light: --light FILE, a record of 'nacre calib light', or --light "
                       "X,Y,Z from the board's middle along t, b, n");
    const int n = strchr(a->light, ',') ? cli_numbers(a->light, UNIT_M, x, 3, &not_numbers) : 0;
    if (n == 3) {
        const struct plane p = lens_plane(l, l->plane);
        *at = v3_add(p.origin_m, frame_world(&p.f, v3(x[0], x[1], x[2])));
        return true;
    }
    if (strchr(a->light, ','))
        return err_set(e, ERR_USAGE, "--light: '%.60s' is not X,Y,Z such as 30mm,0m,0.5m",
                       a->light);
    struct light s;
    struct record now = l->head;
    if (!light_read(&s, a->light, e) || !record_fits(&s.head, a->light, &now, e))
        return false;
    *at = v3(s.position_m[0], s.position_m[1], s.position_m[2]);
    return true;
}

static bool read_options(const struct calib_args *a, struct geometry_options *o, struct err *e)
{
    *o = (struct geometry_options){.size_m = {NAN, NAN},
                                   .radial = !strcmp(a->tangents, "radial"),
                                   .hub_m = a->hub_m,
                                   .beam = a->beam,
                                   .r0 = a->r0,
                                   .schlick = !strcmp(a->fresnel, "schlick")};
    if (strcmp(a->turn, "auto") && !quantity_parse(a->turn, UNIT_RAD, &o->turn_rad, e))
        return err_in(e, "--turn");
    if (a->size) {
        const int n = cli_numbers(a->size, UNIT_M, o->size_m, 2, e);
        if (n != 2)
            return n < 0 ? err_in(e, "--size")
                         : err_set(e, ERR_USAGE, "--size needs two lengths, such as 40mm,30mm");
        if (!(o->size_m[0] > 0 && o->size_m[1] > 0))
            return err_set(e, ERR_DATA, "--size must be above 0");
    }
    if (!(o->beam >= 0) || !(o->r0 > 0 && o->r0 <= 1))
        return err_set(e, ERR_DATA, "--beam must be 0 or more, --r0 above 0 and at most 1");
    return true;
}

static void report(const struct image *im, const struct geometry_options *o, struct doc *d)
{
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    long seen = 0;
    for (int k = 0; k < im->w * im->h; k++) {
        const float *px = im->px + (size_t)k * (size_t)im->nc;
        if (isnan(px[0]))
            continue;
        seen++;
        for (int c = 0; c < 3; c++) {
            lo[c] = fmin(lo[c], (double)px[c]);
            hi[c] = fmax(hi[c], (double)px[c]);
        }
    }
    doc_nums(d, "light_m", &o->light_m.x, 3);
    doc_num(d, "seen_share", (double)seen / ((double)im->w * im->h));
    doc_nums(d, "u", (double[]){lo[0], hi[0]}, 2);
    doc_nums(d, "v", (double[]){lo[1], hi[1]}, 2);
    doc_nums(d, "w", (double[]){lo[2], hi[2]}, 2);
}

bool calib_geometry(const struct calib_args *a, struct cli *cli, struct err *e)
{
    struct geometry_options o;
    struct lens l = {0};
    struct image im = {0};
    const char *path = cli->operand[0];
    if (cli->n != 1)
        return err_set(e, ERR_USAGE, "calib geometry: takes one lens record");
    if (strcmp(path_ext(a->out), ".exr"))
        return err_set(e, ERR_DATA, "%s: a geometry record is an .exr", a->out);
    bool ok = read_options(a, &o, e) && lens_read(&l, path, e);
    if (ok && a->plane && (l.plane = lens_view_of(&l, a->plane)) < 0)
        ok = err_set(e, ERR_DATA, "%s: has no view --plane %s", path, a->plane);
    ok = ok && find_light(a, &l, &o.light_m, e) &&
         (geometry_of(&l, &o, &im, e) || err_in(e, "%s", path));
    if (ok) {
        struct record head;
        record_init(&head, "geometry",
                    "this camera, lens, focus, light and sample where they stand", l.head.residual,
                    l.head.residual_unit);
        record_settings(&head, &l.head);
        record_to_meta(&head, &im.meta);
        meta_set_text(&im.meta, "nacre.version", NACRE_VERSION);
        meta_set_text(&im.meta, "nacre.command", cli->line);
        meta_set_text(&im.meta, "nacre.lens", path);
        meta_set_text(&im.meta, "nacre.light", a->light);
        meta_set_nums(&im.meta, "nacre.light_m", &o.light_m.x, 3);
        report(&im, &o, cli->doc);
        ok = image_write(&im, a->out, e);
    }
    image_finish(&im);
    lens_finish(&l);
    return ok;
}
