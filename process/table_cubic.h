// table_cubic.h - a diffraction table between its nodes, to fourth order.
//
// The nodes are samples of a smooth pattern: bilinear look-up widens its lobes by a third of a node
// squared, cubic does not. In node index, so a power p > 1 is smooth too; one-sided at the edges.
#pragma once
#include "core/table.h"

enum { STENCIL = 4 };

// Lagrange weights of the nodes first..first+3 at u; false outside the range. Tables of 2 or 3
// nodes use those, with zero weights behind.
bool table_stencil(const struct table *t, double u, int *first, double weight[STENCIL]);

// As table_eval, cubic between nodes.
void table_cubic(const struct table *t, double u, double v, double w, double out[3]);

// No node is below zero: then what is made of it is not either, though a cubic may be next to a
// lone bright node (by 7 % of it).
bool table_not_negative(const struct table *t);

// How far one has to go for the table to change: root of the integrals of S^2 over |grad S|^2;
// sigma of a Gaussian lobe, the narrow and bright ones count most. 0 for a table of zeros.
double table_detail(const struct table *t);

// Changes an XYZ table to linear sRGB, the colours of the environments; an RGB one stays.
void table_to_rgb(struct table *t);
