// diffraction.h - XYZ = sum over wavelengths of weight |S(u, v, w; lambda)|^2 on a grid of (u, v).
//
// S = sum over nodes of g exp(i 2 pi w h / lambda) exp(-i 2 pi (u x + v y) / lambda) (D14; physics
// section 4), from the transforms of moments.h. What is made of S at a point is a small table of
// functions: sampled over w (diffraction_at_w) or as powers of w (taylor.h).
#pragma once
#include "process/patch.h"
#include "process/spectral.h"
#include <stddef.h>

struct diffraction {
    const struct patch *patch;
    const struct spectral *light;
    const double *u, *v; // [nu], [nv] the grid; the points (-u, -v) come for free
    int nu, nv;
    int repeat[2]; // copies of the patch in x and y (S13 2.7), 1: just it
    bool absolute; // weights times area of coherence / lambda^2
    size_t memory; // bytes that transforms and cells may take; done in parts to keep to it
};

// What |S|^2 is multiplied by: 1, or area of coherence / lambda^2 when absolute.
double diffraction_scale(const struct diffraction *d, double lambda_m);

// What becomes of S: `add` adds wavelength l of one column of the grid to the cells of the column.
// moment[nv][2: re, im][count], even polynomials first; weight[nv][3].
struct diffraction_use {
    int count;   // polynomials wanted
    size_t cell; // bytes of a cell, a multiple of 64 or not aligned; zero to start with
    void (*add)(const struct diffraction_use *use, int l, int nv, const float *moment,
                const float *weight, void *plus, void *minus);
};

// Called once per column iu with its cells [nv] at (u, v) and at (-u, -v). Columns come from many
// threads, but those of a bundle (iu / DIFFRACTION_BUNDLE) in order and never two at once: sums per
// bundle are the same on any number of threads.
enum { DIFFRACTION_BUNDLE = 8 };
typedef void diffraction_sink(void *ctx, int iu, const void *plus, const void *minus);

// ERR_DATA when the memory cannot hold a strip of the transforms (it names what would); ERR_FILE.
bool diffraction_run(const struct diffraction *d, const struct diffraction_use *use,
                     diffraction_sink *sink, void *ctx, struct err *e);

// Samples over w: the cell is float xyz[3][at_w_stride(nw)].
struct diffraction_use *at_w_new(const struct patch *p, const struct spectral *light,
                                 const double *w, int nw, struct err *e);
void at_w_free(struct diffraction_use *use);
int at_w_stride(int nw); // nw rounded up for the vector units
