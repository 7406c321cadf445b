// regrid.c - crop, turn and resample height fields.
#define _GNU_SOURCE // M_PI
#include "process/regrid.h"
#include "core/image.h"
#include "core/mem.h"
#include "process/bspline.h"
#include "process/fill.h"
#include "process/level.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static float at(const struct hfield *hf, int i, int j)
{
    return hf->z[(size_t)j * (size_t)hf->nx + (size_t)i];
}

static void shift_offset(struct hfield *hf, double x_m, double y_m)
{
    const struct meta_item *o = meta_find(&hf->meta, "nacre.offset_m");
    double offset[2] = {x_m, y_m};
    for (int k = 0; o && o->n == 2 && k < 2; k++)
        offset[k] += o->num[k];
    if (offset[0] != 0 || offset[1] != 0)
        meta_set_nums(&hf->meta, "nacre.offset_m", offset, 2);
}

bool hfield_crop(struct hfield *out, const struct hfield *in, double x_m, double y_m, double w_m,
                 double h_m, struct err *e)
{
    const double i = round(x_m / in->dx_m), j = round(y_m / in->dy_m), nx = round(w_m / in->dx_m),
                 ny = round(h_m / in->dy_m);
    if (!(i >= 0 && j >= 0 && nx >= 2 && ny >= 2 && i + nx <= in->nx && j + ny <= in->ny))
        return err_set(
            e, ERR_DATA,
            "%.4g x %.4g um at (%.4g, %.4g) um is not a part of the field of %.4g x %.4g "
            "um (%d x %d nodes)",
            w_m * 1e6, h_m * 1e6, x_m * 1e6, y_m * 1e6, in->nx * in->dx_m * 1e6,
            in->ny * in->dy_m * 1e6, in->nx, in->ny);
    struct hfield hf;
    if (!hfield_init(&hf, (int)nx, (int)ny, in->dx_m, in->dy_m, e))
        return false;
    for (int k = 0; k < hf.ny; k++)
        memcpy(hf.z + (size_t)k * (size_t)hf.nx,
               in->z + ((size_t)j + (size_t)k) * (size_t)in->nx + (size_t)i,
               (size_t)hf.nx * sizeof *hf.z);
    meta_copy(&hf.meta, &in->meta);
    shift_offset(&hf, i * in->dx_m, j * in->dy_m);
    *out = hf;
    return true;
}

// Spline coefficients of a field without its plane and its holes.
struct smooth {
    const struct hfield *in;
    struct form plane;
    float *c; // [ny][nx], owned
};

static bool smooth_init(struct smooth *s, const struct hfield *in, struct err *e)
{
    *s = (struct smooth){.in = in};
    struct hfield whole = {0};
    long filled;
    if (!hfield_init(&whole, in->nx, in->ny, in->dx_m, in->dy_m, e))
        return false;
    memcpy(whole.z, in->z, (size_t)in->nx * (size_t)in->ny * sizeof *in->z);
    if (!hfield_fill(&whole, &filled, e) || !form_fit(&s->plane, &whole, 1, e) ||
        !hfield_level(&whole, LEVEL_PLANE, e)) {
        hfield_finish(&whole);
        return false;
    }
    bspline_fit_image(whole.z, whole.nx, whole.ny, BSPLINE_CUBIC);
    s->c = whole.z;
    return true;
}

static bool is_hole(const struct hfield *hf, double i, double j)
{
    const int p = (int)fmax(0, fmin(hf->nx - 1, round(i))),
              q = (int)fmax(0, fmin(hf->ny - 1, round(j)));
    return isnan(at(hf, p, q));
}

static bool turn_quarters(struct hfield *out, const struct hfield *in, int quarters, struct err *e)
{
    struct hfield hf;
    const bool odd = quarters % 2;
    if (!hfield_init(&hf, odd ? in->ny : in->nx, odd ? in->nx : in->ny, odd ? in->dy_m : in->dx_m,
                     odd ? in->dx_m : in->dy_m, e))
        return false;
    for (int j = 0; j < hf.ny; j++)
        for (int i = 0; i < hf.nx; i++) {
            const int back_i = hf.nx - 1 - i, back_j = hf.ny - 1 - j;
            hf.z[(size_t)j * (size_t)hf.nx + (size_t)i] = quarters == 0   ? at(in, i, j)
                                                          : quarters == 1 ? at(in, j, back_i)
                                                          : quarters == 2 ? at(in, back_i, back_j)
                                                                          : at(in, back_j, i);
        }
    *out = hf;
    return true;
}

// The largest upright rectangle in a w x h one turned by the angle: it touches all four sides, or
// (narrow ones) only the two long ones.
static void largest_inside(double w, double h, double angle, double *iw, double *ih)
{
    const double s = fabs(sin(angle)), c = fabs(cos(angle)), narrow = fmin(w, h);
    if (narrow <= 2 * s * c * fmax(w, h) || fabs(s - c) < 1e-10) {
        *iw = 0.5 * narrow / (w >= h ? s : c);
        *ih = 0.5 * narrow / (w >= h ? c : s);
    } else {
        *iw = (w * c - h * s) / (c * c - s * s);
        *ih = (h * c - w * s) / (c * c - s * s);
    }
}

static bool turn_freely(struct hfield *out, const struct hfield *in, double angle, struct err *e)
{
    struct smooth s;
    struct hfield hf;
    double w, h;
    const double d = fmin(in->dx_m, in->dy_m), co = cos(angle), si = sin(angle);
    largest_inside((in->nx - 1) * in->dx_m, (in->ny - 1) * in->dy_m, angle, &w, &h);
    const int nx = 1 + (int)(w / d), ny = 1 + (int)(h / d);
    if (!smooth_init(&s, in, e))
        return false;
    if (!hfield_init(&hf, nx, ny, d, d, e)) {
        free(s.c);
        return false;
    }
#pragma omp parallel for schedule(static)
    for (int q = 0; q < ny; q++)
        for (int p = 0; p < nx; p++) {
            const double x = (p - 0.5 * (nx - 1)) * d, y = (q - 0.5 * (ny - 1)) * d;
            const double i = (co * x + si * y) / in->dx_m + 0.5 * (in->nx - 1),
                         j = (co * y - si * x) / in->dy_m + 0.5 * (in->ny - 1);
            if (!is_hole(in, i, j))
                hf.z[(size_t)q * (size_t)nx + (size_t)p] =
                    (float)(bspline_at(s.c, in->nx, in->ny, i, j) + form_at(&s.plane, i, j));
        }
    free(s.c);
    *out = hf;
    return true;
}

bool hfield_turn(struct hfield *out, const struct hfield *in, double angle_rad, struct err *e)
{
    struct hfield hf;
    const double quarters = angle_rad / (M_PI / 2);
    const bool ok = fabs(quarters - round(quarters)) < 1e-9
                        ? turn_quarters(&hf, in, (int)(lround(quarters) % 4 + 4) % 4, e)
                        : turn_freely(&hf, in, angle_rad, e);
    if (!ok)
        return err_in(e, "turned by %.4g deg", angle_rad * 180 / M_PI);
    meta_copy(&hf.meta, &in->meta);
    meta_drop(&hf.meta, "nacre.offset_m"); // of a grid that is no longer along the file's axes
    *out = hf;
    return true;
}

// For each new node of one axis the old coefficients that make it.
struct taps {
    int n;          // a node
    int *first;     // [count]
    double *weight; // [count][n]
};

static void taps_finish(struct taps *t)
{
    free(t->first);
    free(t->weight);
}

// step: new over old spacing. Gaussian and spline are multiplied out on steps of a sixteenth.
static bool taps_init(struct taps *t, int count, double step, struct err *e)
{
    const double sigma = step > 1 ? 0.375 * sqrt(step * step - 1) : 0, fine = 1.0 / 16;
    const int reach = (int)ceil(4 * sigma), parts = (int)(4 * sigma / fine);
    *t = (struct taps){.n = 4 + 2 * reach};
    t->first = sample_alloc((size_t)count, sizeof *t->first, "resampling", e);
    t->weight = sample_alloc((size_t)count * (size_t)t->n, sizeof *t->weight, "resampling", e);
    if (!t->first || !t->weight) {
        taps_finish(t);
        return false;
    }
    for (int k = 0; k < count; k++) {
        const int first = (int)floor(k * step) - 1 - reach;
        double *w = t->weight + (size_t)k * (size_t)t->n, sum = 0;
        t->first[k] = first;
        for (int p = -parts; p <= parts; p++) {
            const double x = k * step + p * fine,
                         g = parts ? exp(-0.5 * pow(p * fine / sigma, 2)) : 1;
            const int i = (int)floor(x);
            double b[4];
            bspline_weights(x - i, b);
            for (int m = 0; m < 4; m++)
                w[i - 1 - first + m] += g * b[m];
            sum += g;
        }
        for (int m = 0; m < t->n; m++)
            w[m] /= sum;
    }
    return true;
}

// along[ny][count] from c[ny][nx], then back the other way; both by rows of the result.
static void resample_rows(const struct taps *t, const float *c, int nx, int ny, int count,
                          float *along)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < ny; j++)
        for (int k = 0; k < count; k++) {
            double sum = 0;
            for (int m = 0; m < t->n; m++)
                sum +=
                    t->weight[(size_t)k * (size_t)t->n + (size_t)m] *
                    (double)c[(size_t)j * (size_t)nx + (size_t)bspline_mirror(t->first[k] + m, nx)];
            along[(size_t)j * (size_t)count + (size_t)k] = (float)sum;
        }
}

static void resample_columns(const struct taps *t, const float *along, int nx, int ny,
                             struct hfield *out)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < out->ny; j++)
        for (int i = 0; i < nx; i++) {
            double sum = 0;
            for (int m = 0; m < t->n; m++)
                sum +=
                    t->weight[(size_t)j * (size_t)t->n + (size_t)m] *
                    (double)
                        along[(size_t)bspline_mirror(t->first[j] + m, ny) * (size_t)nx + (size_t)i];
            out->z[(size_t)j * (size_t)nx + (size_t)i] = (float)sum;
        }
}

bool hfield_resample(struct hfield *out, const struct hfield *in, double dx_m, double dy_m,
                     struct err *e)
{
    const double sx = dx_m / in->dx_m, sy = dy_m / in->dy_m;
    const double nx = floor((in->nx - 1) / sx + 1e-9) + 1, ny = floor((in->ny - 1) / sy + 1e-9) + 1;
    if (!(nx >= 2 && ny >= 2 && nx <= IMAGE_MAX_SIDE && ny <= IMAGE_MAX_SIDE))
        return err_set(e, ERR_DATA,
                       "node spacing %g x %g m leaves %.0f x %.0f nodes: must be 2 to %d a side",
                       dx_m, dy_m, nx, ny, IMAGE_MAX_SIDE);
    struct smooth s = {0};
    struct taps tx = {0}, ty = {0};
    struct hfield hf = {0};
    float *along = sample_alloc((size_t)in->ny * (size_t)nx, sizeof *along, "resampling", e);
    const bool ok = along && smooth_init(&s, in, e) && taps_init(&tx, (int)nx, sx, e) &&
                    taps_init(&ty, (int)ny, sy, e) &&
                    hfield_init(&hf, (int)nx, (int)ny, dx_m, dy_m, e);
    if (ok) {
        resample_rows(&tx, s.c, in->nx, in->ny, hf.nx, along);
        resample_columns(&ty, along, hf.nx, in->ny, &hf);
        for (int j = 0; j < hf.ny; j++)
            for (int i = 0; i < hf.nx; i++) {
                float *z = hf.z + (size_t)j * (size_t)hf.nx + (size_t)i;
                *z = is_hole(in, i * sx, j * sy)
                         ? NAN
                         : (float)((double)*z + form_at(&s.plane, i * sx, j * sy));
            }
        meta_copy(&hf.meta, &in->meta);
        *out = hf;
    }
    taps_finish(&tx);
    taps_finish(&ty);
    free(s.c);
    free(along);
    return ok;
}
