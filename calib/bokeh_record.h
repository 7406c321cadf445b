// bokeh_record.h - what a photograph of a known blazed grating says about bokeh photographs.
//
// How a picture becomes heights, with one record for both sides:
//   1. the channel named here, its disc found anew (calib/disc.h), divided by the smooth light
//      inside it, so that the level named here is 1;
//   2. Richardson-Lucy with a Gaussian of sigma_px, `iterations` accelerated rounds with BOKEH_TV
//      of total variation, in sensor pixels;
//   3. turned clockwise by turn_rad: the sensor shows the sample turned counter-clockwise by it
//      (as a viewer of the picture sees it, row 0 on top);
//   4. height = gain_m * (I - offset) metres: dark is deep; a node every m_per_px.
#pragma once
#include "calib/record.h"

#define BOKEH_TV 0.005 // without it edges ring: 8 % of a simulated phone's height, with it 7 %

struct bokeh_channel {
    char name[8];    // "B", "G", "R" or "Y"
    double sigma_px; // of the PSF
    int iterations;  // of Richardson-Lucy
    double gain_m, offset;
    double level; // mean of the grating's disc, in samples of the file; 0: not known
    double rmse;  // as of the first; of others: of the blurred blaze that was fitted
};

struct bokeh_record {
    struct record head;
    char channel[8];                // the one that the figures below are of
    double lines_per_m, blaze_rad;  // of the grating
    double cx_px, cy_px, radius_px; // of the disc
    double turn_rad;
    double lines;                    // periods across the disc's diameter
    double m_per_px, m_per_px_sigma; // on the sample; one standard deviation
    double sigma_px;                 // of the PSF
    int iterations;                  // of Richardson-Lucy
    double gain_m, offset;
    double level;      // mean of the grating's disc, in samples of the file; 0: not known
    double exposure_s; // of that photograph; NAN: not known
    double rmse;       // of the grating's profile, relative to its height
    int n_other;       // channels that were calibrated too
    struct bokeh_channel other[2];
};

bool bokeh_record_write(const struct bokeh_record *b, const char *command, const char *path,
                        struct err *e);
// ERR_FILE: cannot be opened; ERR_DATA: not such a record, a value out of range.
bool bokeh_record_read(struct bokeh_record *b, const char *path, struct err *e);
// Refuses a photograph by another camera, lens, aperture, focus, distance or resolution.
bool bokeh_record_fits(const struct bokeh_record *b, const char *path, const struct image *photo,
                       struct err *e);

void bokeh_record_take(struct bokeh_record *b, const struct bokeh_channel *c); // as its first

// Takes the figures of another channel; ERR_DATA when it was not calibrated.
bool bokeh_record_select(struct bokeh_record *b, const char *channel, struct err *e);

// The sample value that is I = 1 in this photograph: the record's, times the ratio of the exposures
// (time and ISO) where both photographs tell theirs; 0 when the record does not know it: then the
// mean of the disc itself.
double bokeh_record_level(const struct bokeh_record *b, const struct image *im);
