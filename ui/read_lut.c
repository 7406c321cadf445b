// read_lut.c - the diffraction table of a command line.
#define _GNU_SOURCE
#include "ui/read_lut.h"
#include "core/imgfile.h"
#include "process/table_cubic.h"
#include <math.h>
#include <string.h>

bool read_lut(struct table *t, const char *path, double range, int power, struct err *e)
{
    const struct table_nodes assume = {range, power};
    if (!table_read(t, path, isnan(range) ? NULL : &assume, e))
        return false;
    const size_t n = (size_t)t->n, samples = (size_t)t->count * n * n * 3;
    for (size_t k = 0; k < samples; k++)
        if (!isfinite(t->tab[k])) {
            const size_t node = k / 3 % (n * n);
            err_set(e, ERR_DATA, "%s: node (%zu, %zu) is %g: must be finite", path, node % n,
                    node / n, (double)t->tab[k]);
            table_finish(t);
            return false;
        }
    if (!strcmp(path_ext(path), ".pfm"))
        t->is_rgb = true;
    table_to_rgb(t);
    return true;
}
