// heights.c - a height field as the commands take it: file, units, holes.
#include "ui/heights.h"
#include "core/hfield_file.h"
#include "core/log.h"
#include "process/fill.h"
#include <math.h>

static bool check_holes(const struct hfield *hf, const char *path, struct err *e)
{
    const long missing = hfield_missing(hf);
    for (long k = 0; missing && k < (long)hf->nx * hf->ny; k++)
        if (isnan(hf->z[k]))
            return err_set(
                e, ERR_DATA,
                "%s: node (%ld, %ld) was not measured (%ld such nodes): --fill fills them", path,
                k % hf->nx, k / hf->nx, missing);
    return true;
}

bool heights_read(struct hfield *hf, const char *path, const struct heights_opts *o, struct err *e)
{
    struct hfield_hints hints = {.z_scale_m = isnan(o->z_scale_m) ? 0 : o->z_scale_m};
    if (o->pixel) {
        double d[2];
        const int n = cli_numbers(o->pixel, UNIT_M, d, 2, e);
        if (n < 0)
            return err_in(e, "--pixel");
        for (int k = 0; k < n; k++)
            if (!(d[k] > 0))
                return err_set(e, ERR_DATA, "--pixel: %g m: node spacings must be positive", d[k]);
        hints.dx_m = d[0];
        hints.dy_m = n > 1 ? d[1] : d[0];
    }
    struct hfield got = {0};
    if (!hfield_read(&got, path, &hints, e))
        return false;
    long filled = 0;
    const bool ok = o->holes  ? true
                    : o->fill ? hfield_fill(&got, &filled, e) || err_in(e, "%s", path)
                              : check_holes(&got, path, e);
    if (filled)
        log_note("%s: filled %ld nodes of %ld", path, filled, (long)got.nx * got.ny);
    if (!ok) {
        hfield_finish(&got);
        return false;
    }
    *hf = got;
    return true;
}
