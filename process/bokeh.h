// bokeh.h - a height field from the out-of-focus highlight of a shiny sample (T17 section 5, App.
// C).
//
// The steps and their order are those of the calibration record (calib/bokeh_record.h): disc,
// smooth light, Richardson-Lucy, turn, affine map to metres. The result is the largest square
// inside the disc.
#pragma once
#include "calib/bokeh_record.h"
#include "calib/disc.h"
#include "core/hfield.h"
#include "process/bokeh_fold.h"

struct bokeh_options {
    const char *channel; // "R", "G", "B", "Y"; NULL: the record's
    bool level;          // subtract the least-squares plane
    enum {
        BOKEH_2D,
        BOKEH_1D,
        BOKEH_1D_IF_LINES
    } lines;      // average along the lines of a grating or CD
    bool lattice; // fold a picture that repeats in two directions into one cell
    enum {
        BOKEH_KEEP,
        BOKEH_WINDOW,
        BOKEH_TILE
    } edge; // of the square: as it is, faded, or cut so that copies continue (process/tile.h)
    double f_number; // of the lens; NAN: the picture's aperture, else 5.6
};

struct bokeh_result {
    char channel[8];
    struct disc disc;
    double score[3]; // contrast over noise of R, G, B in the disc; one channel: [0] only
    int iterations;  // of Richardson-Lucy
    enum fold_kind fold;
    double strain,
        turned_rad; // of a folded tile's wave vectors, and of its axes, so that it closes
    double seam;    // of another tile: hfield_tile()
    int n_periods;
    struct period period[2];
    double sd_m; // standard deviation of the heights
    double
        cutoff_per_m; // where the lens stops: 1 / (520 nm f_number), on the sensor (T17: 343 lp/mm)
};

// ERR_DATA: no such channel, no usable disc, a disc too small for the record's PSF.
bool bokeh_height(const struct image *im, const struct bokeh_record *rec,
                  const struct bokeh_options *opt, struct hfield *out, struct bokeh_result *res,
                  struct err *e);
