// calib_light.c - nacre calib light: where the light is, from a mirror ball or from specular lobes.
#define _GNU_SOURCE
#include "calib/grey.h"
#include "calib/light.h"
#include "core/imgfile.h"
#include "core/mem.h"
#include "ui/calib.h"
#include <stdlib.h>
#include <string.h>

enum { MOST = 64 };

struct pictures {
    int n;
    float *light[MOST]; // [h][w]
    struct record now;
};

// Frees a picture that no flat has been divided out of from the lens's natural fall-off, cos^4: it
// would move a wide lobe towards the picture's middle.
static void divide_natural(float *light, const struct lens *l)
{
    for (int j = 0; j < l->head.h; j++)
        for (int i = 0; i < l->head.w; i++)
            light[(size_t)j * (size_t)l->head.w + (size_t)i] *= (float)pow(lens_ray(l, i, j).z, -4);
}

static bool read_pictures(const struct cli *cli, const struct lens *l, const char *lens_path,
                          bool lobes, struct pictures *p, struct err *e)
{
    if (cli->n > MOST)
        return err_set(e, ERR_USAGE, "calib light: %d pictures, at most %d", cli->n, MOST);
    for (; p->n < cli->n; p->n++) {
        const char *path = cli->operand[p->n];
        struct image im = {0};
        struct record now;
        if (!image_read(&im, path, e))
            return false;
        record_init(&now, "light", "", NAN, "");
        record_from_image(&now, &im);
        const bool ok = record_fits(&l->head, lens_path, &now, e) || err_in(e, "%s", path);
        p->light[p->n] = ok ? light_from(&im, e) : NULL;
        if (lobes && p->light[p->n] && !meta_text(&im.meta, "nacre.flat"))
            divide_natural(p->light[p->n], l);
        if (p->n == 0)
            p->now = now;
        image_finish(&im);
        if (!p->light[p->n])
            return false;
    }
    return true;
}

static bool by_balls(const struct calib_args *a, const struct lens *l, const struct pictures *p,
                     struct light *s, struct cli *cli, struct err *e)
{
    double guess[3 * MOST];
    struct line line[MOST];
    const int given = a->ball ? cli_numbers(a->ball, UNIT_NONE, guess, 3 * MOST, e) : 0;
    if (given < 0)
        return err_in(e, "--ball");
    if (given && given != 3 * p->n)
        return err_set(e, ERR_USAGE, "--ball: needs X,Y,RADIUS for each of the %d pictures", p->n);
    if (!(a->radius_m > 0))
        return err_set(e, ERR_DATA, "--radius must be above 0");
    for (int k = 0; k < p->n; k++) {
        struct ball ball;
        if (!light_ball(l, a->radius_m, given ? guess + 3 * k : NULL, p->light[k], l->head.w,
                        l->head.h, &ball, &line[k], e))
            return err_in(e, "%s", cli->operand[k]);
        struct doc *d = doc_item(cli->doc, "balls");
        doc_text(d, "image", cli->operand[k]);
        doc_nums(d, "center_m", &ball.center_m.x, 3);
        doc_nums(d, "spot_px", ball.spot_px, 2);
        doc_num(d, "outline_rms_px", ball.rms_px);
    }
    if (!light_from_lines(s, line, p->n, e))
        return false;
    snprintf(s->method, sizeof s->method, "ball");
    return true;
}

// The planes in which the sample lay: the views of the lens record that --poses names, else all.
static bool find_views(const struct calib_args *a, const struct lens *l, int n, int at[MOST],
                       struct err *e)
{
    if (!a->poses && l->n != n)
        return err_set(e, ERR_USAGE,
                       "%d pictures, but the lens record has %d views: say by --poses IMAGE,.. "
                       "which board lay where the sample lay in each picture",
                       n, l->n);
    char *list = a->poses ? xstrdup(a->poses) : NULL, *rest = list;
    bool ok = true;
    int k = 0;
    for (; ok && k < n; k++) {
        const char *name = list ? strsep(&rest, ",") : l->view[k].image;
        const int view = name ? lens_view_of(l, name) : -1;
        if (!name)
            ok = err_set(e, ERR_USAGE, "--poses names %d of %d pictures' boards", k, n);
        else if (view < 0)
            ok = err_set(e, ERR_DATA, "--poses: the lens record has no view %s", name);
        else
            at[k] = view;
    }
    if (ok && rest)
        ok = err_set(e, ERR_USAGE, "--poses names more boards than the %d pictures", n);
    free(list);
    return ok;
}

static bool by_lobes(const struct calib_args *a, const struct lens *l, const struct pictures *p,
                     struct light *s, struct err *e)
{
    int view[MOST];
    if (!find_views(a, l, p->n, view, e) ||
        !light_lobes(s, l, view, (const float *const *)p->light, p->n, e))
        return false;
    snprintf(s->method, sizeof s->method, "lobe");
    return true;
}

static void report(const struct light *s, const struct lens *l, struct doc *d)
{
    const struct plane p = lens_plane(l, l->plane);
    const struct vec3 at = v3(s->position_m[0], s->position_m[1], s->position_m[2]);
    const struct vec3 from = frame_local(&p.f, v3_sub(at, p.origin_m));
    doc_text(d, "method", s->method);
    doc_int(d, "pictures", s->pictures);
    doc_nums(d, "position_m", s->position_m, 3);
    doc_nums(d, "sigma_m", s->sigma_m, 3);
    doc_nums(d, "from_sample_m", &from.x, 3); // along t, b, n of the lens record's plane
    doc_num(d, "residual_m", s->head.residual);
}

bool calib_light(const struct calib_args *a, struct cli *cli, struct err *e)
{
    struct lens l = {0};
    struct pictures p = {0};
    struct light s;
    if (!a->lens)
        return err_set(e, ERR_USAGE,
                       "give the camera: --lens FILE, a record of 'nacre calib lens'");
    if (!lens_read(&l, a->lens, e))
        return false;
    const bool lobes = isnan(a->radius_m);
    bool ok = read_pictures(cli, &l, a->lens, lobes, &p, e) &&
              (lobes ? by_lobes(a, &l, &p, &s, e) : by_balls(a, &l, &p, &s, cli, e));
    if (ok) {
        record_settings(&s.head, &p.now);
        s.head.iso = s.head.aperture = NAN; // a place does not know them
        ok = light_write(&s, cli->line, a->out, e);
        report(&s, &l, cli->doc);
    }
    for (int k = 0; k < p.n; k++)
        free(p.light[k]);
    lens_finish(&l);
    return ok;
}
