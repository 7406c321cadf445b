// lens_file.c - writing and reading the lens record.
#define _GNU_SOURCE
#include "calib/lens.h"
#include "core/mem.h"

// Number, x and y of each: what a later adjustment needs beside the poses.
static void write_corners(FILE *f, const struct corners *c)
{
    fprintf(f, "  corner: [");
    for (int k = 0; k < c->n; k++)
        fprintf(f, "%s%d, %.4f, %.4f",
                !k      ? ""
                : k % 4 ? ", "
                        : ",\n    ",
                c->id[k], c->px[k][0], c->px[k][1]);
    fprintf(f, "]\n");
}

bool lens_write(const struct lens *l, const char *command, const char *path, struct err *e)
{
    const struct camera_fit *c = &l->camera;
    struct record_file rf;
    record_begin(&rf, &l->head, command);
    record_list(rf.f, "focal_px", c->focal_px, 2);
    record_list(rf.f, "focal_sigma_px", c->focal_sigma_px, 2);
    record_list(rf.f, "center_px", c->center_px, 2);
    record_list(rf.f, "center_sigma_px", c->center_sigma_px, 2);
    fprintf(rf.f, "# k1, k2, p1, p2, k3\n");
    record_list(rf.f, "distortion", c->distortion, 5);
    record_list(rf.f, "distortion_sigma", c->distortion_sigma, 5);
    fprintf(rf.f, "board: {cols: %d, rows: %d, square_m: %.9g", l->board.cols, l->board.rows,
            l->board.square_m);
    if (l->board.marker_m > 0)
        fprintf(rf.f, ", marker_m: %.9g, dictionary: \"%s\"", l->board.marker_m,
                l->board.dictionary);
    fprintf(rf.f, "}\nplane: %d # the view whose board lay where the sample lies\n", l->plane);
    fprintf(rf.f, "# camera = rotation board + origin_m; x right, y down, z forward\nviews:\n");
    for (int k = 0; k < l->n; k++) {
        const struct lens_view *v = &l->view[k];
        fprintf(rf.f, "- image: \"%s\"\n  corners: %d\n  rms_px: %.6g\n", v->image, v->seen.n,
                v->fit.rms_px);
        fprintf(rf.f, "  ");
        record_list(rf.f, "rotation", v->fit.rotation, 9);
        fprintf(rf.f, "  ");
        record_list(rf.f, "origin_m", v->fit.origin_m, 3);
        write_corners(rf.f, &v->seen);
    }
    return record_end(&rf, path, e);
}

// A record may tell how many there were and not where.
static bool read_corners(struct corners *c, const struct board *b, struct ynode *y, struct err *e)
{
    int n;
    struct ynode *list = NULL;
    if (!ymap_int(y, "corners", Y_NEEDED, 4, 1000000, &n, e) ||
        !ymap_list(y, "corner", Y_OPTIONAL, &list, e))
        return false;
    if (!list)
        return true;
    if (ylist_count(list) != 3 * n)
        return yaml_bad(list, e, "has %d numbers, must have 3 for each of %d corners",
                        ylist_count(list), n);
    *c = (struct corners){n, xcalloc((size_t)n, sizeof *c->id), xcalloc((size_t)n, sizeof *c->px)};
    for (int k = 0; k < n; k++) {
        double id;
        if (!ynode_num(ylist_at(list, 3 * k), UNIT_NONE, 0, b->cols * b->rows - 1, &id, e) ||
            !ynode_num(ylist_at(list, 3 * k + 1), UNIT_NONE, -1e6, 1e6, &c->px[k][0], e) ||
            !ynode_num(ylist_at(list, 3 * k + 2), UNIT_NONE, -1e6, 1e6, &c->px[k][1], e))
            return false;
        c->id[k] = (int)id;
    }
    return true;
}

static bool read_view(struct lens_view *v, const struct board *b, struct ynode *y, struct err *e)
{
    const char *image = NULL;
    if (!ymap_text(y, "image", Y_NEEDED, &image, e) || !read_corners(&v->seen, b, y, e) ||
        !ymap_num(y, "rms_px", Y_NEEDED, UNIT_NONE, 0, 1e6, &v->fit.rms_px, e) ||
        !record_read_list(y, "rotation", -1.001, 1.001, v->fit.rotation, 9, e) ||
        !record_read_list(y, "origin_m", -1e4, 1e4, v->fit.origin_m, 3, e))
        return false;
    v->image = xstrdup(image);
    return true;
}

static bool read_board(struct board *b, struct ynode *root, struct err *e)
{
    struct ynode *y;
    const char *dictionary = "";
    if (!ymap_map(root, "board", Y_NEEDED, &y, e) ||
        !ymap_int(y, "cols", Y_NEEDED, 2, 1000, &b->cols, e) ||
        !ymap_int(y, "rows", Y_NEEDED, 2, 1000, &b->rows, e) ||
        !ymap_num(y, "square_m", Y_NEEDED, UNIT_NONE, 1e-9, 100, &b->square_m, e) ||
        !ymap_num(y, "marker_m", Y_OPTIONAL, UNIT_NONE, 1e-9, 100, &b->marker_m, e) ||
        !ymap_text(y, "dictionary", Y_OPTIONAL, &dictionary, e))
        return false;
    snprintf(b->dictionary, sizeof b->dictionary, "%s", dictionary);
    return true;
}

static bool read_all(struct lens *l, struct ynode *root, const char *path, struct err *e)
{
    struct camera_fit *c = &l->camera;
    struct ynode *views;
    if (!record_read(&l->head, root, path, "lens", e) ||
        !record_read_list(root, "focal_px", 1e-3, 1e7, c->focal_px, 2, e) ||
        !record_read_list(root, "focal_sigma_px", 0, 1e7, c->focal_sigma_px, 2, e) ||
        !record_read_list(root, "center_px", -1e6, 1e6, c->center_px, 2, e) ||
        !record_read_list(root, "center_sigma_px", 0, 1e7, c->center_sigma_px, 2, e) ||
        !record_read_list(root, "distortion", -1e6, 1e6, c->distortion, 5, e) ||
        !record_read_list(root, "distortion_sigma", 0, 1e9, c->distortion_sigma, 5, e) ||
        !read_board(&l->board, root, e) || !ymap_list(root, "views", Y_NEEDED, &views, e))
        return false;
    const int n = ylist_count(views);
    l->view = xcalloc((size_t)n + 1, sizeof *l->view);
    for (; l->n < n; l->n++)
        if (!read_view(&l->view[l->n], &l->board, ylist_at(views, l->n), e)) {
            l->n++; // what it owns
            return false;
        }
    return ymap_int(root, "plane", Y_NEEDED, 0, n - 1, &l->plane, e);
}

bool lens_read(struct lens *out, const char *path, struct err *e)
{
    struct yaml *y;
    struct lens l = {0};
    if (!yaml_open(&y, path, e))
        return false;
    bool ok = read_all(&l, yaml_root(y), path, e);
    ok = yaml_close(y, ok, e) && ok;
    if (ok)
        *out = l;
    else
        lens_finish(&l);
    return ok;
}
