// lut_job.h - what nacre lut was asked for, and the pattern, band and light it reads for that.
#pragma once
#include "calib/record.h"
#include "process/lut_psf.h"
#include "ui/cli.h"

struct lut_args {
    const char *lambda, *band; // of several photographs lists, which cmd_lut takes apart
    double lambda_m;           // NAN: from the band
    bool deband;
    double noise_limit;
    const char *channel;
    double h_per_px; // NAN: from the geometry
    const char *center, *geometry;
    double scale;
    const char *exponent, *second, *second_center;
    double second_lambda_m;
    const char *illuminant;
    double f0;
    int size;
    double range;
    int power;
    bool rgb;
    const char *method;
    double tolerance;
    int wavelengths;
    const char *psf, *psf_crop;
    double psf_h_per_px;
    const char *out;
};

struct lut_job {
    const struct lut_args *args;
    struct spectrum light, band; // band.n 0: none given
    struct record band_made;     // when and with what; empty for a bare curve
    double lambda_m;
    struct lut_pattern pattern;
    double exponent, exponent_sigma; // sigma NAN: given, not measured
    struct image psf_image;          // px NULL: a point
    struct lut_psf psf;
    const struct lut_filters *filters; // of several photographs this is number `filter`; or NULL
    int filter;
};

// The wavelength that a photograph counts for: given, else its band's.
bool lut_job_wavelength(const struct lut_args *args, double *lambda_m, struct err *e);
// Reads everything; says what it chose. false: nothing to finish.
bool lut_job_open(struct lut_job *job, const char *pattern, const struct lut_args *args,
                  struct err *e);
bool lut_job_build(const struct lut_job *job, struct table *t, struct lut_report *report,
                   struct err *e);
void lut_job_finish(struct lut_job *job); // accepts a zeroed struct
