// level.h - the form of a height field, and heights without it.
#pragma once
#include "core/hfield.h"

enum level {
    LEVEL_MEAN,
    LEVEL_PLANE,
    LEVEL_QUADRIC, // tilt and bow
    LEVEL_ROWS,    // each row's median: what a probe's drift leaves in a scan
};

// The least-squares polynomial z = term . (1, x, y, x^2, x y, y^2), with x and y from -1 at the
// first node to 1 at the last.
struct form {
    int nx, ny;
    double term[6];
};

// Through the measured nodes, of degree 0 to 2. ERR_DATA when they do not determine it.
bool form_fit(struct form *f, const struct hfield *hf, int degree, struct err *e);
double form_at(const struct form *f, double i, double j); // a node, or a place between

// Subtracts the form; holes stay holes. ERR_DATA as form_fit().
bool hfield_level(struct hfield *hf, enum level how, struct err *e);
