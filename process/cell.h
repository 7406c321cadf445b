// cell.h - all cells of a periodic picture folded into one, which has hardly any noise left and is
// sampled more finely than the picture: it can be sharpened beyond what a picture allows.
#pragma once
#include "process/lattice.h"

struct cell {
    struct lattice lattice;
    double cx_px, cy_px; // where the phases are 0
    int ns, nt;          // samples along both sides, about 4 a pixel
    double *mean;        // [nt][ns] of the pixels in each sample's bin
    bool centred;        // at the bin's middle; else over all of the bin
    double *count;       // [nt][ns] of those pixels
    double *blurred;     // [nt][ns] the sharp cell under blur, pixel and bin
    double *sharp;       // [nt][ns] mean over a pixel
    double noise;        // standard deviation of one pixel about the mean of its bin
    double
        unexplained; // variance of the picture about `blurred`, less white noise, relative to its
};

// Folds the flattened disc at (cx, cy) of `flat`.
bool cell_fold(struct cell *c, const struct lattice *l, const struct disc *d, const float *flat,
               int w, int h, struct err *e);
// Folds again about `blurred`, which has to be there: bins then tell of their middles.
bool cell_refold(struct cell *c, const struct disc *d, const float *flat, int w, int h,
                 struct err *e);
// The mean of each pixel's bin, 1 beyond the disc's bins.
void cell_picture(const struct cell *c, int w, int h, float *out);
// Fills `blurred` and `sharp`: of the cells that explain the mean to its noise the one with the
// least total variation along the lattice's directions.
bool cell_sharpen(struct cell *c, double sigma_px, struct err *e);
// Fills `unexplained`.
void cell_judge(struct cell *c, const struct disc *d, const float *flat, int w, int h);
void cell_finish(struct cell *c); // accepts a zeroed struct

double cell_at(const struct cell *c, const double *samples, double i, double j); // at pixel (i, j)
