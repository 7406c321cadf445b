// export_bsdf.c - RGL's .bsdf: a tensor file that its loaders (Mitsuba, pbrt, powitacq) read.
//
// The loaders find f cos_o = rgb(u) ndf / (4 sigma), where u is the half vector's (theta, phi) on
// the unit square, u = (sqrt(2 theta / pi), phi / 2 pi + 1/2), bent by the visible normals' warp.
// We leave the warp straight (vndf constant), ndf = 4 and sigma = 1: then rgb is f cos_o itself.
#define _GNU_SOURCE
#include "core/mem.h"
#include "core/outfile.h"
#include "render/export.h"
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { UINT8 = 1, FLOAT32 = 10 }; // the format's numbers for its types

struct field {
    const char *name;
    int type, ndim;
    uint64_t shape[5];
    const void *data;
};

struct bsdf {
    struct export_bsdf how;
    float *phi_i, *theta_i; // [phis], [thetas] rad
    float *rgb;             // [phis][thetas][3][resolution phi][resolution theta]
    float *luminance;       // [phis][thetas][resolution][resolution]
};

static struct vec3 direction(double theta, double phi)
{
    return v3(sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta));
}

static size_t slice(const struct bsdf *b)
{
    return (size_t)b->how.resolution * (size_t)b->how.resolution;
}

// One incident direction: f cos_o over all half vectors.
static void fill_slice(const struct material *m, struct bsdf *b, int p, int t)
{
    const int n = b->how.resolution;
    const size_t at = (size_t)(p * b->how.thetas + t);
    const struct vec3 wi = direction((double)b->theta_i[t], (double)b->phi_i[p]);
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const double u = (double)i / (n - 1);
            const struct vec3 wm = direction(u * u * M_PI / 2, (2.0 * j / (n - 1) - 1) * M_PI);
            const double dot = v3_dot(wi, wm);
            const struct vec3 wo = v3_sub(v3_scale(2 * dot, wm), wi);
            double f[3] = {0};
            if (dot > 0 && wo.z > 0)
                material_diffraction(m, wo, wi, f);
            const size_t k = (size_t)j * (size_t)n + (size_t)i;
            for (int c = 0; c < 3; c++) // the format has no negative values
                b->rgb[(3 * at + (size_t)c) * slice(b) + k] = (float)fmax(0, f[c]);
            // guides sampling: nowhere 0, so that every slice can be sampled
            b->luminance[at * slice(b) + k] =
                (float)(1e-4 + fmax(0, 0.2126 * f[0] + 0.7152 * f[1] + 0.0722 * f[2]));
        }
}

static bool bsdf_init(struct bsdf *b, const struct material *m, const struct export_bsdf *how,
                      struct err *e)
{
    *b = (struct bsdf){.how = *how};
    const size_t directions = (size_t)how->phis * (size_t)how->thetas;
    b->phi_i = xcalloc((size_t)how->phis, sizeof *b->phi_i);
    b->theta_i = xcalloc((size_t)how->thetas, sizeof *b->theta_i);
    b->rgb = sample_alloc(directions * 3 * slice(b), sizeof *b->rgb, "BSDF", e);
    b->luminance =
        b->rgb ? sample_alloc(directions * slice(b), sizeof *b->luminance, "BSDF", e) : NULL;
    if (!b->luminance)
        return false;
    for (int p = 0; p < how->phis; p++)
        b->phi_i[p] = (float)((2.0 * p / (how->phis - 1) - 1) * M_PI);
    for (int t = 0; t < how->thetas; t++)
        b->theta_i[t] = (float)(80 * M_PI / 180 * t / (how->thetas - 1));
#pragma omp parallel for schedule(dynamic)
    for (int k = 0; k < (int)directions; k++)
        fill_slice(m, b, k / how->thetas, k % how->thetas);
    return true;
}

static void bsdf_finish(struct bsdf *b)
{
    free(b->phi_i);
    free(b->theta_i);
    free(b->rgb);
    free(b->luminance);
}

// Index and fraction of x in n equal steps from 0 to 1.
static int cell(double x, int n, double *f)
{
    const double at = fmin(fmax(x, 0), 1) * (n - 1);
    const int i = at < n - 2 ? (int)at : n - 2;
    *f = at - i;
    return i;
}

static void bsdf_eval(const void *file, struct vec3 wi, struct vec3 wo, double out[3])
{
    const struct bsdf *b = file;
    const int n = b->how.resolution;
    const struct vec3 wm = v3_unit(v3_add(wi, wo));
    double f[4];
    int i[4];
    i[0] = cell(atan2(wi.y, wi.x) / (2 * M_PI) + 0.5, b->how.phis, &f[0]);
    i[1] = cell(acos(wi.z) / (80 * M_PI / 180), b->how.thetas, &f[1]);
    i[2] = cell(atan2(wm.y, wm.x) / (2 * M_PI) + 0.5, n, &f[2]);
    i[3] = cell(sqrt(acos(fmin(wm.z, 1)) * 2 / M_PI), n, &f[3]);
    out[0] = out[1] = out[2] = 0;
    for (int corner = 0; corner < 16; corner++) {
        double weight = 1;
        int at[4];
        for (int d = 0; d < 4; d++) {
            const int up = corner >> d & 1;
            at[d] = i[d] + up;
            weight *= up ? f[d] : 1 - f[d];
        }
        const float *px = b->rgb + (size_t)(at[0] * b->how.thetas + at[1]) * 3 * slice(b) +
                          (size_t)at[2] * (size_t)n + (size_t)at[3];
        for (int c = 0; c < 3; c++)
            out[c] += weight * (double)px[(size_t)c * slice(b)];
    }
}

static size_t field_bytes(const struct field *f)
{
    size_t n = f->type == FLOAT32 ? 4 : 1;
    for (int d = 0; d < f->ndim; d++)
        n *= f->shape[d];
    return n;
}

// Little-endian, as the machines that this runs on are (the build says so).
_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "tensor files are little-endian");

static void put(FILE *f, uint64_t value, size_t bytes)
{
    fwrite(&value, 1, bytes, f);
}

static bool write_fields(const char *path, const struct field *field, int n, struct err *e)
{
    struct outfile o;
    if (!outfile_open(&o, path, e))
        return false;
    FILE *f = fopen(o.tmp, "wbe");
    if (!f) {
        err_errno(e, "%s: cannot write", path);
        outfile_drop(&o);
        return false;
    }
    size_t offset = 12 + 2 + 4;
    for (int k = 0; k < n; k++)
        offset += 2 + strlen(field[k].name) + 2 + 1 + 8 + 8 * (size_t)field[k].ndim;
    fwrite("tensor_file", 1, 12, f);
    put(f, 1, 1); // version 1.0
    put(f, 0, 1);
    put(f, (uint64_t)n, 4);
    for (int k = 0; k < n; k++) {
        put(f, strlen(field[k].name), 2);
        fputs(field[k].name, f);
        put(f, (uint64_t)field[k].ndim, 2);
        put(f, (uint64_t)field[k].type, 1);
        put(f, offset, 8);
        for (int d = 0; d < field[k].ndim; d++)
            put(f, field[k].shape[d], 8);
        offset += field_bytes(&field[k]);
    }
    for (int k = 0; k < n; k++)
        fwrite(field[k].data, 1, field_bytes(&field[k]), f);
    const bool written = !ferror(f);
    const bool ok = (!fclose(f) && written) || err_errno(e, "%s: cannot write", path);
    const bool kept = ok && outfile_commit(&o, e);
    outfile_drop(&o);
    return kept;
}

bool export_bsdf(const struct material *m, const struct export_bsdf *how, const char *path,
                 struct export_loss *loss, struct err *e)
{
    if (how->phis < 3 || how->thetas < 2 || how->resolution < 2)
        return err_set(e, ERR_DATA, "bad size %d x %d x %d: needs 3 azimuths, 2 angles, 2 nodes",
                       how->phis, how->thetas, how->resolution);
    struct bsdf b;
    bool ok = bsdf_init(&b, m, how, e);
    if (ok) {
        loss->error = export_error(m, bsdf_eval, &b);
        snprintf(
            loss->what, sizeof loss->what,
            "Lost: spectra other than the table's own, colours outside sRGB, lobes finer than "
            "%d x %d half vectors, their motion between %d x %d incident directions, incidence "
            "past 80 degrees. Relative L2 error against the table: %.3g.",
            how->resolution, how->resolution, how->phis, how->thetas, loss->error);
        static const float four[4] = {4, 4, 4, 4}, one[4] = {1, 1, 1, 1};
        static const uint8_t jacobian = 1;
        const uint64_t p = (uint64_t)how->phis, t = (uint64_t)how->thetas,
                       r = (uint64_t)how->resolution;
        float *flat = xcalloc((size_t)(p * t) * 4, sizeof *flat);
        for (size_t k = 0; k < (size_t)(p * t) * 4; k++)
            flat[k] = 1;
        const struct field fields[] = {
            {"description", UINT8, 1, {strlen(loss->what)}, loss->what},
            {"phi_i", FLOAT32, 1, {p}, b.phi_i},
            {"theta_i", FLOAT32, 1, {t}, b.theta_i},
            {"ndf", FLOAT32, 2, {2, 2}, four},
            {"sigma", FLOAT32, 2, {2, 2}, one},
            {"vndf", FLOAT32, 4, {p, t, 2, 2}, flat},
            {"luminance", FLOAT32, 4, {p, t, r, r}, b.luminance},
            {"rgb", FLOAT32, 5, {p, t, 3, r, r}, b.rgb},
            {"jacobian", UINT8, 1, {1}, &jacobian},
        };
        ok = write_fields(path, fields, sizeof fields / sizeof *fields, e);
        free(flat);
    }
    bsdf_finish(&b);
    return ok;
}
