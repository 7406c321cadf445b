// calib_lens.c - nacre calib lens and board: a camera from pictures of a printed target.
#define _GNU_SOURCE
#include "calib/corner.h"
#include "calib/grey.h"
#include "calib/lens.h"
#include "core/imgfile.h"
#include "core/log.h"
#include "core/mem.h"
#include "ui/calib.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool read_target(const struct calib_args *a, struct board *b, struct err *e)
{
    char rest;
    *b = (struct board){0};
    if (!a->board || isnan(a->square_m))
        return err_set(e, ERR_USAGE, "give the target: --board COLSxROWS --square SIDE");
    if (sscanf(a->board, "%dx%d%c", &b->cols, &b->rows, &rest) != 2)
        return err_set(e, ERR_USAGE, "--board: '%.40s' is not COLSxROWS such as 9x6", a->board);
    const bool charuco = !isnan(a->marker_m);
    if (charuco) { // as OpenCV counts: squares
        b->cols--;
        b->rows--;
        b->marker_m = a->marker_m;
        const char *name = a->dictionary;
        if (!strncasecmp(name, "DICT_", 5))
            name += 5;
        if (!strncasecmp(name, "APRILTAG_", 9))
            name += 9;
        snprintf(b->dictionary, sizeof b->dictionary, "%s", name);
        for (char *p = b->dictionary; *p; p++)
            *p = (char)(*p >= 'A' && *p <= 'Z' ? *p + 32 : *p);
    }
    b->square_m = a->square_m;
    if (b->cols < 2 || b->rows < 2 || b->cols > 500 || b->rows > 500)
        return err_set(e, ERR_DATA, "--board %s: needs %s in both directions", a->board,
                       charuco ? "3 to 500 squares" : "2 to 500 inner corners");
    if (!(b->square_m > 0) || (charuco && !(b->marker_m > 0 && b->marker_m < b->square_m)))
        return err_set(e, ERR_DATA, "--square must be above 0, --marker between 0 and --square");
    return true;
}

// What the pictures tell.
struct pictures {
    struct corners *seen; // [n]
    char **image;         // [n] of the pictures with a board, not owned
    int n, w, h;
    struct record head;
};

static bool look_at(const char *path, const struct board *b, struct pictures *p, struct err *e)
{
    struct image im = {0};
    if (!image_read(&im, path, e))
        return false;
    struct record now;
    record_init(&now, "lens", "", NAN, "");
    record_from_image(&now, &im);
    bool ok = true;
    if (!p->w) {
        p->w = im.w;
        p->h = im.h;
        p->head = now;
    } else {
        ok = record_fits(&p->head, "the first picture", &now, e) || err_in(e, "%s", path);
    }
    float *light = ok ? light_from(&im, e) : NULL;
    uint8_t *grey = light ? grey_from(light, (size_t)im.w * (size_t)im.h, e) : NULL;
    struct corners *c = &p->seen[p->n];
    ok = grey && (cv_board_find(b, grey, im.w, im.h, c, e) || err_in(e, "%s", path));
    if (ok)
        corners_refine(b, c, light, im.w, im.h);
    free(grey);
    free(light);
    image_finish(&im);
    return ok;
}

static bool look_at_all(struct cli *cli, const struct board *b, struct pictures *p, struct err *e)
{
    struct progress bar;
    bool ok = true;
    progress_start(&bar, "finding corners", cli->n);
    for (int k = 0; ok && k < cli->n; k++) {
        ok = look_at(cli->operand[k], b, p, e);
        progress_step(&bar, 1);
        if (!ok)
            break;
        struct doc *d = doc_item(cli->doc, "pictures");
        doc_text(d, "image", cli->operand[k]);
        doc_int(d, "corners", p->seen[p->n].n);
        if (p->seen[p->n].n >= 6) {
            p->image[p->n++] = cli->operand[k];
        } else {
            log_warn("%s: no board of %d x %d inner corners is seen; left out", cli->operand[k],
                     b->cols, b->rows);
            free(p->seen[p->n].id);
            free(p->seen[p->n].px);
            p->seen[p->n] = (struct corners){0};
        }
    }
    progress_end(&bar);
    if (ok && p->n == 0)
        ok = err_set(e, ERR_DATA,
                     "no board of %d x %d inner corners is seen in any picture: --board counts %s; "
                     "a board seen edge-on or cut off cannot be found",
                     b->cols, b->rows, b->marker_m > 0 ? "squares" : "inner corners");
    return ok;
}

static void report(const struct lens *l, struct doc *d)
{
    const struct camera_fit *c = &l->camera;
    const struct plane p = lens_plane(l, l->plane);
    doc_int(d, "views", l->n);
    doc_nums(d, "focal_px", c->focal_px, 2);
    doc_nums(d, "focal_sigma_px", c->focal_sigma_px, 2);
    doc_nums(d, "center_px", c->center_px, 2);
    doc_nums(d, "center_sigma_px", c->center_sigma_px, 2);
    doc_nums(d, "distortion", c->distortion, 5);
    doc_num(d, "rms_px", c->rms_px);
    for (int k = 0; k < l->n; k++) {
        struct doc *v = doc_item(d, "residuals");
        doc_text(v, "image", l->view[k].image);
        doc_num(v, "rms_px", l->view[k].fit.rms_px);
        doc_nums(v, "rotation", l->view[k].fit.rotation, 9);
        doc_nums(v, "origin_m", l->view[k].fit.origin_m, 3);
    }
    doc_text(d, "plane.image", l->view[l->plane].image);
    doc_nums(d, "plane.middle_m", &p.origin_m.x, 3);
    doc_nums(d, "plane.normal", &p.f.n.x, 3);
    doc_nums(d, "plane.tangent", &p.f.t.x, 3);
}

static bool fit(const struct calib_args *a, const struct board *b, struct pictures *p,
                struct cli *cli, struct err *e)
{
    struct lens l = {0};
    bool ok = lens_fit(&l, b, p->seen, p->image, p->n, p->w, p->h, e) ||
              err_in(e, "calib lens: %d pictures", cli->n);
    if (ok && a->plane && (l.plane = lens_view_of(&l, a->plane)) < 0)
        ok = err_set(e, ERR_DATA, "--plane %s: is none of the pictures in which a board is seen",
                     a->plane);
    if (ok) {
        record_settings(&l.head, &p->head);
        l.head.iso = NAN; // a lens does not know it
        ok = lens_write(&l, cli->line, a->out, e);
        report(&l, cli->doc);
    }
    lens_finish(&l);
    return ok;
}

bool calib_lens(const struct calib_args *a, struct cli *cli, struct err *e)
{
    struct board b;
    if (!read_target(a, &b, e))
        return false;
    struct pictures p = {.seen = xcalloc((size_t)cli->n + 1, sizeof *p.seen),
                         .image = xcalloc((size_t)cli->n + 1, sizeof *p.image)};
    const bool ok = look_at_all(cli, &b, &p, e) && fit(a, &b, &p, cli, e);
    for (int k = 0; k <= cli->n; k++) {
        free(p.seen[k].id);
        free(p.seen[k].px);
    }
    free(p.seen);
    free(p.image);
    return ok;
}

bool calib_board(const struct calib_args *a, struct cli *cli, struct err *e)
{
    enum { SQUARE_PX = 120 };
    struct board b;
    struct image im = {0};
    if (!read_target(a, &b, e))
        return false;
    const int w = (b.cols + 3) * SQUARE_PX, h = (b.rows + 3) * SQUARE_PX;
    const size_t n = (size_t)w * (size_t)h;
    uint8_t *grey = sample_alloc(n, 1, "board", e);
    bool ok = grey && cv_board_draw(&b, SQUARE_PX, grey, e) && image_init(&im, w, h, 1, e);
    for (size_t k = 0; ok && k < n; k++)
        im.px[k] = grey[k] > 127 ? 1 : 0;
    ok = ok && image_write(&im, a->out, e);
    if (ok) {
        doc_nums(cli->doc, "size_px", (double[]){w, h}, 2);
        doc_nums(cli->doc, "size_m",
                 (double[]){(b.cols + 3) * b.square_m, (b.rows + 3) * b.square_m}, 2);
    }
    free(grey);
    image_finish(&im);
    return ok;
}
