// factor.h - a diffraction table as a few products of one-dimensional filters (R17).
//
// With (u, v) = axis[0] a + axis[1] b, axes of unit length:
//   composition     S(u, v) = sum over rank of f0(a) f1(b), the best of that rank per channel
//   sum             two directional blurs: S is all on the lines b = 0 and a = 0, and f0(a) da,
//                   f1(b) db are what the lines hold (TV screens)
//   one-dimensional one blur, f0(a) da (CDs)
// The square roots of the singular values are shared between the two filters.
#pragma once
#include "core/table.h"

enum factor_kind { FACTOR_COMPOSITION, FACTOR_SUM, FACTOR_LINE };
extern const char *const factor_kind_names[]; // "composition", "sum", "one-dimensional"

struct factors {
    enum factor_kind kind;
    int n, rank; // nodes of a filter; rank is 1 unless a composition
    double range;
    int power;         // nodes of a and b as in table.h
    double axis[2][2]; // (u, v) of a = 1 and of b = 1
    float *f[2];       // [rank][n][3] linear sRGB, owned; f[1] is NULL for a line
    double *error;     // [rank][4] relative Frobenius error with so many products: R, G, B, all
    struct meta meta;
};

// `rgb` is a plain table in linear sRGB. With `align` the two main directions become the axes.
// detect: find out whether the pattern is a sum or a line; else it is a composition.
// ERR_DATA: rank not 1 to n, a table over w.
bool factor(struct factors *f, const struct table *rgb, int rank, bool align, bool detect,
            struct err *e);
void factors_finish(struct factors *f); // accepts a zeroed struct

// An .exr file: f0 above f1 if there is one, a row for each rank; the rest is metadata.
bool factors_read(struct factors *f, const char *path, struct err *e);
bool factors_is_file(const char *path); // says that it holds factors; false also when unreadable
bool factors_write(const struct factors *f, const char *path, struct err *e); // .exr

// The two lines through h = 0 with the most green, at least `apart` (radians) apart: angles to the
// u axis, 0 to pi, the brighter one first.
void factor_directions(const struct table *rgb, double apart_rad, double angle_rad[2]);
