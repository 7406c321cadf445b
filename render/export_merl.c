// export_merl.c - MERL's binary: f on 90 x 90 x 180 bins of half and difference angles.
#define _GNU_SOURCE
#include "core/mem.h"
#include "core/outfile.h"
#include "render/export.h"
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

enum { HALVES = 90, DIFFERENCES = 90, AZIMUTHS = 180, BINS = HALVES * DIFFERENCES * AZIMUTHS };

static const double scale[3] = {1 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0}; // of the format

// A direction given about the half vector at (theta_h, phi_h), in the surface frame.
static struct vec3 from_half(double theta_h, double phi_h, struct vec3 d)
{
    const double x = cos(theta_h) * d.x + sin(theta_h) * d.z;
    const double z = -sin(theta_h) * d.x + cos(theta_h) * d.z;
    return v3(cos(phi_h) * x - sin(phi_h) * d.y, sin(phi_h) * x + cos(phi_h) * d.y, z);
}

// The middle of a bin; half angles crowd towards 0: index = 90 sqrt(theta_h / 90 deg).
static void bin(const struct material *m, double azimuth_rad, int k, double out[3])
{
    const double root = (k / (DIFFERENCES * AZIMUTHS) + 0.5) / HALVES;
    const double theta_h = root * root * M_PI / 2;
    const double theta_d = (k / AZIMUTHS % DIFFERENCES + 0.5) / DIFFERENCES * M_PI / 2;
    const double phi_d = (k % AZIMUTHS + 0.5) / AZIMUTHS * M_PI;
    const double s = sin(theta_d), c = cos(theta_d);
    const struct vec3 wi = from_half(theta_h, azimuth_rad, v3(s * cos(phi_d), s * sin(phi_d), c));
    const struct vec3 wo = from_half(theta_h, azimuth_rad, v3(-s * cos(phi_d), -s * sin(phi_d), c));
    out[0] = out[1] = out[2] = 0;
    if (wi.z <= 1e-3 || wo.z <= 1e-3)
        return;
    material_diffraction(m, wi, wo, out);
    for (int q = 0; q < 3; q++)
        out[q] = fmax(0, out[q] / wi.z);
}

struct merl {
    double *f; // [3][BINS] scaled
};

// As the format's own reader looks it up: the bin that a pair falls into.
static void merl_eval(const void *file, struct vec3 wi, struct vec3 wo, double out[3])
{
    const struct merl *m = file;
    const struct vec3 h = v3_unit(v3_add(wi, wo));
    const double theta_h = acos(fmin(h.z, 1)), phi_h = atan2(h.y, h.x);
    // wi about the half vector: turned back by phi_h, then by theta_h
    const double x = cos(phi_h) * wi.x + sin(phi_h) * wi.y;
    const double y = -sin(phi_h) * wi.x + cos(phi_h) * wi.y;
    const struct vec3 d =
        v3(cos(theta_h) * x - sin(theta_h) * wi.z, y, sin(theta_h) * x + cos(theta_h) * wi.z);
    double phi_d = atan2(d.y, d.x);
    if (phi_d < 0)
        phi_d += M_PI;
    const int i = (int)fmin(HALVES * sqrt(theta_h * 2 / M_PI), HALVES - 1);
    const int j = (int)fmin(DIFFERENCES * acos(fmin(d.z, 1)) * 2 / M_PI, DIFFERENCES - 1);
    const int k = (int)fmin(AZIMUTHS * phi_d / M_PI, AZIMUTHS - 1);
    for (int c = 0; c < 3; c++)
        out[c] = m->f[c * BINS + (i * DIFFERENCES + j) * AZIMUTHS + k] * scale[c] * wo.z;
}

static bool write_file(const struct merl *m, const char *path, struct err *e)
{
    static const int32_t size[3] = {HALVES, DIFFERENCES, AZIMUTHS};
    const size_t bytes = sizeof size + 3 * (size_t)BINS * sizeof(double);
    char *all = sample_alloc(bytes, 1, "MERL", e);
    if (!all)
        return false;
    FILE *f = fmemopen(all, bytes, "wb");
    fwrite(size, sizeof size, 1, f);
    fwrite(m->f, sizeof(double), 3 * (size_t)BINS, f);
    fclose(f);
    const bool ok = outfile_write(path, all, bytes, e);
    free(all);
    return ok;
}

bool export_merl(const struct material *m, double azimuth_rad, const char *path,
                 struct export_loss *loss, struct err *e)
{
    struct merl file = {sample_alloc(3 * (size_t)BINS, sizeof(double), "MERL", e)};
    if (!file.f)
        return false;
#pragma omp parallel for schedule(static)
    for (int k = 0; k < BINS; k++) {
        double f[3];
        bin(m, azimuth_rad, k, f);
        for (int c = 0; c < 3; c++)
            file.f[c * BINS + k] = f[c] / scale[c];
    }
    loss->error = export_error(m, merl_eval, &file);
    const int n = snprintf(loss->what, sizeof loss->what,
                           "Lost: every azimuth of the half vector but %g degrees from t (MERL "
                           "is isotropic), spectra other than the table's own, colours outside "
                           "sRGB, lobes finer than a degree. Relative L2 error against the table: "
                           "%.3g.",
                           azimuth_rad * 180 / M_PI, loss->error);
    char *note = xasprintf("%s.txt", path);
    const bool ok = write_file(&file, path, e) && outfile_write(note, loss->what, (size_t)n, e);
    free(note);
    free(file.f);
    return ok;
}
