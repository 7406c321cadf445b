// lens.c - the lens record: fitting, rays and points, reading and writing.
#define _GNU_SOURCE
#include "calib/lens.h"
#include "core/mem.h"
#include "core/sort.h"
#include <stdlib.h>
#include <string.h>

void lens_finish(struct lens *l)
{
    if (!l)
        return;
    for (int k = 0; k < l->n; k++)
        free(l->view[k].image);
    free(l->view);
    *l = (struct lens){0};
}

static struct vec3 turned(const double r[9], struct vec3 a)
{
    return v3(r[0] * a.x + r[1] * a.y + r[2] * a.z, r[3] * a.x + r[4] * a.y + r[5] * a.z,
              r[6] * a.x + r[7] * a.y + r[8] * a.z);
}

struct plane lens_plane(const struct lens *l, int view)
{
    const struct view_fit *fit = &l->view[view].fit;
    const struct board *b = &l->board;
    const struct vec3 middle =
        v3(0.5 * (b->cols - 1) * b->square_m, 0.5 * (b->rows - 1) * b->square_m, 0);
    struct plane p = {.origin_m = v3_add(turned(fit->rotation, middle),
                                         v3(fit->origin_m[0], fit->origin_m[1], fit->origin_m[2]))};
    p.f.t = turned(fit->rotation, v3(1, 0, 0));
    p.f.n = turned(fit->rotation, v3(0, 0, 1));
    if (!(b->marker_m > 0) && p.f.t.x < 0)
        p.f.t = v3_scale(-1, p.f.t);
    if (v3_dot(p.f.n, p.origin_m) > 0)
        p.f.n = v3_scale(-1, p.f.n);
    p.f.b = v3_cross(p.f.n, p.f.t);
    return p;
}

// The largest angle between the normals of two views, radians.
static double tilt_range(const struct lens *l)
{
    double most = 0;
    for (int a = 0; a < l->n; a++)
        for (int b = 0; b < a; b++) {
            const struct vec3 p = lens_plane(l, a).f.n, q = lens_plane(l, b).f.n;
            most = fmax(most, atan2(v3_norm(v3_cross(p, q)), v3_dot(p, q)));
        }
    return most;
}

static bool judge(const struct lens *l, struct err *e)
{
    const struct camera_fit *c = &l->camera;
    const double sigma =
        fmax(c->focal_sigma_px[0] / c->focal_px[0], c->focal_sigma_px[1] / c->focal_px[1]);
    const double tilt_deg = tilt_range(l) * 180 / M_PI;
    if (!(c->focal_px[0] > 0 && c->focal_px[1] > 0 && isfinite(c->rms_px)))
        return err_set(e, ERR_DATA, "the views do not determine a camera");
    if (tilt_deg < 5)
        return err_set(e, ERR_DATA,
                       "the board is tilted alike in all %d views (within %.1f deg): they cannot "
                       "tell the focal length from the distance; tilt it by 20 deg and more",
                       l->n, tilt_deg);
    if (!(sigma < 0.01))
        return err_set(e, ERR_DATA,
                       "the focal length stays unknown by %.1f %% (at most 1 %%): take more views, "
                       "tilted more, that fill the picture",
                       100 * sigma);
    if (c->rms_px > 2)
        return err_set(e, ERR_DATA,
                       "the corners miss the best camera by %.1f px: another board, or not one "
                       "camera and focus",
                       c->rms_px);
    return true;
}

static void distort(const double k[5], double x, double y, double out[2])
{
    const double r2 = x * x + y * y, radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
    out[0] = x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x);
    out[1] = y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y;
}

// The inverse by Newton's method with the derivatives of the model.
static void undistort(const double k[5], double at[2])
{
    double x = at[0], y = at[1];
    for (int turn = 0; turn < 20; turn++) {
        double f[2];
        distort(k, x, y, f);
        const double r2 = x * x + y * y, radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
        const double slope = 2 * (k[0] + r2 * (2 * k[1] + 3 * r2 * k[4])); // d radial / (r dr)
        const double xx = radial + slope * x * x + 2 * k[2] * y + 6 * k[3] * x;
        const double xy = slope * x * y + 2 * k[2] * x + 2 * k[3] * y;
        const double yy = radial + slope * y * y + 6 * k[2] * y + 2 * k[3] * x;
        const double ex = at[0] - f[0], ey = at[1] - f[1], det = xx * yy - xy * xy;
        x += (yy * ex - xy * ey) / det;
        y += (xx * ey - xy * ex) / det;
        if (fabs(ex) + fabs(ey) < 1e-14)
            break;
    }
    at[0] = x;
    at[1] = y;
}

struct vec3 lens_ray(const struct lens *l, double i, double j)
{
    const struct camera_fit *c = &l->camera;
    double at[2] = {(i - c->center_px[0]) / c->focal_px[0], (j - c->center_px[1]) / c->focal_px[1]};
    undistort(c->distortion, at);
    return v3_unit(v3(at[0], at[1], 1));
}

void lens_project(const struct lens *l, struct vec3 at, double *i, double *j)
{
    const struct camera_fit *c = &l->camera;
    double d[2];
    distort(c->distortion, at.x / at.z, at.y / at.z, d);
    *i = c->center_px[0] + c->focal_px[0] * d[0];
    *j = c->center_px[1] + c->focal_px[1] * d[1];
}

// How far corner k of a view is from where the lens puts it, px.
static double miss(const struct lens *l, const struct view_fit *v, const struct corners *c, int k)
{
    const struct board *b = &l->board;
    const struct vec3 on_board =
        v3(c->id[k] % b->cols * b->square_m, c->id[k] / b->cols * b->square_m, 0);
    const struct vec3 at =
        v3_add(turned(v->rotation, on_board), v3(v->origin_m[0], v->origin_m[1], v->origin_m[2]));
    double i, j;
    lens_project(l, at, &i, &j);
    return hypot(i - c->px[k][0], j - c->px[k][1]);
}

// Leaves out corners that miss by more than six times the median: half hidden, or taken for others.
static int drop_outliers(const struct lens *l, const struct view_fit *fit, struct corners *seen)
{
    size_t all = 0, m = 0;
    int dropped = 0;
    for (int v = 0; v < l->n; v++)
        all += (size_t)seen[v].n;
    double *size = xcalloc(all, sizeof *size);
    for (int v = 0; v < l->n; v++)
        for (int k = 0; k < seen[v].n; k++)
            size[m++] = miss(l, &fit[v], &seen[v], k);
    sort_doubles(size, all);
    const double limit = fmax(0.02, 6 * size[all / 2]);
    free(size);
    for (int v = 0; v < l->n; v++) {
        int kept = 0;
        for (int k = 0; k < seen[v].n; k++) {
            if (miss(l, &fit[v], &seen[v], k) > limit && kept + seen[v].n - k > 6) {
                dropped++;
                continue;
            }
            seen[v].id[kept] = seen[v].id[k];
            memcpy(seen[v].px[kept++], seen[v].px[k], sizeof *seen[v].px);
        }
        seen[v].n = kept;
    }
    return dropped;
}

static bool fit_camera(struct lens *l, const struct corners *seen, int w, int h,
                       struct view_fit *fit, struct err *e)
{
    struct camera_fit *c = &l->camera;
    if (!cv_board_calibrate(&l->board, seen, l->n, w, h, true, c, fit, e))
        return false;
    // a k3 that is not there would bend the picture where no corner was
    return fabs(c->distortion[4]) > 4 * c->distortion_sigma[4] ||
           cv_board_calibrate(&l->board, seen, l->n, w, h, false, c, fit, e);
}

bool lens_fit(struct lens *out, const struct board *b, struct corners *seen, char *const image[],
              int n, int w, int h, struct err *e)
{
    if (n < 3)
        return err_set(e, ERR_DATA, "%d view%s of the board: needs 3 or more, tilted differently",
                       n, n == 1 ? "" : "s");
    struct lens l = {.board = *b, .n = n, .view = xcalloc((size_t)n, sizeof *l.view)};
    struct view_fit *fit = xcalloc((size_t)n, sizeof *fit);
    bool ok = fit_camera(&l, seen, w, h, fit, e);
    if (ok && drop_outliers(&l, fit, seen))
        ok = fit_camera(&l, seen, w, h, fit, e);
    for (int k = 0; k < n; k++)
        l.view[k] = (struct lens_view){xstrdup(image[k]), seen[k].n, fit[k]};
    free(fit);
    ok = ok && judge(&l, e);
    if (!ok) {
        lens_finish(&l);
        return false;
    }
    record_init(&l.head, "lens", "this camera and lens at this focus and resolution",
                l.camera.rms_px, "rms of the corners, px");
    l.head.w = w;
    l.head.h = h;
    *out = l;
    return true;
}

static const char *name_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

int lens_view_of(const struct lens *l, const char *image)
{
    for (int k = 0; k < l->n; k++)
        if (!strcmp(l->view[k].image, image))
            return k;
    for (int k = 0; k < l->n; k++)
        if (!strcmp(name_of(l->view[k].image), name_of(image)))
            return k;
    return -1;
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
        fprintf(rf.f, "- image: \"%s\"\n  corners: %d\n  rms_px: %.6g\n", v->image, v->corners,
                v->fit.rms_px);
        fprintf(rf.f, "  ");
        record_list(rf.f, "rotation", v->fit.rotation, 9);
        fprintf(rf.f, "  ");
        record_list(rf.f, "origin_m", v->fit.origin_m, 3);
    }
    return record_end(&rf, path, e);
}

static bool read_view(struct lens_view *v, struct ynode *y, struct err *e)
{
    const char *image = NULL;
    if (!ymap_text(y, "image", Y_NEEDED, &image, e) ||
        !ymap_int(y, "corners", Y_NEEDED, 4, 1000000, &v->corners, e) ||
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
        if (!read_view(&l->view[l->n], ylist_at(views, l->n), e))
            return false;
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
