// hdr_out.c - the result of a merge and what can be said of it.
#include "process/hdr_out.h"
#include "core/mem.h"
#include "core/sort.h"
#include <math.h>
#include <stdlib.h>

bool hdr_out_init(struct hdr_out *o, int w, int h, int nc, struct err *e)
{
    static const char *const names[] = {"Y,var.Y,mask", "Y,A,var.Y,var.A,mask",
                                        "R,G,B,var.R,var.G,var.B,mask",
                                        "R,G,B,A,var.R,var.G,var.B,var.A,mask"};
    *o = (struct hdr_out){.nc = nc};
    if (nc < 1 || nc > RESPONSE_CHANNELS)
        return err_set(e, ERR_DATA, "frames have %d channels: must be 1 to %d", nc,
                       RESPONSE_CHANNELS);
    if (!image_init(&o->im, w, h, 2 * nc + 1, e))
        return false;
    meta_set_text(&o->im.meta, "channels", names[nc - 1]);
    o->state = xcalloc((size_t)h * 3, sizeof *o->state);
    return true;
}

bool hdr_out_take(struct hdr_out *o, struct image *out, struct hdr_counts *counts, struct err *e)
{
    long n[3] = {0};
    for (int k = 0; k < 3 * o->im.h; k++)
        n[k % 3] += o->state[k];
    free(o->state);
    if (!n[HDR_MEASURED]) {
        image_finish(&o->im);
        return err_set(e, ERR_DATA, "every pixel is %s in every frame",
                       !n[HDR_BLACK]       ? "saturated"
                       : !n[HDR_SATURATED] ? "black"
                                           : "black or saturated");
    }
    *counts = (struct hdr_counts){
        .samples = n[0] + n[1] + n[2], .saturated = n[HDR_SATURATED], .black = n[HDR_BLACK]};
    *out = o->im;
    return true;
}

double hdr_range_stops(const struct image *im)
{
    const size_t n = (size_t)im->w * (size_t)im->h, nc = (size_t)im->nc / 2, step = 2 * nc + 1;
    float *v = xcalloc(n * nc, sizeof *v);
    size_t m = 0;
    for (size_t k = 0; k < n; k++)
        for (size_t c = 0; im->px[k * step + step - 1] > 0 && c < nc; c++)
            if (im->px[k * step + c] > sqrtf(im->px[k * step + nc + c]))
                v[m++] = im->px[k * step + c];
    sort_floats(v, m);
    const double stops = m ? log2((double)v[(size_t)(0.999 * (double)(m - 1))] /
                                  (double)v[(size_t)(0.001 * (double)(m - 1))])
                           : NAN;
    free(v);
    return stops;
}
