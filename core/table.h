// table.h - a diffraction table: colour over (u, v), or L tables whose weights are curves in w.
//
// Nodes  column i of n holds u = R sgn(s)|s|^p, s = 2i/(n-1) - 1, ends included; rows the same for
// v,
//        the row index grows with v. R is the range, p an odd power (1 linear, 5 in D14 and T17).
// Value  at (u, v, w): sum over m of basis_m(w) * tab[m](u, v). A plain table has one, with
// basis 1.
#pragma once
#include "core/image.h"

enum table_basis { TABLE_PLAIN, TABLE_TAYLOR, TABLE_CHEBYSHEV, TABLE_POD };

struct table {
    int n;        // nodes a side, >= 2
    double range; // R > 0
    int power;    // p, odd, >= 1
    bool is_rgb;  // linear sRGB; else XYZ
    int count;    // L >= 1
    float *tab;   // [count][n][n][3], owned

    enum table_basis basis;
    double w_min, w_max; // where the curves hold; TABLE_PLAIN: not used
    int nw;              // samples of a POD curve at equal steps from w_min to w_max
    double *curve;       // [count][nw], owned; NULL unless TABLE_POD

    float *sigma;     // [n][n][3] one standard deviation of tab[0], owned; NULL when not known
    float *cover;     // [n][n] 1 where the measurement reached the whole band, 0 where not; or NULL
    struct meta meta; // illuminant, observer, lambda_m, f0, error per count, provenance
};

// All zero, TABLE_PLAIN for count 1. ERR_DATA: n < 2, range not positive and finite, even power.
bool table_init(struct table *t, int n, double range, int power, int count, struct err *e);
void table_finish(struct table *t); // accepts a zeroed struct

bool table_nodes_check(int n, double range, int power, struct err *e); // the rule of table_init

double table_node(const struct table *t, int i);     // u of column i (v of row i)
double table_index(const struct table *t, double u); // its inverse, fractional; NAN outside [-R, R]

// The weight of table m at w. Outside [w_min, w_max] the nearest end counts for POD curves.
double table_weight(const struct table *t, int m, double w);

// Bilinear between nodes, as a renderer reads it; black outside the range. w is ignored by a plain
// table. Uses the first `count` tables when 0 < count < t->count.
void table_eval(const struct table *t, double u, double v, double w, int count, double out[3]);

// Files: .exr holds everything; .pfm and .hdr the samples of a plain table only. When reading one
// of those (or an EXR without our metadata) `assume` gives range and power; without it ERR_DATA.
struct table_nodes {
    double range;
    int power;
};
bool table_write(const struct table *t, const char *path, struct err *e);
bool table_read(struct table *t, const char *path, const struct table_nodes *assume, struct err *e);
