// lut_job.c - from the options of nacre lut to a request.
#define _GNU_SOURCE
#include "ui/lut_job.h"
#include "calib/passband.h"
#include "core/imgfile.h"
#include "core/log.h"
#include "process/lut_geometry.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// The channel asked for; in a colour photograph else the one that sees the wavelength best.
static bool pick_channel(const struct image *im, const struct lut_args *a, double lambda_m,
                         int *channel, struct err *e)
{
    *channel = 0;
    if (im->nc == 1) // a mono camera's photograph is its own channel
        return true;
    const char *name = a->channel           ? a->channel
                       : lambda_m >= 590e-9 ? "r"
                       : lambda_m >= 490e-9 ? "g"
                                            : "b";
    *channel = image_channel_index(im, name);
    if (*channel < 0 && !a->channel) // a mono camera's, perhaps with variance and mask beside it
        *channel = image_channel_index(im, "Y");
    if (*channel < 0)
        return err_set(e, ERR_DATA, "no channel %s: the picture has %d channel%s", name, im->nc,
                       im->nc == 1 ? "" : "s");
    if (!a->channel)
        log_note("channel %s, by the wavelength", name);
    return true;
}

static bool put_center(struct lut_pattern *p, const char *option, const char *text, struct err *e)
{
    if (!strcmp(text, "auto"))
        return lut_pattern_center(p, e);
    double at[2];
    const int n = cli_numbers(text, UNIT_NONE, at, 2, e);
    if (n != 2)
        return n < 0 ? err_in(e, "--%s", option)
                     : err_set(e, ERR_USAGE, "--%s needs X,Y or auto, not '%s'", option, text);
    p->cx = at[0];
    p->cy = at[1];
    if (!(at[0] >= 0 && at[1] >= 0 && at[0] <= p->w - 1 && at[1] <= p->h - 1))
        return err_set(e, ERR_DATA, "centre (%g, %g) is outside the %d x %d image", at[0], at[1],
                       p->w, p->h);
    return true;
}

// Out to where the reddest light of a table's corner comes from.
static double reach_of(const struct lut_args *a, double lambda_m)
{
    return a->range * lambda_m / (CIE_FIRST_NM * 1e-9) * 1.02;
}

static bool place(struct lut_pattern *p, const struct image *im, int channel, double lambda_m,
                  const struct lut_args *a, const char *center_option, const char *center,
                  struct err *e)
{
    if (!a->geometry) {
        if (isnan(a->h_per_px))
            return err_set(e, ERR_USAGE, "give --h-per-pixel X (and --center), or --geometry FILE");
        if (!lut_pattern_init(p, im, channel, a->scale, e))
            return false;
        p->h_per_px = a->h_per_px;
        return put_center(p, center_option, center, e);
    }
    struct image geometry = {0};
    if (!isnan(a->h_per_px) || strcmp(a->center, "auto"))
        return err_set(e, ERR_USAGE,
                       "--geometry knows where h is: leave out --h-per-pixel and "
                       "--center");
    if (!image_read(&geometry, a->geometry, e))
        return false;
    const bool ok = record_image_fits(&geometry, a->geometry, "geometry", im, e) &&
                    (lut_geometry(im, channel, &geometry, a->scale, reach_of(a, lambda_m), p, e) ||
                     err_in(e, "%s", a->geometry));
    image_finish(&geometry);
    return ok;
}

// A record of another filter: the photograph says what it was taken through.
static bool band_fits(const struct lut_job *job, const struct image *photo, struct err *e)
{
    const char *path = job->args->band;
    double taken_m;
    if (*job->band_made.kind && !record_fits_image(&job->band_made, path, photo, e))
        return false;
    if (!meta_num(&photo->meta, "nacre.lambda_m", &taken_m))
        return true;
    const double band_m = lut_effective_wavelength(&job->band, 2);
    return fabs(taken_m - band_m) < 20e-9 ||
           err_set(e, ERR_DATA, "%s: made for %.0f nm, but this was taken at %.0f nm", path,
                   band_m * 1e9, taken_m * 1e9);
}

static bool read_pattern(const struct lut_job *job, struct lut_pattern *p, const char *path,
                         double lambda_m, const char *center_option, const char *center,
                         struct err *e)
{
    const struct lut_args *a = job->args;
    struct image im = {0};
    int channel = 0;
    if (!image_read(&im, path, e))
        return false;
    bool ok = (pick_channel(&im, a, lambda_m, &channel, e) &&
               (p != &job->pattern || !job->band.n || band_fits(job, &im, e))) ||
              err_in(e, "%s", path);
    ok = ok && (place(p, &im, channel, lambda_m, a, center_option, center, e) ||
                (e->code == ERR_DATA && !a->geometry ? err_in(e, "%s", path) : false));
    image_finish(&im);
    if (ok && p->unseen && !a->geometry)
        log_warn("%s: %ld pixels count as not measured (not finite, or saturated in every frame)",
                 path, p->unseen);
    return ok;
}

// A curve of nm,value or a record of nacre calib spectral.
static bool read_band(const char *path, struct spectrum *band, struct record *made, struct err *e)
{
    const char *ext = path_ext(path);
    struct passband record;
    if (strcmp(ext, ".yaml") && strcmp(ext, ".yml"))
        return spectrum_read_csv(band, path, e);
    if (!passband_read(&record, path, e))
        return false;
    if (!passband_agrees(&record))
        log_warn("%s: its grating showed %.1f nm, its curves %.1f nm", path, record.grating_m * 1e9,
                 record.lambda_m * 1e9);
    *band = record.band;
    *made = record.head;
    return true;
}

// The wavelength that was given, or the centre of the band.
static bool find_wavelength(struct lut_job *job, double exponent, struct err *e)
{
    const struct lut_args *a = job->args;
    job->lambda_m = a->lambda_m;
    if (a->band && !read_band(a->band, &job->band, &job->band_made, e))
        return false;
    if (a->deband && !a->band)
        return err_set(e, ERR_USAGE, "--deband needs --band FILE");
    if (!a->band)
        return !isnan(a->lambda_m) ||
               err_set(e, ERR_USAGE, "give --lambda L, or --band FILE to take it from");
    const double effective_m = lut_effective_wavelength(&job->band, exponent);
    if (!(effective_m > 0))
        return err_set(e, ERR_DATA, "%s: the band lets no light through", a->band);
    if (isnan(a->lambda_m))
        job->lambda_m = effective_m;
    else if (fabs(a->lambda_m - effective_m) > 2e-9)
        log_warn("--lambda is %.1f nm, but the band's effective wavelength is %.1f nm",
                 a->lambda_m * 1e9, effective_m * 1e9);
    return true;
}

bool lut_job_wavelength(const struct lut_args *args, double *lambda_m, struct err *e)
{
    struct lut_job job = {.args = args};
    const double exponent = strtod(args->exponent, NULL);
    const bool ok = find_wavelength(&job, exponent > 0 ? exponent : 2, e);
    *lambda_m = job.lambda_m;
    spectrum_finish(&job.band);
    return ok;
}

// "auto": from the second photograph. A whole exponent within two standard errors is taken as
// meant.
static bool find_exponent(struct lut_job *job, struct err *e)
{
    const struct lut_args *a = job->args;
    job->exponent_sigma = NAN;
    if (strcmp(a->exponent, "auto")) {
        job->exponent = strtod(a->exponent, NULL);
        return true;
    }
    if (!a->second || isnan(a->second_lambda_m))
        return err_set(e, ERR_USAGE,
                       "--exponent auto needs the sample through another filter: "
                       "--second PATTERN --second-lambda L");
    struct lut_pattern second = {0};
    const bool ok = read_pattern(job, &second, a->second, a->second_lambda_m, "second-center",
                                 a->second_center, e) &&
                    lut_exponent(&job->pattern, job->lambda_m, &second, a->second_lambda_m,
                                 &job->exponent, &job->exponent_sigma, e);
    lut_pattern_finish(&second);
    if (!ok)
        return false;
    const double measured = job->exponent, whole = measured < 3 ? 2 : 4;
    if (fabs(measured - whole) <= fmax(2 * job->exponent_sigma, 0.02))
        job->exponent = whole;
    log_note("exponent %.3f +- %.3f: taken as %g", measured, job->exponent_sigma, job->exponent);
    return true;
}

// The part of a photograph of a mirror that shows the light.
static bool read_psf(struct lut_job *job, struct err *e)
{
    const struct lut_args *a = job->args;
    if (!a->psf)
        return true;
    struct image im = {0};
    if (!image_read(&im, a->psf, e))
        return false;
    double crop[4] = {0, 0, im.w, im.h}; // x, y, w, h
    bool ok = true;
    if (a->psf_crop) {
        const int n = cli_numbers(a->psf_crop, UNIT_NONE, crop, 4, e);
        if (n != 4)
            ok = n < 0 ? err_in(e, "--psf-crop")
                       : err_set(e, ERR_USAGE, "--psf-crop needs X,Y,W,H, not '%s'", a->psf_crop);
        for (int k = 0; k < 4; k++)
            crop[k] = floor(crop[k]);
        if (ok && !(crop[0] >= 0 && crop[1] >= 0 && crop[2] >= 4 && crop[3] >= 4 &&
                    crop[0] + crop[2] <= im.w && crop[1] + crop[3] <= im.h))
            ok = err_set(e, ERR_DATA, "--psf-crop %s: must be 4 x 4 pixels or more of %s, %d x %d",
                         a->psf_crop, a->psf, im.w, im.h);
    }
    const int x = (int)crop[0], y = (int)crop[1], w = (int)crop[2], h = (int)crop[3];
    const int nc = im.nc >= 3 ? 3 : 1;
    ok = ok && image_init(&job->psf_image, w, h, nc, e);
    for (int j = 0; ok && j < h; j++)
        for (int i = 0; i < w; i++)
            memcpy(job->psf_image.px + ((size_t)j * (size_t)w + (size_t)i) * (size_t)nc,
                   im.px + ((size_t)(y + j) * (size_t)im.w + (size_t)(x + i)) * (size_t)im.nc,
                   (size_t)nc * sizeof *im.px);
    image_finish(&im);
    const double h_per_px = isnan(a->psf_h_per_px) ? job->pattern.h_per_px : a->psf_h_per_px;
    job->psf = (struct lut_psf){&job->psf_image, h_per_px, 0.5 * (w - 1), 0.5 * (h - 1)};
    return ok;
}

bool lut_job_open(struct lut_job *job, const char *pattern, const struct lut_args *args,
                  struct err *e)
{
    *job = (struct lut_job){.args = args};
    const double exponent = strtod(args->exponent, NULL); // auto: 0
    const bool ok =
        illuminant_get(&job->light, args->illuminant, e) &&
        find_wavelength(job, exponent > 0 ? exponent : 2, e) &&
        read_pattern(job, &job->pattern, pattern, job->lambda_m, "center", args->center, e) &&
        find_exponent(job, e) && read_psf(job, e);
    if (!ok)
        lut_job_finish(job);
    return ok;
}

static enum lut_method method_of(const char *name)
{
    enum lut_method m = LUT_AUTO;
    while (strcmp(lut_method_name(m), name))
        m++;
    return m;
}

bool lut_job_build(const struct lut_job *job, struct table *t, struct lut_report *report,
                   struct err *e)
{
    const struct lut_args *a = job->args;
    const struct lut_request r = {
        .pattern = &job->pattern,
        .lambda_m = job->lambda_m,
        .light = &job->light,
        .f0 = a->f0,
        .exponent = job->exponent,
        .n = a->size,
        .range = a->range,
        .power = a->power,
        .is_rgb = a->rgb,
        .method = method_of(a->method),
        .tolerance = a->tolerance,
        .wavelengths = a->wavelengths,
        .band = a->deband ? &job->band : NULL,
        .noise_limit = a->noise_limit,
        .filters = job->filters,
        .filter = job->filter,
    };
    return job->psf_image.px ? lut_build_psf(&r, &job->psf, t, report, e)
                             : lut_build(&r, t, report, e);
}

void lut_job_finish(struct lut_job *job)
{
    spectrum_finish(&job->light);
    spectrum_finish(&job->band);
    lut_pattern_finish(&job->pattern);
    image_finish(&job->psf_image);
    *job = (struct lut_job){0};
}
