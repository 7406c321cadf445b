// lens.c - a lens from the corners of boards; its rays and points.
#define _GNU_SOURCE
#include "calib/lens.h"
#include "core/mem.h"
#include "core/sort.h"
#include <stdlib.h>
#include <string.h>

static void corners_finish(struct corners *c)
{
    free(c->id);
    free(c->px);
}

static struct corners corners_copy(const struct corners *c)
{
    const size_t n = (size_t)c->n;
    struct corners out = {c->n, xcalloc(n, sizeof *out.id), xcalloc(n, sizeof *out.px)};
    if (!n) // of a record without them
        return out;
    memcpy(out.id, c->id, n * sizeof *out.id);
    memcpy(out.px, c->px, n * sizeof *out.px);
    return out;
}

void lens_finish(struct lens *l)
{
    if (!l)
        return;
    for (int k = 0; k < l->n; k++) {
        corners_finish(&l->view[k].seen);
        free(l->view[k].image);
    }
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

struct vec3 lens_corner(const struct lens *l, int view, int k)
{
    const struct board *b = &l->board;
    const struct view_fit *v = &l->view[view].fit;
    const int id = l->view[view].seen.id[k];
    const struct vec3 on_board = v3(id % b->cols * b->square_m, id / b->cols * b->square_m, 0);
    return v3_add(turned(v->rotation, on_board),
                  v3(v->origin_m[0], v->origin_m[1], v->origin_m[2]));
}

double lens_miss(const struct lens *l, int view, int k)
{
    const double *px = l->view[view].seen.px[k];
    double i, j;
    lens_project(l, lens_corner(l, view, k), &i, &j);
    return hypot(i - px[0], j - px[1]);
}

// Leaves out corners that miss by more than six times the median: half hidden, or taken for others.
static int drop_outliers(const struct lens *l)
{
    size_t all = 0, m = 0;
    int dropped = 0;
    for (int v = 0; v < l->n; v++)
        all += (size_t)l->view[v].seen.n;
    double *size = xcalloc(all, sizeof *size);
    for (int v = 0; v < l->n; v++)
        for (int k = 0; k < l->view[v].seen.n; k++)
            size[m++] = lens_miss(l, v, k);
    sort_doubles(size, all);
    const double limit = fmax(0.02, 6 * size[all / 2]);
    free(size);
    for (int v = 0; v < l->n; v++) {
        struct corners *seen = &l->view[v].seen;
        int kept = 0;
        for (int k = 0; k < seen->n; k++) {
            if (lens_miss(l, v, k) > limit && kept + seen->n - k > 6) {
                dropped++;
                continue;
            }
            seen->id[kept] = seen->id[k];
            memcpy(seen->px[kept++], seen->px[k], sizeof *seen->px);
        }
        seen->n = kept;
    }
    return dropped;
}

static bool fit_camera(struct lens *l, int w, int h, struct err *e)
{
    struct camera_fit *c = &l->camera;
    struct corners *seen = xcalloc((size_t)l->n, sizeof *seen);
    struct view_fit *fit = xcalloc((size_t)l->n, sizeof *fit);
    for (int k = 0; k < l->n; k++)
        seen[k] = l->view[k].seen;
    bool ok = cv_board_calibrate(&l->board, seen, l->n, w, h, true, c, fit, e);
    // a k3 that is not there would bend the picture where no corner was
    if (ok && !(fabs(c->distortion[4]) > 4 * c->distortion_sigma[4]))
        ok = cv_board_calibrate(&l->board, seen, l->n, w, h, false, c, fit, e);
    for (int k = 0; ok && k < l->n; k++)
        l->view[k].fit = fit[k];
    free(seen);
    free(fit);
    return ok;
}

bool lens_fit(struct lens *out, const struct board *b, const struct corners *seen,
              char *const image[], int n, int w, int h, struct err *e)
{
    if (n < 3)
        return err_set(e, ERR_DATA, "%d view%s of the board: needs 3 or more, tilted differently",
                       n, n == 1 ? "" : "s");
    struct lens l = {.board = *b, .n = n, .view = xcalloc((size_t)n, sizeof *l.view)};
    for (int k = 0; k < n; k++) {
        l.view[k].image = xstrdup(image[k]);
        l.view[k].seen = corners_copy(&seen[k]);
    }
    bool ok = fit_camera(&l, w, h, e);
    if (ok && drop_outliers(&l))
        ok = fit_camera(&l, w, h, e);
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

struct lens lens_copy(const struct lens *l)
{
    struct lens out = *l;
    out.view = xcalloc((size_t)l->n + 1, sizeof *out.view);
    for (int k = 0; k < l->n; k++)
        out.view[k] = (struct lens_view){xstrdup(l->view[k].image), corners_copy(&l->view[k].seen),
                                         l->view[k].fit};
    return out;
}
