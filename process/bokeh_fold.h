// bokeh_fold.h - a bokeh's disc folded into one period of its lines or one cell of its lattice,
// where it is made of nothing else.
#pragma once
#include "process/bokeh_flat.h"
#include "process/bokeh_lines.h"
#include "process/cell.h"
#include "process/periods.h"

struct fold {
    enum fold_kind { FOLD_NONE, FOLD_LINES, FOLD_LATTICE } kind;
    struct lines lines;
    struct cell cell;
};

// Tries lines, then a lattice. `always`: what lines there are, whatever they leave. False only
// without memory; kind tells what became of it. The light of f is found anew beside a lattice.
bool fold_lines(struct fold *fold, const struct flat *f, double sigma_px, bool always);
bool fold_lattice(struct fold *fold, struct flat *f, double sigma_px, struct err *e);
void fold_finish(struct fold *fold); // accepts a zeroed struct

double fold_at(const struct fold *fold, double i,
               double j); // mean over that pixel of the disc's part

// Takes a period that was measured on the square to the fold's own, which all of the disc tells;
// the sample is turned by turn_rad on the picture.
void fold_snap(const struct fold *fold, double turn_rad, double m_per_px, struct period *p);

// Strains the fold, as little as it can, so that it repeats after nx and after ny nodes of the
// sample; those are chosen over half of what they are. Where that takes more than 1 %, the sample
// is first turned by *turned (from x towards y) to the lattice's own sides. Returns the strain.
double fold_fit(struct fold *fold, double turn_rad, int *nx, int *ny, double *turned);
