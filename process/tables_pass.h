// tables_pass.h - one run over all nodes of a table: what the bases of tables.h share.
#pragma once
#include "process/diffraction.h"
#include "process/tables.h"
#include "process/wnodes.h"

struct tables_pass {
    const struct tables_spec *spec; // not owned
    struct patch patch;
    struct spectral light;
    double *node; // [n] u of columns, v of rows, owned
    int first;    // columns first .. n-1 have u >= 0; their mirrors come with them
};

// `s` must outlive the pass. The nodes come with tables_pass_nodes(), when their number is known.
bool tables_pass_init(struct tables_pass *p, const struct tables_spec *s, const struct hfield *hf,
                      struct err *e);
bool tables_pass_nodes(struct tables_pass *p, struct err *e);
void tables_pass_finish(struct tables_pass *p); // accepts a zeroed struct

double tables_pass_scale(const struct tables_pass *p, int l); // diffraction_scale() of a wavelength
int tables_pass_bundles(const struct tables_pass *p);

// Gets every column i of the table once: row j has the cell j, or n - 1 - j when `reversed`.
// Columns of a bundle come in order, never two at once.
typedef void tables_take(void *ctx, int bundle, int i, const void *cells, bool reversed);

bool tables_pass_run(const struct tables_pass *p, const struct diffraction_use *use, size_t memory,
                     tables_take *take, void *ctx, struct err *e);

// Gauss-Legendre nodes enough for |S|^2 over the range of w, `least` or more; looks at a few
// columns when the number that is enough for any field would be expensive.
bool tables_wnodes(const struct tables_pass *p, int least, struct wnodes *q, struct err *e);
