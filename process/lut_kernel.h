// lut_kernel.h - the integral of lut.h as a sum over scalings of the pattern: s = ln(lm / l).
#pragma once
#include "process/logpolar.h"
#include "process/lut.h"

// Channels X, Y, Z, with (lm/l)^e, P cmf dl and 1 / (4 pi^2 F0^2) in the weights. `skipped`: the
// share of 380..780 nm that is left out because P cmf is nothing there.
bool lut_kernel_init(struct lp_kernel *k, const struct lut_request *r, double *skipped,
                     struct err *e);
// The same factor at one wavelength: (lm/l)^e / (4 pi^2 F0^2) and the photograph's part.
double lut_factor(const struct lut_request *r, double lambda_m);
void lut_kernel_finish(struct lp_kernel *k); // accepts a zeroed struct

// Changes the kernel so that it also undoes the band of the photograph, r->band; *gain is what that
// does to the noise of the pixels, at most r->noise_limit.
bool lut_deband(struct lp_kernel *k, const struct lut_request *r, double *gain, struct err *e);

// The methods: t is initialised, and XYZ.
typedef bool lut_fn(const struct lut_request *r, const struct lp_kernel *k, struct table *t,
                    struct lut_report *report, struct err *e);
lut_fn lut_exact, lut_sampled, lut_floor;

// Nodes of the table in pixels of the pattern, from the centre: x[n], the caller frees it.
double *lut_node_px(const struct table *t, const struct lut_pattern *p);

// table.cover: 1 where the photograph saw the pattern over the whole band. Returns the share of
// nodes without.
bool lut_cover(const struct lut_pattern *p, const struct lp_kernel *k, struct table *t,
               double *uncovered, struct err *e);

// table.sigma from the pattern's variance, taking the noise of pixels as independent; `averaged`:
// the table is the mean of the pattern's two halves.
bool lut_sigma(const struct lut_pattern *p, const struct lp_kernel *k, bool averaged,
               struct table *t, struct err *e);
